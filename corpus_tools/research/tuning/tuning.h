#pragma once

#include <cstddef>
#include <functional>
#include <string>

#include "corpus_tools/building/settings_search.h"
#include "units/file/corpus.h"

namespace mouthpiece {

struct TuningOptions {
  std::size_t folds = 6;         ///< each take is made from the takes of the other folds; half search, half judge
  std::size_t most_takes = 300;  ///< of a larger corpus, that many, evenly spaced: time and memory stay bounded
  bool always = false;           ///< takes the best found even where its gain may be chance
  std::size_t jobs = 0;          ///< threads; 0: one per core. The result does not depend on it
};

/// Throws InputError for fewer folds than that, or fewer than four takes a fold.
void expectFolds(std::size_t corpus_takes, const TuningOptions& options, std::size_t least_folds);

/// Scores are tuningScore (docs/theory/units/selection.md).
using TunedWeights = Tuned<LatticeWeights, double>;

/// Searches the lattice's weights, one at a time, for the least score on the held-out takes of every other fold, and
/// judges what it found on the takes of the folds between. Throws InputError for a corpus without a trajectory model,
/// fewer than four folds, or fewer takes than four a fold.
TunedWeights tuneLatticeWeights(const Corpus& corpus, const TuningOptions& options = {},
                                const TuningProgress& progress = {});

/// Puts the weights into the corpus, and how they were learnt into its build log as "lattice_weights".
void storeTuning(Corpus& corpus, const TunedWeights& tuned);

/// Means over takes; less is better.
struct VoiceScore {
  double joins = 0;    ///< sum over joins of the change across them, in what recordings change within 40 ms, per word
  double lips_mm = 0;  ///< RMS error of the lips that the same units give, in the take's own time
  [[nodiscard]] double sum() const { return joins + lips_mm; }
};

/// docs/theory/voices/corpus_voice.md
using TunedVoice = Tuned<SoundCutWeights, VoiceScore>;

/// Slower to measure than the selection's: fewer folds and takes.
constexpr TuningOptions kVoiceTuning{.folds = 4, .most_takes = 96};

/// Searches the weights of the corpus voice's cuts on takes that the others speak: sound and lips are made and measured
/// for each setting. Throws InputError for a corpus without a trajectory model or sound, fewer than two folds, or fewer
/// takes than four a fold.
TunedVoice tuneCorpusVoice(const Corpus& corpus, const TuningOptions& options = kVoiceTuning,
                           const TuningProgress& progress = {});

std::string describeTuning(const TunedVoice& tuned);
/// Likewise, as "sound_cut_weights".
void storeTuning(Corpus& corpus, const TunedVoice& tuned);

}  // namespace mouthpiece
