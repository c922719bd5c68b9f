#pragma once

#include <span>
#include <vector>

#include "motion/lip_pose.h"
#include "phonetics/labels/speech_labels.h"

namespace mouthpiece {

/// The lips at each of `times`: sealed in B P M and in silence and for 20 ms around them, not at all 50 ms later;
/// parted in every other phone, for English says them through open lips, and most in TH and DH.
std::vector<LipPose> lipsFromPhones(const SpeechLabels& labels, std::span<const Seconds> times);

}  // namespace mouthpiece
