#pragma once

#include <cstddef>
#include <functional>
#include <string>

#include "corpus_tools/evaluation/lip_measures.h"
#include "units/corpus.h"

namespace mouthpiece {

struct TuningOptions {
  std::size_t folds = 6;         ///< each take is animated by the takes of the other folds
  std::size_t most_takes = 300;  ///< of a larger corpus, that many, evenly spaced: time and memory stay bounded
  bool always = false;           ///< takes the best found even where its gain may be chance
  std::size_t jobs = 0;          ///< threads; 0: one per core. The result does not depend on it
};

/// What a search found (docs/theory/selection.md). Scores are tuningScore; less is better.
struct TunedWeights {
  LatticeWeights weights;    ///< the best found where `taken`, else those of the corpus
  bool helps = false;        ///< also on the judging takes, by more than the chance in which takes these are
  bool taken = false;        ///< `weights` are the best found
  std::size_t settings = 0;  ///< tried
  std::size_t search_takes = 0, judge_takes = 0;
  double search_before = 0, search_after = 0;
  double judge_before = 0, judge_after = 0;
  double judge_error = 0;  ///< standard error of judge_after - judge_before: bootstrap over takes
  std::string changes;     ///< "duration 1 -> 0.5, ..." of the best found; empty when it is where it began
};

/// Lip error in mm, and 1 for all closures lost, and 1 for all open phones closed.
double tuningScore(const LipMeasures& measures);

/// Searches the lattice's weights, one at a time, for the least score on the held-out takes of every other fold, and
/// judges what it found on the takes of the folds between. Throws InputError for a corpus without a trajectory model,
/// fewer than four folds, or fewer takes than four a fold.
TunedWeights tuneLatticeWeights(const Corpus& corpus, const TuningOptions& options = {},
                                const std::function<void(std::size_t done, std::size_t total)>& progress = {});

/// How they were learnt, in a line, for people and for the build log.
std::string describeTuning(const TunedWeights& tuned);

/// Puts the weights into the corpus, and how they were learnt into its build log as "lattice_weights".
void storeTuning(Corpus& corpus, const TunedWeights& tuned);

}  // namespace mouthpiece
