#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

namespace mouthpiece {

struct Ball {
  Eigen::Vector3d middle;
  double radius = 0;
};

/// The sphere through `places`, four or more, by least squares: |p - m|^2 = r^2 is linear in m and r^2 - |m|^2. Where
/// they lie in a plane the radius may be NaN.
Ball sphereThrough(std::span<const Eigen::Vector3d> places);
/// The same; nothing where they are no ball.
std::optional<Ball> ballThrough(std::span<const Eigen::Vector3d> places);

}  // namespace mouthpiece
