#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

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

/// What removeHeadMotion took off.
struct HeadMotion {
  MotionClip still;  ///< the clip in the reference's coordinates, head at rest; a frame without a fit is NaN
  std::vector<std::optional<RigidMotion>> reference_from_world;  ///< one a frame; nullopt: too few markers seen
  std::size_t frames_without_fit = 0;
  double fit_rms_mm = 0;  ///< distance of the fitted markers from the reference, over all frames
};

struct HeadMotionOptions {
  RigidFitOptions fit;
  /// Half-width, in seconds, of the smoothing of the head's own path (a least-squares parabola in a sliding window);
  /// 0: each frame by itself. Heads move slowly; what jitters is the camera's noise, and its lever to the lips is long.
  double smoothing_s = 0.0;
};

/// Moves every frame so that `head_markers` (which ride on the skull: a jig, or the layout's stable ones) come to lie
/// as in `reference`, which has one row for each marker of the clip (NaN: unknown).
HeadMotion removeHeadMotion(const MotionClip& clip, const MarkerPositions& reference,
                            std::span<const MarkerIndex> head_markers, const HeadMotionOptions& options = {});

/// A reference made from the clip itself: its frames laid on each other by `head_markers`, then the median of each
/// marker (NaN: never seen). In the coordinates of the frame that saw most of them. InputError when no frame has a fit.
MarkerPositions medianAlignedPose(const MotionClip& clip, std::span<const MarkerIndex> head_markers,
                                  const RigidFitOptions& options = {});

/// The median of each coordinate over some frames of the clip; NaN where none of them saw the marker.
MarkerPositions medianPose(const MotionClip& clip, std::span<const FrameIndex> frames);

}  // namespace mouthpiece
