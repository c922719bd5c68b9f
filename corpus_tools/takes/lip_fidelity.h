#pragma once

#include <array>
#include <vector>

#include "motion/lip_gauge.h"
#include "motion/motion_clip.h"
#include "phonetics/labels/speech_labels.h"

namespace mouthpiece {

/// What cleaning did to the lips of a take: to the middles of both.
struct LipFidelity {
  static constexpr std::size_t kBands = 7;
  /// Edges in Hz of the bands that jerk is told in.
  static constexpr std::array<double, kBands + 1> kEdgesHz = {0, 3, 6, 10, 15, 25, 40, 60};
  using Bands = std::array<double, kBands>;  ///< m/s^3, rms of a coordinate

  /// Of each P, B and M: how much further apart the lips come at their closest than before; mm.
  std::vector<double> closure_changes_mm;
  Bands jerk_before{}, jerk_after{};
};

/// Closures that were not seen whole are left out; all zero without those markers, or with a frame of theirs missing.
LipFidelity lipFidelity(const MotionClip& before, const MotionClip& after, const SpeechLabels& labels,
                        const LipGauge& gauge);

}  // namespace mouthpiece
