#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "phonetics/labels/speech_labels.h"
#include "audio/audio_tags.h"
#include "vocal/curve_key.h"
#include "vocal/viseme_events.h"

namespace mouthpiece {

/// The animation of a line: one curve per viseme ("Ah"), for its lip part and its jaw part; "Ah_jaw" beside it where
/// the jaw part differs. Action units ("lipSpread", "lipRound") and "larynx" as they are needed. Sorted by name.
using CurveSet = std::vector<AnimationCurve>;

/// Null where there is none of that name.
const AnimationCurve* findCurve(const CurveSet& curves, std::string_view name);

/// The name of the curve that drives a viseme's jaw part where it differs from its lip part.
std::string jawCurveName(Viseme viseme);

/// Which of the paper's two kinds of keys are sung (VOCAL 4.2): 0 as in speech, 1 as in song.
struct StyleExtreme {
  bool melodic = false;          ///< Ma = 1: boundary keys
  bool pitch_sensitive = false;  ///< Ps = 1: internal keys
};

/// The viseme curves of one extreme of Ma and Ps. (0, 0) are the speech curves; `tags` then do not matter.
CurveSet visemeCurves(const SpeechLabels& labels, const AudioTags& tags, StyleExtreme extreme);

/// Pass 3: the events' keys joined into one curve per viseme and part. Where two events of one viseme overlap, the two
/// boundary keys give way to one, 120 ms before the second begins if the first has been held until then, else midway;
/// its value is `vowel_coarticulation` of the lower of both.
CurveSet curvesFromEvents(const std::vector<VisemeEvent>& events, double vowel_coarticulation);

/// VC of the paper.
inline constexpr double kSpeechCoarticulation = 0.5;
inline constexpr double kSongCoarticulation = 0.95;

}  // namespace mouthpiece
