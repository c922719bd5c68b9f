#pragma once

#include <vector>

#include "base/index.h"
#include "base/time.h"

namespace mouthpiece {

/// Fundamental frequency at one time; the series is at kPitchRateHz.
struct PitchSample {
  Seconds time = 0;
  double hz = 0;  ///< 0 where not voiced
  bool voiced = false;
};
inline constexpr double kPitchRateHz = 100;

/// A pitch that is held inside one vowel: as it is written in a song, or as it is heard in a sound (VOCAL 4.1).
struct Note {
  TimeSpan span;
  double hz = 0;
  bool vibrato = false;  ///< asks a voice for it; what is heard is in AudioTags::vibrato
};

/// An interval with vibrato (VOCAL 4.1).
struct VibratoSpan {
  TimeSpan span;
  double rate_hz = 0;
  double depth_semitones = 0;  ///< half of peak to peak
};

/// How likely each Italian vowel (and silence) sounds at one time (VOCAL 4.3); the six sum to 1.
struct VowelLikelihood {
  Seconds time = 0;
  double a = 0, e = 0, i = 0, o = 0, u = 0, silence = 0;
};

/// High-frequency energy (8 to 20 kHz, or AudioTags::consonant_low_hz and up) of one consonant (VOCAL 4.2, "Computing
/// Ma-Ps values from audio").
struct ConsonantEnergy {
  PhoneIndex phone;  ///< of the labels that the sound was tagged with
  TimeSpan span;
  double energy = 0;  ///< mean square of the band
};

/// What is heard in a sound beside its phones. All of it may be empty: speech from text, sound of a low sampling rate.
/// Every list is in time order.
struct AudioTags {
  std::vector<PitchSample> f0;
  std::vector<Note> notes;
  std::vector<VibratoSpan> vibrato;
  std::vector<VowelLikelihood> vowels;
  std::vector<ConsonantEnergy> consonants;
  double consonant_low_hz = 0;  ///< where their band begins; 0: they were not heard
};

}  // namespace mouthpiece
