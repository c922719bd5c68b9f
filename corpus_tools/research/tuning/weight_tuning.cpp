// The tuning of the selection's weights, of tuning.h.
#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <vector>

#include "base/errors.h"
#include "base/parallel_for.h"
#include "corpus_tools/building/settings_search.h"
#include "corpus_tools/research/evaluation/evaluation.h"
#include "corpus_tools/research/tuning/tuning.h"
#include "synthesis/curve_model.h"
#include "synthesis/synthesis.h"
#include "units/costs/cost_terms.h"
#include "units/selection/unit_database.h"

namespace mouthpiece {
namespace {

/// The takes of one fold and what speaks them: stays where it is, since the database refers to it.
struct TuningFold {
  explicit TuningFold(SplitTakes parts) : split(std::move(parts)), database(split.rest) {
    split.held = atOfferedRates(std::move(split.held));
  }
  SplitTakes split;
  UnitDatabase database;
  CurveModel curves{database};
};

/// nullopt where not even a stand-in is found, whatever the weights are.
std::optional<LipMeasures> measureTake(const TuningFold& fold, const CorpusTake& take, const LatticeWeights& weights) {
  SynthesisRequest request{take.text, "capture", take.labels, {}, {}};
  request.options.frame_rate_hz = take.motion.frame_rate_hz;
  request.options.selection.method = SelectionMethod::kViterbi;
  request.options.selection.lattice = weights;
  request.options.curves.model = &fold.curves;
  request.options.context.settings = MotionSettings{};  // those that a corpus has learnt may leave fragments no say
  try {
    const UtteranceAnimation made = synthesise(request, fold.database);
    return measureLips(take.motion, made.motion, take.labels, fold.split.rest.layout);
  } catch (const InputError&) {
    return std::nullopt;
  }
}

class LatticeTrial : public LipTrial {
 public:
  LatticeTrial(const Corpus& takes, const TuningOptions& options)
      : jobs_(options.jobs > 0 ? options.jobs : defaultThreadCount()) {
    for (std::size_t fold = 0; fold < options.folds; ++fold)
      folds_.push_back(std::make_unique<TuningFold>(splitTakes(takes, options.folds, fold)));
  }

  [[nodiscard]] TakeMeasures measure(std::size_t first, const LatticeWeights& weights) const {
    std::vector<std::pair<const TuningFold*, const CorpusTake*>> work;
    for (std::size_t i = first; i < folds_.size(); i += 2) {
      for (const CorpusTake& take : folds_[i]->split.held) work.emplace_back(folds_[i].get(), &take);
    }
    TakeMeasures measures(work.size());
    parallelFor(work.size(), jobs_,
                [&](std::size_t i) { measures[i] = measureTake(*work[i].first, *work[i].second, weights); });
    return measures;
  }

 private:
  std::vector<std::unique_ptr<TuningFold>> folds_;
  std::size_t jobs_;
};

void expectTrajectories(const Corpus& corpus, const TuningOptions& options) {
  constexpr std::size_t kLeastFolds = 4;
  if (corpus.trajectory_model == nullptr) {
    throw InputError(corpus.name, "", "has no trajectory model; expected one, whose lattice the weights are for");
  }
  expectFolds(corpus.takes.size(), options, kLeastFolds);
}

}  // namespace

void expectFolds(std::size_t corpus_takes, const TuningOptions& options, std::size_t least_folds) {
  constexpr std::size_t kLeastTakesAFold = 4;
  const std::size_t takes = std::min(corpus_takes, options.most_takes);
  if (options.folds >= least_folds && options.folds <= takes / kLeastTakesAFold) return;
  throw InputError("folds", "",
                   fmt::format("found {} for {} takes; expected at least {}, and {} takes in each", options.folds,
                               takes, least_folds, kLeastTakesAFold));
}

TunedWeights tuneLatticeWeights(const Corpus& corpus, const TuningOptions& options, const TuningProgress& progress) {
  expectTrajectories(corpus, options);
  const Corpus development = evenlySpacedTakes(corpus, options.most_takes);
  const LatticeTrial trial(development, options);
  return searchAndJudge<LatticeWeights>(trial, tunedLatticeFields(), corpus.lattice_weights, development.takes.size(),
                                        options.always, progress);
}

void storeTuning(Corpus& corpus, const TunedWeights& tuned) {
  corpus.lattice_weights = tuned.weights;
  corpus.build_log["lattice_weights"] = describeTuning(tuned);
}

}  // namespace mouthpiece
