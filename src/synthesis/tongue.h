#pragma once

#include <span>
#include <vector>

#include "motion/tongue_pose.h"
#include "phonetics/labels/speech_labels.h"

namespace mouthpiece {

/// The tongue at each of `times`: it goes where the phone spoken then asks it to (EDGE 7: no capture sees it), moving
/// there and away over about 100 ms, smoothly; a contact is whole for as long as its phone lasts but for 20 ms at its
/// ends.
std::vector<TonguePose> tongueFromPhones(const SpeechLabels& labels, std::span<const Seconds> times);

}  // namespace mouthpiece
