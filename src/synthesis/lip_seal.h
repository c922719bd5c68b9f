#pragma once

#include <span>
#include <vector>

#include "phonetics/speech_labels.h"

namespace mouthpiece {

/// How far the lips stick together at each of `times`, 0 to 1: whole in B P M and in silence, gone 60 ms away from
/// them. A capture that sees only the outer edge of the lips cannot tell: in TH and R of GRID s1 these are as near to
/// each other as in B, where the lips touch (docs/theory/bezier_deformation.md).
std::vector<double> lipSealFromPhones(const SpeechLabels& labels, std::span<const Seconds> times);

}  // namespace mouthpiece
