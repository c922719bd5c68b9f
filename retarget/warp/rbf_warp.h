#pragma once

#include <Eigen/Core>
#include <span>

#include "base/rbf.h"
#include "motion/motion_clip.h"

namespace mouthpiece {

struct WarpOptions {
  RbfKernel kernel = RbfKernel::kInverseMultiquadric;
  bool any_kernel = false;  ///< choose kernel, shape and regularisation by leave-one-out cross-validation
  /// c of the inverse multiquadric as a multiple of the markers' mean nearest-neighbour distance; 0: the one of
  /// a few with the smallest leave-one-out error is taken.
  double shape_factor = 0;
  /// 0 interpolates the landmarks exactly, or with `any_kernel` leaves it to be chosen; more smooths
  /// (RbfOptions::regularization).
  double regularization = 0;
};

/// What the regularisation is chosen from where WarpOptions leaves it open, rising; no unit.
std::span<const double> regularizationCandidates();

/// How good a warp is, in the target's unit.
struct WarpSummary {
  double landmark_rms = 0;  ///< what regularisation leaves at the landmarks
  double landmark_max = 0;
  double shape_factor = 0;  ///< the one used
};

/// The volume warp of EDGE 6: f: R3 -> R3 from the actor's space (mm) to the target mesh's space (its unit), radial
/// functions plus an affine term, fitted once between the neutral markers and their places on the target.
class RbfWarp {
 public:
  /// Both markers x 3, the same markers in the same order. Throws InputError when markers coincide or are flat.
  static RbfWarp fit(const MarkerPositions& actor_neutral_mm, const MarkerPositions& target,
                     const WarpOptions& options = {});

  /// points x 3 -> points x 3.
  [[nodiscard]] MarkerPositions targetFromActor(const MarkerPositions& points_mm) const;
  /// Frames of the markers (frames x 3 * markers), each relative to neutral: f(p) - f(neutral) + target, so that
  /// `actor_neutral_mm` lands on `target` with any regularisation. `actor_neutral_mm` may be another actor's.
  [[nodiscard]] PositionMatrix targetFromActorRelative(const PositionMatrix& frames_mm,
                                                       const MarkerPositions& actor_neutral_mm) const;
  /// d targetFromActor / d point, at one point (mm). Its determinant is negative where the warp folds space over.
  [[nodiscard]] Eigen::Matrix3d jacobian(const Eigen::Vector3d& point_mm) const;

  [[nodiscard]] const WarpSummary& summary() const { return summary_; }
  [[nodiscard]] const WarpOptions& options() const { return options_; }

 private:
  RbfWarp(RbfInterpolant interpolant, MarkerPositions target)
      : interpolant_(std::move(interpolant)), target_(std::move(target)) {}

  RbfInterpolant interpolant_;
  MarkerPositions target_;
  WarpOptions options_;
  WarpSummary summary_;
};

/// Error at each landmark of the warp fitted to the others with the same shape, RMS in the target's unit; `options`
/// must have a shape_factor.
double leaveOneOutRms(const MarkerPositions& actor_neutral_mm, const MarkerPositions& target,
                      const WarpOptions& options);

}  // namespace mouthpiece
