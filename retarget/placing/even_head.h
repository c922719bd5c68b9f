#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "deform/mesh/triangles.h"

namespace mouthpiece {

struct FaceMesh;

/// The name of the marker on the other side; of one in the middle its own.
std::string otherSideOf(const std::string& name);

/// A head that a plane mirrors onto itself, its mouth too.
class EvenHead {
 public:
  /// About where the outer corners of the eyes and the middle of the mouth are.
  struct Places {
    Eigen::Vector3d eye_right, eye_left, mouth;
  };
  /// nullopt for a head that is not alike on both sides. `mesh` must stand upright.
  static std::optional<EvenHead> of(const FaceMesh& mesh, const Places& places);

  [[nodiscard]] const Eigen::Vector3d& normal() const { return normal_; }

  [[nodiscard]] Eigen::Vector3d mirrored(const Eigen::Vector3d& place) const {
    return place - 2 * (normal_.dot(place) - offset_) * normal_;
  }
  /// In the plane, halfway between `right` and the mirror image of `left`, or of itself.
  [[nodiscard]] Eigen::Vector3d halfway(const Eigen::Vector3d& right, const Eigen::Vector3d& left) const {
    return 0.5 * (right + mirrored(left));
  }

  /// Where the plane cuts triangles: pieces of a profile.
  using Profile = std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>>;
  [[nodiscard]] Profile profileOf(const FaceMesh& mesh, const std::vector<Triangle>& triangles) const;

 private:
  EvenHead(Eigen::Vector3d normal, double offset) : normal_(std::move(normal)), offset_(offset) {}

  Eigen::Vector3d normal_;
  double offset_;
};

/// The point of a profile that is closest to `place`; nullopt of an empty one.
std::optional<Eigen::Vector3d> closestOn(const EvenHead::Profile& profile, const Eigen::Vector3d& place);

}  // namespace mouthpiece
