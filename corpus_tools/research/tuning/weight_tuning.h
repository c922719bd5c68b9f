#pragma once

#include <string>

#include "corpus_tools/takes/lip_measures.h"
#include "corpus_tools/research/tuning/tuning.h"
#include "units/file/corpus.h"

namespace mouthpiece {

/// Scores are tuningScore (docs/theory/selection.md).
using TunedWeights = Tuned<LatticeWeights, double>;

/// Lip error in mm, and 1 for all closures lost, and 1 for all open phones closed.
double tuningScore(const LipMeasures& measures);

/// Searches the lattice's weights, one at a time, for the least score on the held-out takes of every other fold, and
/// judges what it found on the takes of the folds between. Throws InputError for a corpus without a trajectory model,
/// fewer than four folds, or fewer takes than four a fold.
TunedWeights tuneLatticeWeights(const Corpus& corpus, const TuningOptions& options = {},
                                const TuningProgress& progress = {});

/// How they were learnt, in a line, for people and for the build log.
std::string describeTuning(const TunedWeights& tuned);

/// Puts the weights into the corpus, and how they were learnt into its build log as "lattice_weights".
void storeTuning(Corpus& corpus, const TunedWeights& tuned);

}  // namespace mouthpiece
