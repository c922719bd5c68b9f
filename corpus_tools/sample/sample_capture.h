#pragma once

#include <cstdint>

#include "motion/motion_clip.h"
#include "phonetics/labels/speech_labels.h"

namespace mouthpiece {

/// What an optical system with seven jig markers makes of a performance.
struct SampleCaptureOptions {
  std::uint64_t seed = 1;
  double noise_mm = 0.1;     ///< of a marker's position, deviation in 3-D
  double gaps_per_take = 5;  ///< mean; each hides one marker, now and then its neighbour too
  Seconds shortest_gap = 0.020;
  Seconds longest_gap = 0.150;
  double long_gap_chance = 0.12;  ///< of a take to hold one gap of `shortest_long_gap` to `longest_long_gap`
  Seconds shortest_long_gap = 0.25;
  Seconds longest_long_gap = 0.50;
};

/// How much was hidden.
struct SampleGaps {
  std::size_t gaps = 0;
  std::size_t hidden_samples = 0;
};

struct SampleCapture {
  MotionClip motion;  ///< the face, then JIG_1 ... JIG_7, in the room's axes; NaN where hidden
  SampleGaps hidden;
};

/// `face` (head still, face axes) worn by a head that nods and turns as people do who speak, seen by cameras with noise
/// and occlusions. Deterministic by seed.
SampleCapture captureSample(const MotionClip& face, const SpeechLabels& labels, const SampleCaptureOptions& options);

/// The jig at rest in face axes: seven points on a rigid band above the forehead, mm.
MarkerPositions sampleJig();

}  // namespace mouthpiece
