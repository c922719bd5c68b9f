#pragma once

#include <optional>

#include "vocal/animation_curve.h"
#include "vocal/vocal_style.h"

namespace mouthpiece {

class CurveModel;

enum class CurveStyle { kSpeech, kSing };

/// One of Ma, Ps, Ja, Li as asked for: given, found from the sound (`automatic`), or left to the style.
struct StyleWish {
  std::optional<StyleSignal> given;
  bool automatic = false;
};

/// How VOCAL's curves take part.
struct CurveOptions {
  bool fill_gaps = false;           ///< pairs of phones that the corpus lacks are made of curves, not of stand-ins
  std::optional<CurveStyle> alone;  ///< curves make all of the motion
  bool layered = false;             ///< with kSing: consonants come from captured units where Ma is low
  StyleWish ma, ps, ja, li;         ///< left open: speech has Ma = Ps = 0, song finds both; Ja = Li = 1
  CurveEdits edits;
  const CurveModel* model = nullptr;  ///< of the database at hand; null: learnt for this line
};

/// The parameters over the line.
VocalStyle styleFor(const CurveOptions& options, const SpeechLabels& labels, const AudioTags& tags);

}  // namespace mouthpiece
