#include "corpus_tools/research/tuning/coordinate_search.h"

#include <algorithm>

#include "base/errors.h"

namespace mouthpiece {

void expectFolds(std::size_t corpus_takes, const TuningOptions& options, std::size_t least_folds) {
  constexpr std::size_t kLeastTakesAFold = 4;
  const std::size_t takes = std::min(corpus_takes, options.most_takes);
  if (options.folds >= least_folds && options.folds <= takes / kLeastTakesAFold) return;
  throw InputError("folds", "",
                   fmt::format("found {} for {} takes; expected at least {}, and {} takes in each", options.folds,
                               takes, least_folds, kLeastTakesAFold));
}

}  // namespace mouthpiece
