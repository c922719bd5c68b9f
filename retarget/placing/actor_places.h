#pragma once

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

#include "motion/motion_clip.h"

namespace mouthpiece {

/// The actor's markers and inner eye corners by name, both sides alike.
class ActorPlaces {
 public:
  ActorPlaces(const std::vector<std::string>& marker_names, const MarkerPositions& neutral);

  [[nodiscard]] const std::map<std::string, Eigen::Vector3d>& places() const { return places_; }

 private:
  /// Not captured; where they are follows from the lids and the outer corners.
  void addEyeCorners();

  std::map<std::string, Eigen::Vector3d> places_;
};

/// Displacements at scattered places, smoothed: the kernel -r with a constant (conditionally positive definite);
/// `stiffness` is added on the diagonal, 0 meets a place exactly.
class SmoothedMoves {
 public:
  /// `stiffness`: one a place. Throws InputError where two places that are met exactly coincide.
  SmoothedMoves(MarkerPositions places, const MarkerPositions& displacements, const Eigen::VectorXd& stiffness);

  [[nodiscard]] MarkerPositions at(const MarkerPositions& queries) const;

 private:
  MarkerPositions places_;
  Eigen::MatrixXd weights_;
};

}  // namespace mouthpiece
