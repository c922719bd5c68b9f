#pragma once

#include <string>
#include <vector>

#include "motion/blend.h"
#include "synthesis/context_transfer.h"
#include "synthesis/curve_options.h"
#include "synthesis/utterance_animation.h"
#include "units/file/corpus.h"
#include "units/selection/selection.h"
#include "units/selection/unit_database.h"

namespace mouthpiece {

struct SynthesisOptions {
  double frame_rate_hz = 60;
  SelectionOptions selection;
  BlendKind blend = BlendKind::kSmooth;
  double overlap_ms = 60;       ///< length of the blend at a join; see docs/theory/selection.md
  bool search_coupling = true;  ///< of fragments that are moved into the line's context: cheapestCoupling()
  ContextOptions context;
  CurveOptions curves;
};

/// A line as it sounds; `labels` start and end in silence. `text`, `voice` and `audio` go through untouched.
struct SynthesisRequest {
  std::string text;
  std::string voice;
  SpeechLabels labels;
  AudioClip audio;
  SynthesisOptions options;
  std::vector<SelectedUnit> units = {};  ///< chosen already, with the sound; empty: chosen here
  AudioTags tags = {};                   ///< what was heard in `audio`, for curves in a sung style
};

/// EDGE section 5: selects fragments of the corpus, warps each to the line's phone times, resamples it at the frame
/// times and blends neighbours inside the phone that they share; with viterbi in a corpus with a trajectory model also
/// moves them into the line's context. With curves.fill_gaps VOCAL's curves make what the corpus lacks, with
/// curves.alone all of the motion (docs/theory/vocal.md). As long as the longer of labels and audio. Throws
/// InputError when the corpus has no takes, lacks a pair of phones and anything like it, or the frame rate is none.
/// StageTimings: selection and motion are filled. Thread-safe.
UtteranceAnimation synthesise(const SynthesisRequest& request, const UnitDatabase& database);

/// The same for a single line; for many lines make one UnitDatabase.
UtteranceAnimation synthesise(const SynthesisRequest& request, const Corpus& corpus);

}  // namespace mouthpiece
