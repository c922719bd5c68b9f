#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "hearing/recognition/recogniser.h"

namespace mouthpiece {

/// The longest stretch that is heard as one.
inline constexpr Seconds kLongestStretch = 20.0;

/// Where a sound (16 kHz) is more than its background: stretches between pauses of 0.35 s, cut at the quietest place
/// where they last longer than kLongestStretch, with what each is. Steady stretches are no speech: music where their
/// spectrum has peaks, else noise.
std::vector<SoundStretch> findSpeech(std::span<const std::int16_t> samples);

}  // namespace mouthpiece
