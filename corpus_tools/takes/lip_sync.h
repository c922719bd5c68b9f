#pragma once

#include "audio/audio_clip.h"
#include "base/time.h"
#include "motion/lip_gauge.h"
#include "motion/motion_clip.h"

namespace mouthpiece {

/// How a sound lies beside a motion that another device recorded.
struct SoundPlace {
  Seconds late = 0;           ///< the sound begins so long after the first frame; negative: before it
  double likeness = 0;        ///< correlation of the lips' opening with the loudness there, -1 to 1
  double likeness_apart = 0;  ///< the largest at any other place, 0.3 s away or more

  /// Far enough above any other place: in ten takes of a real speaker laid end to end (30 s) always and rightly so, in
  /// one (3 s) not to be told (docs/formats/arkit.md).
  [[nodiscard]] bool isSure() const { return likeness - likeness_apart > 0.08; }
};

/// Where open lips meet loud sound best, to a hundredth of a second; both without what is slower than half a second.
/// Looks up to a minute to either side, at places that leave half of the shorter one over the other. Throws InputError
/// for a layout without lips, and for less than 5 s of either.
SoundPlace placeOfSound(const MotionClip& motion, const AudioClip& sound, const LipGauge& lips);

/// The sound from the motion's first frame to its last; silence where there is none.
AudioClip soundBeside(const MotionClip& motion, const AudioClip& sound, Seconds late);

}  // namespace mouthpiece
