#pragma once

#include <string>

#include "corpus_tools/research/tuning/tuning.h"
#include "units/file/corpus.h"

namespace mouthpiece {

/// Means over takes; less is better.
struct VoiceScore {
  double joins = 0;    ///< sum over joins of the change across them, in what recordings change within 40 ms, per word
  double lips_mm = 0;  ///< RMS error of the lips that the same units give, in the take's own time
  [[nodiscard]] double sum() const { return joins + lips_mm; }
};

/// docs/theory/corpus_voice.md
using TunedVoice = Tuned<SoundCutWeights, VoiceScore>;

/// Slower to measure than the selection's: fewer folds and takes.
constexpr TuningOptions kVoiceTuning{.folds = 4, .most_takes = 96};

/// Searches the weights of the corpus voice's cuts on takes that the others speak: sound and lips are made and measured
/// for each setting. Throws InputError for a corpus without a trajectory model or sound, fewer than two folds, or fewer
/// takes than four a fold.
TunedVoice tuneCorpusVoice(const Corpus& corpus, const TuningOptions& options = kVoiceTuning,
                           const TuningProgress& progress = {});

/// How they were learnt, in a line, for people and for the build log.
std::string describeTuning(const TunedVoice& tuned);

/// Puts the weights into the corpus, and how they were learnt into its build log as "sound_cut_weights".
void storeTuning(Corpus& corpus, const TunedVoice& tuned);

}  // namespace mouthpiece
