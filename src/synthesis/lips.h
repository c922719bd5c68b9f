#pragma once

#include <span>
#include <vector>

#include "motion/lip_pose.h"
#include "phonetics/labels/speech_labels.h"

namespace mouthpiece {

struct Corpus;

/// The lips at each of `times`: sealed in B P M and for 20 ms around them, not at all 50 to 100 ms later, as they
/// have time until the next closure, F or V, and in silence, in which they come together after the last sound and open
/// before the next one; parted in every other phone, for English says them through open lips, and most in TH and DH.
/// The lower lip is tucked under the upper teeth in F and V, and lips are rounded in W, UW and their kin.
std::vector<LipPose> lipsFromPhones(const SpeechLabels& labels, std::span<const Seconds> times);

/// What of a speaker's rounding the capture has not seen: what lips do in W and UW (kRounded), less what the corpus'
/// stored viseme poses show. All of it where they show none; nothing where a corpus keeps no poses.
LipRounding unseenRounding(const Corpus& corpus);

/// Lips in W and UW, as shares of the mouth's width: 7 mm narrower and 4 mm further forward on a man's of 50 mm.
inline constexpr LipRounding kRounded{.narrowing = 0.14, .protrusion = 0.08};

}  // namespace mouthpiece
