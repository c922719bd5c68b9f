#pragma once

#include <string>
#include <vector>

#include "audio/audio_tags.h"
#include "phonetics/labels/speech_labels.h"
#include "vocal/viseme_curves.h"
#include "vocal/viseme_poses.h"
#include "vocal/vocal_style.h"

namespace mouthpiece {

/// A line's curves with a part of VOCAL left out, and what they make of the mouth (VOCAL 5 (1)).
struct CurveVariant {
  std::string name;
  CurveSet curves;
  std::vector<double> lip_opening_mm;  ///< beyond the neutral pose, one a time
  std::vector<double> chin_drop_mm;
};

/// "all", then without Ma, without Ps, without vowel modification, without vibrato, and as speech (without all four).
/// The mouth at rising `times`.
std::vector<CurveVariant> ablateCurves(const SpeechLabels& labels, const AudioTags& tags, const VocalStyle& style,
                                       const VisemePoses& poses, const std::vector<Seconds>& times);

}  // namespace mouthpiece
