#pragma once

#include "vocal/viseme_curves.h"

namespace mouthpiece {

/// "larynx": raised while a vowel sounds, higher for higher pitch (VOCAL 3.1), 0 at rest to 1 at the line's highest.
/// Its keys lie at the starts and ends of notes, or, where there are none, at each vowel's beginning and 75 %. Empty
/// without pitch. No marker shows it; it moves the neck of a face that has one (retarget/larynx.h).
CurveSet larynxCurves(const SpeechLabels& labels, const AudioTags& tags);

/// Height of the larynx at the lowest pitch that is sung.
inline constexpr double kLowestLarynx = 0.2;

}  // namespace mouthpiece
