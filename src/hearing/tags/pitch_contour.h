#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace mouthpiece {

/// A straight piece of the pitch of one vowel: samples [first, last], both included; the next piece starts at `last`.
struct PitchPiece {
  std::size_t first = 0;
  std::size_t last = 0;
  double slope_hz_s = 0;
  double median_hz = 0;
};

struct NoteFitOptions {
  double rate_hz = 100;
  /// Pieces flatter than this are notes (VOCAL 4.1, empirically 50 Hz: a second).
  double note_slope_hz_s = 50;
  /// Of E_cost, for each piece.
  double piece_cost_share = 1;
};

/// The pieces that together cost least: eq. (1) with E_fit of eq. (2) and E_cost = (lowest + highest pitch) / 2 a
/// piece. O(N^2). Empty for fewer than two samples. `pitch_hz`: voiced samples at `rate_hz`, no gaps.
std::vector<PitchPiece> fitPitchPieces(std::span<const double> pitch_hz, const NoteFitOptions& options = {});

/// Whether the piece is a note rather than the way from one to the next.
bool isNote(const PitchPiece& piece, const NoteFitOptions& options = {});

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
