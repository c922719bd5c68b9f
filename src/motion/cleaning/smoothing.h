#pragma once

#include <vector>

#include "motion/motion_clip.h"

namespace mouthpiece {

struct SmoothingOptions {
  /// Standard deviation of the capture's noise in one coordinate; 0: each marker's own, estimateMarkerNoise(clip) of
  /// motion/gaps.h.
  double noise_mm = 0.0;
};

struct SmoothedMotion {
  MotionClip clip;
  double noise_mm = 0;                  ///< given, or the median of the markers'
  std::vector<double> marker_noise_mm;  ///< of each marker
  double rms_change_mm = 0;             ///< how far samples were moved, one coordinate
};

/// Takes light noise off (EDGE 4): a Kalman filter and Rauch-Tung-Striebel smoother of a point whose jerk is white
/// noise, for each coordinate. How restless each marker is, is found by maximum likelihood, and no coordinate is moved
/// by more than 2.5 times the noise, so quick closures stay. A sample that was not seen stays NaN.
SmoothedMotion smoothMotion(const MotionClip& clip, const SmoothingOptions& options = {});

}  // namespace mouthpiece
