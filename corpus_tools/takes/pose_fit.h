#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "motion/cleaning/rigid.h"
#include "motion/motion_clip.h"

namespace mouthpiece {

/// The motion (and size) that brings one set of markers onto another; a marker that either lacks (NaN) has no say.
struct PoseFit {
  RigidMotion target_from_source;  ///< applied to scale * source
  double scale = 1;
  double squared_residuals_mm2 = 0;  ///< sum over the shared markers
  std::size_t shared_markers = 0;
};

enum class PoseScale { kFixed, kFree };

/// Markers seen in both.
std::size_t sharedMarkers(const MarkerPositions& source, const MarkerPositions& target);

/// fitRigidMotion(), and with kFree the least-squares size (Umeyama 1991, eq. 42) on top. nullopt as fitRigidMotion().
std::optional<PoseFit> fitPose(const MarkerPositions& source, const MarkerPositions& target, PoseScale scale,
                               const RigidFitOptions& options = {});

/// Generalised Procrustes mean: every shape fitted to the mean, averaged, again; in the frame of the shape that shows
/// the most markers, in the mean size. Markers that no usable shape shows are NaN. No rows when no shape shows
/// `least_markers`.
MarkerPositions meanShape(const std::vector<MarkerPositions>& shapes, std::size_t least_markers, PoseScale scale);

/// `pose` with some of its markers only.
MarkerPositions pickMarkers(const MarkerPositions& pose, const std::vector<std::size_t>& markers);

void transform(MarkerPositions& pose, const RigidMotion& target_from_source);
void transform(MotionClip& clip, const RigidMotion& target_from_source);

}  // namespace mouthpiece
