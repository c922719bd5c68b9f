// The search that both tunings share, on scores with a known least.
#include "corpus_tools/building/settings_search.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <vector>

#include "base/errors.h"
#include "corpus_tools/building/trajectory_fit.h"
#include "corpus_tools/research/evaluation/evaluation_methods.h"
#include "corpus_tools/research/tuning/tuning.h"
#include "support/random_corpus.h"
#include "synthetic_takes.h"

namespace mouthpiece {
namespace {

struct TwoWeights {
  double a = 1, b = 1;
  bool operator==(const TwoWeights&) const = default;
};

std::vector<TunedField<TwoWeights>> fields() {
  return {{"a", [](TwoWeights& weights) -> double& { return weights.a; }},
          {"b", [](TwoWeights& weights) -> double& { return weights.b; }}};
}

/// A bowl whose least lies at (a, b), in the logarithm.
double bowl(const TwoWeights& weights, double a, double b) {
  return std::pow(std::log(weights.a / a), 2) + std::pow(std::log(weights.b / b), 2);
}

TEST(CoordinateSearch, FindsTheLeastOfABowlWithinItsReach) {
  samples::Chance chance(samples::firstSeed());
  for (int round = 0; round < 50; ++round) {
    const double a = std::exp(chance.between(-1.5, 1.5)), b = std::exp(chance.between(-1.5, 1.5));
    const auto score = [&](const TwoWeights& weights) { return bowl(weights, a, b); };
    const auto searched = fields();
    CoordinateSearch<TwoWeights> search(score, searched, {});
    const double before = search.bestScore();
    std::size_t told = 0, of = 0;
    search.searchAll([&](std::size_t done, std::size_t total) {
      EXPECT_EQ(done, ++told);
      of = total;
    });
    EXPECT_EQ(told, of);
    EXPECT_LE(search.bestScore(), before);
    EXPECT_DOUBLE_EQ(search.bestScore(), score(search.best()));
    // Its last steps are by 1.4: it ends within a step of the least, or at its farthest, four times 1.96.
    EXPECT_LT(std::abs(std::log(search.best().a / a)), std::log(1.4)) << a;
    EXPECT_LT(std::abs(std::log(search.best().b / b)), std::log(1.4)) << b;
    EXPECT_GE(search.tried(), 1 + 2 * 2 * fields().size() / 2);
  }
}

TEST(CoordinateSearch, LeavesWeightsAloneThatDoNotMatter) {
  const auto searched = fields();
  CoordinateSearch<TwoWeights> search([](const TwoWeights& weights) { return std::pow(std::log(weights.a / 2), 2); },
                                      searched, {});
  search.searchAll({});
  EXPECT_EQ(search.best().b, 1);
  EXPECT_EQ(search.best().a, 2);
}

TEST(CoordinateSearch, AScoreThatIsNoNumberIsNoGain) {
  const auto searched = fields();
  CoordinateSearch<TwoWeights> search(
      [](const TwoWeights& weights) { return weights == TwoWeights() ? 1.0 : std::nan(""); }, searched, {});
  search.searchAll({});
  EXPECT_EQ(search.best(), TwoWeights());
}

TEST(ChangesBetween, NamesWhatChanged) {
  const auto searched = fields();
  const std::span<const TunedField<TwoWeights>> span(searched);
  EXPECT_EQ(changesBetween<TwoWeights>(span, {1, 2}, {1, 2}), "");
  EXPECT_EQ(changesBetween<TwoWeights>(span, {1, 2}, {0.5, 2}), "a 1 -> 0.5");
  EXPECT_EQ(changesBetween<TwoWeights>(span, {1, 2}, {0.5, 4}), "a 1 -> 0.5, b 2 -> 4");
}

/// A trial whose searching takes and judging takes have their least at different weights.
struct BowlTrial {
  using Score = double;
  double search_least = 2, judge_least = 2, noise = 0;
  [[nodiscard]] std::vector<double> measure(std::size_t first, const TwoWeights& weights) const {
    return {bowl(weights, first == 0 ? search_least : judge_least, 1)};
  }
  static double scoreOf(const std::vector<double>& takes) { return takes[0]; }
  [[nodiscard]] double errorOfDifference(const std::vector<double>&, const std::vector<double>&) const { return noise; }
};

TEST(SearchAndJudge, TakesOnlyWhatHelpsTheTakesItNeverSaw) {
  const auto searched = fields();
  const auto tune = [&](const BowlTrial& trial, bool always) {
    return searchAndJudge<TwoWeights>(trial, std::span<const TunedField<TwoWeights>>(searched), {}, 10, always, {});
  };
  const auto helped = tune({}, false);
  EXPECT_TRUE(helped.helps && helped.taken);
  EXPECT_EQ(helped.weights.a, 2);
  EXPECT_EQ(helped.search_takes + helped.judge_takes, 10U);
  const auto harmed = tune({.judge_least = 0.5}, false);
  EXPECT_FALSE(harmed.helps || harmed.taken);
  EXPECT_EQ(harmed.weights, TwoWeights());
  EXPECT_LT(harmed.search_after, harmed.search_before);
  const auto chance = tune({.noise = 10}, false);
  EXPECT_FALSE(chance.taken) << "a gain within the error is chance";
  const auto insisted = tune({.judge_least = 0.5}, true);
  EXPECT_TRUE(insisted.taken && !insisted.helps);
  EXPECT_EQ(insisted.weights.a, 2);
  const auto nothing = tune({.search_least = 1, .judge_least = 1}, true);
  EXPECT_FALSE(nothing.taken) << "nothing was found";
}

TEST(ExpectFolds, WantsTakesEnoughForEach) {
  EXPECT_NO_THROW(expectFolds(8, {.folds = 2}, 2));
  EXPECT_THROW(expectFolds(7, {.folds = 2}, 2), InputError);
  EXPECT_THROW(expectFolds(100, {.folds = 1}, 2), InputError);
  EXPECT_THROW(expectFolds(100, {.folds = 6, .most_takes = 20}, 2), InputError);
}

TEST(Ablation, HasARowForEachThatTheTableNames) {
  const Corpus corpus = speakingCorpus();
  const UnitDatabase database(corpus);
  std::vector<std::string> names;
  for (const EvaluationMethod& method : ablationMethods(corpus, database)) names.push_back(method.name);
  std::set<std::string> expected;
  for (const CostTerm& term : pairTerms()) {
    if (!term.ablation.empty()) expected.insert("- " + std::string(term.ablation));
  }
  for (const std::string& name : expected) EXPECT_EQ(std::count(names.begin(), names.end(), name), 1) << name;
  const std::vector<std::string> steps(names.begin(), names.begin() + 7);
  EXPECT_EQ(steps, (std::vector<std::string>{"EDGE as published", "+ silences' pace", "+ join where lips agree",
                                             "+ offsets led away", "+ lips in the costs", "+ units of any length",
                                             "+ cheapest cover"}));
  const std::vector<std::string> first(names.begin() + 7, names.begin() + 17);
  EXPECT_EQ(first, (std::vector<std::string>{"guided", "- prediction as cost", "- duration", "- neighbours",
                                             "- position, stress", "- speaking rate", "- closure as cost",
                                             "- join position", "- join velocity", "- cost of a unit"}));
}

}  // namespace
}  // namespace mouthpiece
