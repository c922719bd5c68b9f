#pragma once

#include <Eigen/Core>
#include <vector>

#include "deform/surface/control_surface.h"

namespace mouthpiece {

/// x -> x + turn * x + shift: a rigid motion as what it adds to a point, so that rest adds exactly nothing.
struct AddedMotion {
  Eigen::Matrix3d turn = Eigen::Matrix3d::Zero();
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();
};

/// The lower jaw as a hinge: it turns about a point between its joints (opening, and a little to the side) and slides
/// forward; least squares over the chin's and jaw's markers. A free rigid fit would take skin that stretches for bone
/// that turns.
class JawHinge {
 public:
  /// Without chin or jaw markers among the points the jaw never moves.
  explicit JawHinge(const ControlMesh& mesh);

  /// `control_points`: controlPoints()'s, of which only markers are used.
  [[nodiscard]] AddedMotion motion(const MarkerPositions& control_points) const;
  [[nodiscard]] const Eigen::Vector3d& pivot() const { return pivot_; }

 private:
  struct Guide {
    int point;
    double weight;
    Eigen::Vector3d rest;
  };
  std::vector<Guide> guides_;
  Eigen::Vector3d pivot_ = Eigen::Vector3d::Zero();
  double lever_ = 1;  ///< distance of the chin from the pivot: makes turns and slides comparable
};

}  // namespace mouthpiece
