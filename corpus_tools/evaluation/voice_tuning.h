#pragma once

#include <cstddef>
#include <functional>
#include <string>

#include "units/corpus.h"

namespace mouthpiece {

struct VoiceTuningOptions {
  std::size_t folds = 4;        ///< each take is spoken by the takes of the other folds; half search, half judge
  std::size_t most_takes = 96;  ///< of a larger corpus, that many, evenly spaced: time and memory stay bounded
  bool always = false;          ///< takes the best found even where its gain may be chance
  std::size_t jobs = 0;         ///< threads, a fold each; 0: one per core. The result does not depend on it
};

/// A score, less is better, is the mean over takes of `joins` and `lips_mm`, added.
struct VoiceScore {
  double joins = 0;    ///< sum over joins of the change across them, in what recordings change within 40 ms, per word
  double lips_mm = 0;  ///< RMS error of the lips that the same units give, in the take's own time
  [[nodiscard]] double sum() const { return joins + lips_mm; }
};

/// What a search found (docs/theory/corpus_voice.md).
struct TunedVoice {
  SoundCutWeights weights;   ///< the best found where `taken`, else those of the corpus
  bool helps = false;        ///< also on the judging takes, by more than the standard error of the difference
  bool taken = false;        ///< `weights` are the best found
  std::size_t settings = 0;  ///< tried
  std::size_t search_takes = 0, judge_takes = 0;
  double search_before = 0, search_after = 0;
  VoiceScore judge_before, judge_after;
  double judge_error = 0;  ///< standard error of the difference of the judging takes' scores
  std::string changes;     ///< of the best found; empty when it is where it began
};

/// Searches the weights of the corpus voice's cuts on takes that the others speak: sound and lips are made and measured
/// for each setting. Throws InputError for a corpus without a trajectory model or sound, fewer than two folds, or fewer
/// takes than four a fold.
TunedVoice tuneCorpusVoice(const Corpus& corpus, const VoiceTuningOptions& options = {},
                           const std::function<void(std::size_t done, std::size_t total)>& progress = {});

/// How they were learnt, in a line, for people and for the build log.
std::string describeTuning(const TunedVoice& tuned);

/// Puts the weights into the corpus, and how they were learnt into its build log as "sound_cut_weights".
void storeTuning(Corpus& corpus, const TunedVoice& tuned);

}  // namespace mouthpiece
