#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <vector>

#include "motion/motion_clip.h"

namespace mouthpiece {

/// The rigid motion (and size) that brings one set of markers onto another; a marker that either lacks (NaN) has no say.
struct PoseFit {
  Eigen::Isometry3d target_from_source = Eigen::Isometry3d::Identity();  ///< applied to scale * source
  double scale = 1;
  double squared_residuals_mm2 = 0;  ///< sum over the shared markers
  std::size_t shared_markers = 0;

  [[nodiscard]] Eigen::Vector3d operator()(const Eigen::Vector3d& source) const {
    return target_from_source * (scale * source);
  }
};

enum class PoseScale { kFixed, kFree };

/// Markers seen in both.
std::size_t sharedMarkers(const MarkerPositions& source, const MarkerPositions& target);

/// Least squares with weights 1 / (1 + (r / robust_scale)^2) of the residual r, iterated: a raised brow or a slipped
/// marker loses its say. At least three markers must be shared.
PoseFit fitPose(const MarkerPositions& source, const MarkerPositions& target, double robust_scale_mm, PoseScale scale);

/// Generalised Procrustes mean: every shape fitted to the mean, averaged, again; in the frame of the shape that shows the
/// most markers. Markers that no usable shape shows are NaN. No rows when no shape shows `least_markers`.
MarkerPositions meanShape(const std::vector<MarkerPositions>& shapes, std::size_t least_markers, double robust_scale_mm,
                          PoseScale scale);

/// `pose` with some of its markers only.
MarkerPositions pickMarkers(const MarkerPositions& pose, const std::vector<std::size_t>& markers);

}  // namespace mouthpiece
