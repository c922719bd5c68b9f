#pragma once

#include "vocal/viseme_curves.h"

namespace mouthpiece {

/// How the lips are to change so that a transcribed vowel looks like the sung one: +1, 0 or -1 for each action unit.
struct VowelModification {
  int lip_spread = 0, lip_round = 0;
  bool operator==(const VowelModification&) const = default;
};
/// The paper's table.
VowelModification modificationFor(VowelGroup transcribed, VowelGroup sung);

inline constexpr double kModificationThreshold = 0.6;  ///< below it nothing is modified
inline constexpr double kLargestModification = 1.0;    ///< alpha_max of the action units

/// "lipSpread" and "lipRound": four keys for each stretch of a vowel in which another group sounds, as high as it is
/// likely. Empty without tags.
CurveSet vowelModificationCurves(const SpeechLabels& labels, const AudioTags& tags);

}  // namespace mouthpiece
