#pragma once

#include "vocal/viseme_curves.h"
#include "vocal/vocal_style.h"

namespace mouthpiece {

/// The four extreme curves interpolated by Ma and Ps over time (VOCAL 4.2): (1-Ma)(1-Ps) speech + ... + Ma Ps song.
/// Keys lie where any of the four has one, and where Ma or Ps turn; between keys the curves are within 2e-3 of the
/// exact blend (exactly it where Ma and Ps are constant). With Ma = Ps = 0 throughout: the speech curves, to the bit.
CurveSet blendExtremes(const SpeechLabels& labels, const AudioTags& tags, const StyleSignal& ma, const StyleSignal& ps);

/// The viseme curves of a line in a style, and for song its vowel modification and larynx curves.
CurveSet vocalCurves(const SpeechLabels& labels, const AudioTags& tags, const VocalStyle& style);

}  // namespace mouthpiece
