#pragma once

#include <string>

#include "audio/audio_tags.h"
#include "phonetics/labels/speech_labels.h"
#include "vocal/animation_curve.h"
#include "vocal/vocal_style.h"

namespace mouthpiece {

/// The name of the curve that drives a viseme's jaw part where it differs from its lip part.
std::string jawCurveName(Viseme viseme);

/// Which of the paper's two kinds of keys are sung (VOCAL 4.2): 0 as in speech, 1 as in song.
struct StyleExtreme {
  bool melodic = false;          ///< Ma = 1: boundary keys
  bool pitch_sensitive = false;  ///< Ps = 1: internal keys
};

/// The viseme curves of one extreme of Ma and Ps. (0, 0) are the speech curves; `tags` then do not matter.
CurveSet visemeCurves(const SpeechLabels& labels, const AudioTags& tags, StyleExtreme extreme);

/// The four extreme curves interpolated by Ma and Ps over time (VOCAL 4.2): (1-Ma)(1-Ps) speech + ... + Ma Ps song.
/// Keys lie where any of the four has one, and where Ma or Ps turn; between keys the curves are within 2e-3 of the
/// exact blend (exactly it where Ma and Ps are constant). With Ma = Ps = 0 throughout: the speech curves, to the bit.
CurveSet blendExtremes(const SpeechLabels& labels, const AudioTags& tags, const StyleSignal& ma, const StyleSignal& ps);

/// "larynx": raised while a vowel sounds, higher for higher pitch (VOCAL 3.1), 0 at rest to 1 at the line's highest.
/// Its keys lie at the starts and ends of notes, or, where there are none, at each vowel's beginning and 75 %. Empty
/// without pitch. No marker shows it; it moves the neck of a face that has one (retarget/larynx.h).
CurveSet larynxCurves(const SpeechLabels& labels, const AudioTags& tags);

/// Height of the larynx at the lowest pitch that is sung.
inline constexpr double kLowestLarynx = 0.2;

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

/// The viseme curves of a line in a style, and for song its vowel modification and larynx curves.
CurveSet vocalCurves(const SpeechLabels& labels, const AudioTags& tags, const VocalStyle& style);

}  // namespace mouthpiece
