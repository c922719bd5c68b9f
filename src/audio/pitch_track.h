#pragma once

#include <vector>

#include "audio/audio_clip.h"
#include "base/time.h"

namespace mouthpiece {

struct PitchFrame {
  double hz = 0;          ///< 0 where there is no pitch
  double confidence = 0;  ///< 0 to 1
};

/// Fundamental frequency at a steady rate; frame i lies at i * step.
struct PitchTrack {
  Seconds step = 0.01;
  std::vector<PitchFrame> frames;

  /// Straight between voiced frames; 0 where either frame beside `time` is unvoiced, and outside.
  [[nodiscard]] double hzAt(Seconds time) const;
};

struct PitchOptions {
  Seconds step = 0.005;
  double lowest_hz = 60;
  double highest_hz = 600;
  double least_confidence = 0.6;
  double least_level_db = -45;  ///< below the loudest frame: no pitch in what cannot be heard
};

/// The YIN estimator in the spectral domain (aubio's yinfft) over 64 ms, short enough that vibrato is not flattened.
/// Frames outside [lowest, highest], unsure or too quiet are unvoiced.
PitchTrack trackPitch(const AudioClip& clip, const PitchOptions& options = {});

}  // namespace mouthpiece
