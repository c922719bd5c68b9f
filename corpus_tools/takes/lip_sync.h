#pragma once

#include "audio/audio_clip.h"
#include "corpus_tools/takes/sound_sync.h"
#include "motion/lip_gauge.h"
#include "motion/motion_clip.h"

namespace mouthpiece {

/// Where open lips meet loud sound best, to a hundredth of a second; both without what is slower than half a second.
/// Looks up to a minute to either side, at places that leave half of the shorter one over the other. Throws InputError
/// for a layout without lips, and for less than 5 s of either. It is sure far enough above any other place: in ten
/// takes of a real speaker laid end to end (30 s) always and rightly so, in one (3 s) not to be told.
SoundPlace placeOfSound(const MotionClip& motion, const AudioClip& sound, const LipGauge& lips);

/// That long a part of the sound, from a motion's first frame on; silence where there is none. `drift` as in
/// SoundPlace.
AudioClip soundBeside(Seconds duration, const AudioClip& sound, Seconds late, double drift = 0);

}  // namespace mouthpiece
