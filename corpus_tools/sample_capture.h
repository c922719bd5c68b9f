#pragma once

#include <cstddef>
#include <cstdint>

#include "motion/motion_clip.h"

namespace mouthpiece {

/// What an optical capture system adds to a performance. Defaults: a good system with the actor standing at ease.
struct SampleCaptureOptions {
  double noise_mm = 0.1;                                 ///< standard deviation of each coordinate of each sample
  double nod_deg = 2.0, turn_deg = 2.5, tilt_deg = 1.2;  ///< standard deviation of the head's slow movement
  double sway_mm = 4.0;                                  ///< of the head's place
  Seconds mean_between_gaps = 0.9;                       ///< over all markers together
  Seconds shortest_gap = 0.02, longest_gap = 0.15;
  double long_gap_share = 0.03;  ///< of the gaps last 0.2 s to 0.4 s
};

struct SampleCapture {
  MotionClip motion;     ///< the performance's markers, then the jig's, in the room; hidden samples are NaN
  std::size_t gaps = 0;  ///< stretches in which a marker was hidden
};

/// Films `performance` (head still, face axes, millimetres): the head moves, a jig of seven markers (JIG_1 to JIG_7) on
/// a headband moves with it, each sample gets noise and some markers are hidden for a while. Deterministic by seed.
SampleCapture captureSample(const MotionClip& performance, const SampleCaptureOptions& options, std::uint64_t seed);

}  // namespace mouthpiece
