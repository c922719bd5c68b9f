#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "audio/audio_tags.h"
#include "hearing/tags/pitch_contour.h"

namespace mouthpiece {

/// Samples [first, last], both included.
struct SampleSpan {
  std::size_t first = 0;
  std::size_t last = 0;
};

/// Syllable nuclei: where `level_db` (kPitchRateHz) is within 8 dB of a peak, peaks being parted by dips of 5 dB and
/// more on both sides (P. Mermelstein, "Automatic segmentation of speech into syllabic units", JASA 58, 1975: convex
/// hulls of loudness). Those under 50 ms are left out.
std::vector<SampleSpan> syllableNuclei(std::span<const double> level_db);

/// The notes of a voiced stretch whose words nobody knows: each syllable nucleus is a vowel, and its notes follow each
/// other without a gap. `pitch_hz` and `level_db` go from sample `first` on at kPitchRateHz, one of each a sample;
/// `vibrato`: where the pitch swings, in samples of `pitch_hz`, and is averaged over a period first.
std::vector<Note> unlabelledNotes(std::span<const double> pitch_hz, std::span<const double> level_db, std::size_t first,
                                  std::span<const VibratoRun> vibrato);

}  // namespace mouthpiece
