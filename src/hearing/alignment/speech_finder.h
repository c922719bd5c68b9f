#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/time.h"

namespace mouthpiece {

/// What a stretch of a sound is.
enum class SoundKind { kSpeech, kMusic, kNoise };

struct SoundStretch {
  TimeSpan span = {};
  SoundKind kind = SoundKind::kSpeech;
  bool is_steady = false;  ///< all through, more than any sound with a word in it: surely no speech
};

/// The longest stretch that is heard as one.
inline constexpr Seconds kLongestStretch = 20.0;

/// Where a sound (16 kHz) is more than its background: stretches between pauses of 0.35 s, cut at the quietest place
/// where they last longer than kLongestStretch, with what each is. Steady stretches are no speech: music where their
/// spectrum has peaks, else noise.
std::vector<SoundStretch> findSpeech(std::span<const std::int16_t> samples);

/// Words of whose time less than this share is speech are not said in a sound.
inline constexpr double kLeastInSpeech = 0.1;

/// How much of `span` is speech.
Seconds speechIn(const TimeSpan& span, std::span<const SoundStretch> stretches);

}  // namespace mouthpiece
