#pragma once

#include <functional>
#include <span>

#include "phonetics/labels/speech_labels.h"

namespace mouthpiece {

/// How a phone's articulator comes and goes: a cosine ramp of `transition` seconds at both ends, `inside` of which lie
/// in the phone (less where it is short).
struct PresenceShape {
  Seconds transition = 0;
  Seconds inside = 0;  ///< below zero: so long before and after the phone it is whole
};

/// Every phone that is present at any of `times` (rising), with how much it is, in (0, 1]: 1 between its ramps.
void forEachPresence(const SpeechLabels& labels, std::span<const Seconds> times, const PresenceShape& shape,
                     const std::function<void(std::size_t time, Phone phone, double presence)>& visit);

}  // namespace mouthpiece
