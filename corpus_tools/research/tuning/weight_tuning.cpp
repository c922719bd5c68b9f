// The tuning of the selection's weights, of tuning.h.
#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <optional>
#include <random>
#include <vector>

#include "base/errors.h"
#include "base/parallel_for.h"
#include "corpus_tools/research/tuning/coordinate_search.h"
#include "corpus_tools/research/evaluation/evaluation.h"
#include "synthesis/synthesis.h"
#include "units/costs/cost_terms.h"
#include "units/selection/unit_database.h"

namespace mouthpiece {
namespace {

/// What the ablation turns off can be learnt: the stand-ins' price decides nothing where the corpus has the pair.
std::vector<TunedField<LatticeWeights>> tunedLatticeFields() {
  std::vector<TunedField<LatticeWeights>> fields;
  const std::span<const CostTerm> terms = pairTerms();
  for (std::size_t i = 0; i < terms.size(); ++i) {
    if (terms[i].ablation.empty()) continue;
    fields.push_back({terms[i].name, [i](LatticeWeights& weights) -> double& { return weights.values()[i]; }});
  }
  return fields;
}

using TakeMeasures = std::vector<std::optional<LipMeasures>>;

/// The takes of one fold and what speaks them: stays where it is, since the database refers to it.
struct TuningFold {
  explicit TuningFold(SplitTakes parts) : split(std::move(parts)), database(split.rest) {
    split.held = atOfferedRates(std::move(split.held));
  }
  SplitTakes split;
  UnitDatabase database;
};

/// nullopt where not even a stand-in is found, whatever the weights are.
std::optional<LipMeasures> measureTake(const TuningFold& fold, const CorpusTake& take, const LatticeWeights& weights) {
  SynthesisRequest request{take.text, "capture", take.labels, {}, {}};
  request.options.frame_rate_hz = take.motion.frame_rate_hz;
  request.options.selection.method = SelectionMethod::kViterbi;
  request.options.selection.lattice = weights;
  request.options.context.settings = MotionSettings{};  // those that a corpus has learnt may leave fragments no say
  try {
    const UtteranceAnimation made = synthesise(request, fold.database);
    return measureLips(take.motion, made.motion, take.labels, fold.split.rest.layout);
  } catch (const InputError&) {
    return std::nullopt;
  }
}

class LatticeTrial {
 public:
  using Score = double;

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

  static double scoreOf(const TakeMeasures& takes) {
    LipMeasures sum;
    for (const auto& take : takes) {
      if (take) sum += *take;
    }
    return tuningScore(sum);
  }

  /// By bootstrap over takes.
  static double errorOfDifference(const TakeMeasures& before, const TakeMeasures& after) {
    constexpr std::size_t kDraws = 500;
    constexpr std::uint64_t kSeed = 1;
    std::mt19937_64 random(kSeed);
    double sum = 0, squares = 0;
    for (std::size_t draw = 0; draw < kDraws; ++draw) {
      LipMeasures drawn_before, drawn_after;
      for (std::size_t i = 0; i < before.size(); ++i) {
        const std::size_t take = random() % before.size();
        if (before[take]) drawn_before += *before[take];
        if (after[take]) drawn_after += *after[take];
      }
      const double difference = tuningScore(drawn_after) - tuningScore(drawn_before);
      sum += difference;
      squares += difference * difference;
    }
    constexpr auto kCount = asReal(kDraws);
    return std::sqrt(std::max(0.0, squares / kCount - (sum / kCount) * (sum / kCount)));
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

double tuningScore(const LipMeasures& measures) {
  const double lost = measures.closures > 0 ? 1 - measures.closureRecall() : 0;
  const double invented = measures.open_phones > 0 ? measures.falseClosureShare() : 0;
  return measures.lipRms() + lost + invented;
}

TunedWeights tuneLatticeWeights(const Corpus& corpus, const TuningOptions& options, const TuningProgress& progress) {
  expectTrajectories(corpus, options);
  const Corpus development = evenlySpacedTakes(corpus, options.most_takes);
  const LatticeTrial trial(development, options);
  return searchAndJudge<LatticeWeights>(trial, tunedLatticeFields(), corpus.lattice_weights, development.takes.size(), options.always,
                                        progress);
}

std::string describeTuning(const TunedWeights& tuned) {
  return fmt::format(
      "{}: {} settings tried on {} takes, score {:.3f} -> {:.3f}; judged on {} others, {:.3f} -> {:.3f} (standard "
      "error of the difference {:.3f}); best found: {}",
      tuned.taken ? "learnt" : "kept as they were", tuned.settings, tuned.search_takes, tuned.search_before,
      tuned.search_after, tuned.judge_takes, tuned.judge_before, tuned.judge_after, tuned.judge_error,
      tuned.changes.empty() ? "no change" : tuned.changes);
}

void storeTuning(Corpus& corpus, const TunedWeights& tuned) {
  corpus.lattice_weights = tuned.weights;
  corpus.build_log["lattice_weights"] = describeTuning(tuned);
}

}  // namespace mouthpiece
