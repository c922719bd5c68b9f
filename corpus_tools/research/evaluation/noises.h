#pragma once

#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

#include "audio/audio_clip.h"

namespace mouthpiece {

/// What else may be heard where someone speaks.
enum class Noise {
  kOffice,  ///< ten voices at once, ventilation
  kStreet,  ///< noise that falls above 150 Hz, slowly moving
  kMusic,   ///< chords, a tune, drums
};
inline constexpr std::array<Noise, 3> kNoises{Noise::kOffice, Noise::kStreet, Noise::kMusic};
std::string_view noiseName(Noise noise);

/// `speech` with noise under it: its power lies `snr_db` under that of the louder half of the speech. `voices`: who
/// speaks in the office, at 16 kHz; none: ventilation alone. The same seed, the same noise. The result has 16 kHz.
AudioClip inNoise(const AudioClip& speech, Noise noise, double snr_db, const std::vector<AudioClip>& voices,
                  std::uint64_t seed);

/// `speech` in a room: echoes as loud as itself that fall by 60 dB in `reverberation`.
AudioClip inRoom(const AudioClip& speech, Seconds reverberation, std::uint64_t seed);

}  // namespace mouthpiece
