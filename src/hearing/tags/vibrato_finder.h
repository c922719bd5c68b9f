#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace mouthpiece {

/// Samples [first, last] with vibrato.
struct VibratoRun {
  std::size_t first = 0;
  std::size_t last = 0;
  double rate_hz = 0;
  double depth_semitones = 0;  ///< half of peak to peak
};

struct VibratoOptions {
  double rate_hz = 100;
  // VOCAL 4.1, constraints (1) to (3).
  double least_periods = 1;
  double most_deviation_semitones = 1;
  double slowest_hz = 5;
  double fastest_hz = 8;
  /// Not in the paper: straight tones waver by up to 0.2 semitones in people, vibrato reaches 0.34 to 1.2 (Prame 1997).
  double least_depth_semitones = 0.2;
  /// Neighbouring swings, up and down, differ by no more than this (any): a consonant between vowels bends the pitch
  /// once.
  double most_swing_ratio = 1e9;
};

/// Stretches of the voiced pitch of one vowel whose peaks are a similar distance apart (zero crossings of f0').
std::vector<VibratoRun> findVibrato(std::span<const double> pitch_hz, const VibratoOptions& options = {});

}  // namespace mouthpiece
