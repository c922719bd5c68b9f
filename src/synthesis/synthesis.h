#pragma once

#include <optional>
#include <string>
#include <vector>

#include "expression/expression.h"
#include "motion/blend.h"
#include "synthesis/context_transfer.h"
#include "synthesis/curve_model.h"
#include "synthesis/line_edits.h"
#include "synthesis/speech_dials.h"
#include "synthesis/utterance_animation.h"
#include "units/file/corpus.h"
#include "units/selection/selection.h"
#include "units/selection/unit_database.h"

namespace mouthpiece {

/// What goes beyond EDGE as published when captured fragments are placed and joined (docs/theory/units/joining.md).
/// Each is a row of `corpus evaluate --ablation`.
struct Departures {
  bool silences_keep_their_pace = true;  ///< off: they are stretched as phones are
  bool joins_where_lips_agree = true;    ///< off: in the middle of the shared phone, the whole face at once
  bool offsets_led_away = true;          ///< JoinOffset
  bool lids_rest = true;                 ///< off: they move with the fragments that move the mouth
};

struct SynthesisOptions {
  double frame_rate_hz = 60;
  SelectionOptions selection;
  BlendKind blend = BlendKind::kSmooth;
  double overlap_ms = 60;       ///< length of the blend at a join; see docs/theory/units/joining.md
  bool search_coupling = true;  ///< of fragments that are moved into the line's context: cheapestCoupling()
  ContextOptions context;
  Departures departures;
  CurveOptions curves;
  SpeechDials dials;
  ExpressionOptions expression;
  LineEdits edits;  ///< of words nothing is left to do here
};

/// EDGE as published: sentences, words, syllables and diphones, greedy, by timing and context alone; phones stretched
/// evenly, silences too; joined in the middle of the shared phone by eq. (2); nothing is predicted or corrected. One
/// thing the paper leaves open is decided: a pair that the corpus lacks has a stand-in, or it would search for ever.
SynthesisOptions edgeAsPublished();

/// A line as it sounds; `labels` start and end in silence. `text`, `voice` and `audio` go through untouched.
struct SynthesisRequest {
  std::string text;
  std::string voice;
  SpeechLabels labels;
  AudioClip audio;
  SynthesisOptions options;
  std::vector<SelectedUnit> units = {};        ///< chosen already, with the sound; empty: chosen here
  AudioTags tags = {};                         ///< what was heard in `audio`, for curves in a sung style
  std::optional<SoundMeasures> measures = {};  ///< of `audio`, where they are known already
  Seconds sound_lasts = 0;                     ///< what `audio` lasts, where only that is known of it
};

/// Whether what a line's sound says beyond its phones joins the prediction.
bool hearsSound(const SynthesisOptions& options, const Corpus& corpus);

/// A stretch of the line and what moves the face in it.
struct Segment {
  enum class Kind {
    kCaptured,  ///< a fragment of the corpus
    kStandIn,   ///< a fragment too, but of the nearest pair of phones by viseme class
    kCurves,    ///< VOCAL's curves
  };
  PhoneRange phones;                 ///< two at least
  std::optional<SelectedUnit> unit;  ///< the fragment, of the same phones; none: curves

  [[nodiscard]] Kind kind() const {
    if (!unit) return Kind::kCurves;
    return unit->is_backoff ? Kind::kStandIn : Kind::kCaptured;
  }
};

/// What a line is made of: a value that may be changed and rendered again. In order; neighbours share one phone, and
/// all of them cover the line. A line of fewer than two phones has none: the face rests.
struct SynthesisPlan {
  std::vector<Segment> segments;

  /// Lays a segment over the others: what it covers goes, what it cuts into is shortened, curves beside curves become
  /// one segment. `laid` lies within the line.
  void lay(const Segment& laid);
};

/// Chooses what each stretch of the line is made of (EDGE 5.1.1). With curves.alone that is curves; with
/// curves.fill_gaps curves make what the corpus lacks, but where a prediction leads stand-ins, as long as there are
/// some. `units`, when there are any, were chosen before. Throws InputError when the corpus lacks a pair of phones and
/// anything like it, and curves may not fill in.
SynthesisPlan planLine(const SpeechLabels& labels, const UnitDatabase& database, const SynthesisOptions& options,
                       const std::vector<SelectedUnit>& units = {});

/// Moves the face as planned for request.labels, whatever request.units are: the fragments are warped to the line's
/// phone times, resampled at the frame times and blended inside the phone that neighbours share (EDGE 5.1.2, 5.1.3),
/// with viterbi in a corpus with a trajectory model also moved into the line's context; curves are led to meet them
/// (docs/theory/vocal/vocal.md). As long as the longest of labels, audio
/// and sound_lasts. Throws InputError when the corpus has no
/// takes or no poses for the curves, or the frame rate is none. Of StageTimings `motion` is filled. Thread-safe; the
/// result does not depend on threads.
UtteranceAnimation renderPlan(const SynthesisPlan& plan, const SynthesisRequest& request, const UnitDatabase& database);

/// EDGE section 5: plans the line and renders it. Throws as both do. StageTimings: selection and motion are filled.
UtteranceAnimation synthesise(const SynthesisRequest& request, const UnitDatabase& database);

/// The same for a single line; for many lines make one UnitDatabase.
UtteranceAnimation synthesise(const SynthesisRequest& request, const Corpus& corpus);

}  // namespace mouthpiece
