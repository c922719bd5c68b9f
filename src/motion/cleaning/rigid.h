#pragma once

#include <Eigen/Core>
#include <optional>

#include "motion/motion_clip.h"

namespace mouthpiece {

/// x -> rotation * x + translation_mm.
struct RigidMotion {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation_mm = Eigen::Vector3d::Zero();

  [[nodiscard]] Eigen::Vector3d apply(const Eigen::Vector3d& point) const { return rotation * point + translation_mm; }
  [[nodiscard]] RigidMotion inverse() const { return {rotation.transpose(), -(rotation.transpose() * translation_mm)}; }
  /// The motion that applies `first`, then this one.
  [[nodiscard]] RigidMotion after(const RigidMotion& first) const {
    return {rotation * first.rotation, rotation * first.translation_mm + translation_mm};
  }
};

struct RigidFitOptions {
  /// Rounds of reweighting that take markers off which do not move with the rest (Geman-McClure); 0: plain least
  /// squares.
  int robust_rounds = 5;
};

/// The rigid motion that brings `source` nearest to `target` in the least-squares sense (Kabsch 1976, no reflection).
/// Rows correspond; a row with NaN in either is left out. nullopt when fewer than three remain or they lie on one line.
std::optional<RigidMotion> fitRigidMotion(const MarkerPositions& source, const MarkerPositions& target,
                                          const RigidFitOptions& options = {});

}  // namespace mouthpiece
