#pragma once

#include <optional>

#include "audio/audio_clip.h"
#include "base/time.h"

namespace mouthpiece {

/// Where a sound begins beside what another device recorded.
struct SoundPlace {
  Seconds late = 0;           ///< the sound begins so long after the other's first frame or sample; negative: before it
  double likeness = 0;        ///< of both there, at most 1
  double likeness_apart = 0;  ///< the largest at any other place
  bool is_sure = false;       ///< far enough above any other place (docs/formats/arkit.md)
  /// A second of the sound lasts 1 + drift of the other's: its t lies at late + (1 + drift) t. None where too little is
  /// there to tell, 0 where no difference is seen.
  std::optional<double> drift = {};
};

/// Where `sound` begins beside `own`, which another microphone heard at the same time: generalised cross-correlation
/// with the phase transform (Knapp and Carter 1976) from 200 to 3500 Hz, so that rooms and microphones matter little; a
/// clap helps, speech will do. Of a longer `own` its loudest minute is taken. Throws InputError for less than half a
/// second of either. The drift of their clocks is told by what they share of a minute and more.
SoundPlace placeOfSameSound(const AudioClip& own, const AudioClip& sound);

/// When the clap is heard: the one onset that is sharp and loud as no other, to a millisecond. nullopt when two come
/// near to each other in that, when it is not among the loudest moments, and in silence.
std::optional<Seconds> clapIn(const AudioClip& sound);

}  // namespace mouthpiece
