#include "units/costs/cost_terms.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "base/errors.h"
#include "base/files.h"
#include "support/tiny_corpus.h"
#include "support/tiny_model.h"
#include "units/selection/lattice.h"

namespace mouthpiece {
namespace {

using samples::tinyCorpus;
using samples::tinyLabels;

/// A row of the page's table, as it must stand there.
std::string pageRow(const CostTerm& term) {
  std::string weight = std::to_string(term.weight);
  weight.erase(weight.find_last_not_of('0') + 1);
  if (weight.back() == '.') weight.pop_back();
  const std::string unit = term.unit.empty() ? "" : " " + std::string(term.unit);
  return "| " + std::string(term.name) + " | " + weight + unit + " | " + std::string(term.what) + " |\n";
}

TEST(CostTerms, StandOnTheirPageWordForWord) {
  const std::string page = readFile(std::string(MOUTHPIECE_SOURCE_DIR) + "/docs/theory/units/selection.md");
  for (const auto terms : {pairTerms(), fragmentTerms()}) {
    std::string table;
    for (const CostTerm& term : terms) table += pageRow(term);
    EXPECT_NE(page.find(table), std::string::npos) << "docs/theory/units/selection.md lacks these rows:\n" << table;
  }
}

TEST(CostTerms, HaveNamesOfTheirOwnAndWeights) {
  for (const auto terms : {pairTerms(), fragmentTerms()}) {
    std::set<std::string_view> names;
    for (const CostTerm& term : terms) {
      EXPECT_TRUE(names.insert(term.name).second) << term.name;
      EXPECT_GT(term.weight, 0) << term.name;
      EXPECT_FALSE(term.what.empty()) << term.name;
    }
    EXPECT_TRUE(names.contains("unit") && names.contains("stand-in")) << "the search counts these";
  }
}

TEST(CostTerms, WeightsGoByTheNamesOfTheirTerms) {
  LatticeWeights weights;
  for (std::size_t i = 0; i < pairTerms().size(); ++i) {
    EXPECT_EQ(weights[pairTerms()[i].name], pairTerms()[i].weight);
    weights[pairTerms()[i].name] = static_cast<double>(i);
    EXPECT_EQ(weights.values()[i], static_cast<double>(i));
  }
  EXPECT_FALSE(weights == LatticeWeights());
  EXPECT_THROW((void)weights["word position"], InternalError) << "of fragments only";
}

/// The line and a corpus whose takes are each wrong in one thing.
class OneThingWrong : public ::testing::Test {
 protected:
  /// What term `name` alone costs of the fragment at `place` of take 1 for the phones [first, last] of take 0's labels.
  template <typename Weights>
  double cost(const Corpus& corpus, const char* name, std::size_t first, std::size_t last) const {
    const UnitDatabase database(corpus);
    Weights weights;
    for (double& weight : weights.values()) weight = 0;
    weights[name] = 1;
    return SelectionCosts(corpus.takes[0].labels, database, weights)
        .targetCost({PhoneIndex(first), PhoneIndex(last)}, {TakeIndex(1), PhoneIndex(first)});
  }

  /// Two takes of the same labels and motion.
  static Corpus twice(const char* words) {
    Corpus corpus = tinyCorpus({words, words});
    corpus.takes[1].labels = corpus.takes[0].labels;
    corpus.takes[1].motion = corpus.takes[0].motion;
    corpus.trajectory_model = samples::tinyModel(corpus);
    return corpus;
  }
  static constexpr double kRounding = 1e-5;
};

TEST_F(OneThingWrong, NothingCostsNothing) {
  const Corpus corpus = twice("M-AE-N T-AY-M");
  for (const CostTerm& term : fragmentTerms()) {
    if (term.name == "closure") continue;
    EXPECT_EQ(cost<SelectionWeights>(corpus, term.name.data(), 1, 4), 0) << term.name;
  }
  for (const CostTerm& term : pairTerms()) {
    // What was captured differs from the prediction, also where all is as wanted.
    if (term.name == "prediction" || term.name == "closure") continue;
    EXPECT_NEAR(cost<LatticeWeights>(corpus, term.name.data(), 2, 3), 0, 1e-3) << term.name;
  }
}

TEST_F(OneThingWrong, DurationCostsItsLogarithmHalfAtSharedPhones) {
  Corpus corpus = twice("M-AE-N T-AY-M");
  for (LabelledPhone& phone : corpus.takes[1].labels.phones) {
    phone.span.start *= 2;
    phone.span.end *= 2;
  }
  EXPECT_NEAR(cost<SelectionWeights>(corpus, "duration", 1, 4), 3 * std::log(2), kRounding) << "2 whole, 2 half";
  EXPECT_NEAR(cost<SelectionWeights>(corpus, "duration", 0, 1), 0.5 * std::log(2), kRounding) << "silence is free";
  EXPECT_NEAR(cost<LatticeWeights>(corpus, "duration", 2, 3), std::log(2), kRounding);
  EXPECT_NEAR(cost<LatticeWeights>(corpus, "rate", 2, 3), std::log(2), kRounding);
}

TEST_F(OneThingWrong, StressAndEdgesAreCounted) {
  Corpus corpus = twice("M-AE-N T-AY-M");  // sil M AE N T AY M sil
  SpeechLabels& found = corpus.takes[1].labels;
  for (LabelledSyllable& syllable : found.syllables) syllable.stress = syllable.stress > 0 ? 0 : 1;
  EXPECT_EQ(cost<SelectionWeights>(corpus, "stress", 1, 3), 2) << "half, whole, half";
  EXPECT_EQ(cost<LatticeWeights>(corpus, "stress", 1, 2), 1);
  found = corpus.takes[0].labels;
  found.words[0].phones.last = PhoneIndex(2);  // N belongs to no word
  found.phones[3].word.reset();
  EXPECT_EQ(cost<SelectionWeights>(corpus, "word position", 1, 4), 2) << "AE ends a word, N does not";
  EXPECT_EQ(cost<LatticeWeights>(corpus, "position", 2, 3), 1);
}

TEST_F(OneThingWrong, NeighboursCostByTheirClass) {
  Corpus corpus = twice("M-AE-N T-AY-M");
  corpus.takes[1].labels.phones[1].phone = Phone::kP;  // as M
  EXPECT_EQ(cost<SelectionWeights>(corpus, "context", 2, 3), 0.5);
  EXPECT_NEAR(cost<LatticeWeights>(corpus, "neighbours", 2, 3), 2 * 0.5 / 6, kRounding);
  corpus.takes[1].labels.phones[1].phone = Phone::kT;
  EXPECT_EQ(cost<SelectionWeights>(corpus, "context", 2, 3), 1);
  EXPECT_NEAR(cost<LatticeWeights>(corpus, "neighbours", 2, 3), 2.0 / 6, kRounding);
  EXPECT_NEAR(cost<LatticeWeights>(corpus, "neighbours", 3, 4), 1.0 / 6, kRounding) << "two away";
  corpus.takes[1].labels = corpus.takes[0].labels;
  corpus.takes[1].labels.phones[5].phone = Phone::kS;  // no vowel any more
  EXPECT_NEAR(cost<LatticeWeights>(corpus, "neighbours", 3, 4), 2.0 / 6, kRounding) << "what follows";
  EXPECT_NEAR(cost<LatticeWeights>(corpus, "neighbours", 2, 3), 1.0 / 6, kRounding) << "two away behind";
}

/// What ranks candidates before they are looked at closely: neighbours by their class on both sides, a third each.
TEST_F(OneThingWrong, RoughCostsCountTheNearestNeighbours) {
  Corpus corpus = twice("M-AE-N T-AY-M");  // sil M AE N T AY M sil
  const auto rough = [&](std::size_t first) {
    const UnitDatabase database(corpus);
    LatticeWeights weights;
    for (double& weight : weights.values()) weight = 0;
    weights["neighbours"] = 1;
    return SelectionCosts(corpus.takes[0].labels, database, weights)
        .roughCost(first, {TakeIndex(1), PhoneIndex(first)});
  };
  for (std::size_t first = 0; first < 7; ++first) EXPECT_EQ(rough(first), 0) << first;
  std::vector<LabelledPhone>& phones = corpus.takes[1].labels.phones;
  phones[4].phone = Phone::kD;  // looks as T does
  EXPECT_NEAR(rough(2), 0.5 / 3, kRounding);
  phones[4].phone = Phone::kUW;
  EXPECT_NEAR(rough(2), 1.0 / 3, kRounding);
  phones[1].phone = Phone::kB;
  EXPECT_NEAR(rough(2), 1.5 / 3, kRounding);
  phones[1].phone = Phone::kK;
  EXPECT_NEAR(rough(2), 2.0 / 3, kRounding);
  EXPECT_NEAR(rough(5), 1.0 / 3, kRounding) << "before AY M";
}

TEST_F(OneThingWrong, LipsThatStayOpenInAClosureCost) {
  Corpus corpus = twice("AE-M-AE");
  corpus.takes[1].motion.positions_mm.col(4).array() -= 3;  // the lower lip hangs 3 mm lower
  const Corpus as_wanted = twice("AE-M-AE");
  constexpr double kNeutralMm = 1, kUsualMm = 0.5, kLipsMm = 0.15;  // in its M the take's own lips nearly touch
  EXPECT_NEAR(cost<SelectionWeights>(corpus, "closure", 1, 3), 3 - kNeutralMm, kLipsMm);
  EXPECT_EQ(cost<SelectionWeights>(as_wanted, "closure", 1, 3), 0);
  EXPECT_NEAR(cost<LatticeWeights>(corpus, "closure", 1, 2), 0.5 * (3 - kUsualMm), kLipsMm);
  EXPECT_EQ(cost<LatticeWeights>(as_wanted, "closure", 1, 2), 0);
  EXPECT_EQ(cost<SelectionWeights>(corpus, "closure", 0, 1), 0) << "no B P M";
}

TEST_F(OneThingWrong, MotionFarFromThePredictionCosts) {
  Corpus corpus = twice("M-AE-N");
  const double before = cost<LatticeWeights>(corpus, "prediction", 1, 2);
  corpus.takes[1].motion.positions_mm.col(7).array() += 20;  // the chin, which the second component looks at
  EXPECT_GT(cost<LatticeWeights>(corpus, "prediction", 1, 2), before + 50);
  EXPECT_NEAR(cost<LatticeWeights>(corpus, "context", 1, 2), 0, kRounding) << "that is told by labels alone";
  corpus.takes[1].motion.positions_mm.setConstant(std::nan(""));
  EXPECT_TRUE(std::isinf(cost<LatticeWeights>(corpus, "prediction", 1, 2)));
}

TEST(JoinTerms, TellPositionVelocityAndOpeningApart) {
  Corpus corpus = tinyCorpus({"M-AE-N", "M-AE-N", "M-AE-N"});
  corpus.trajectory_model = samples::tinyModel(corpus);
  for (CorpusTake& take : corpus.takes) {
    take.labels = corpus.takes[0].labels;
    take.motion = corpus.takes[0].motion;
  }
  corpus.takes[1].motion.positions_mm.col(7).array() += 4;  // chin: component 1, by 4 mm throughout
  corpus.takes[2].motion.positions_mm.col(4).array() -= 4;  // lower lip: component 0, which opens the lips
  const UnitDatabase database(corpus);
  const auto join = [&](const auto& usual, const char* name, std::size_t take) {
    auto weights = usual;
    for (double& weight : weights.values()) weight = 0;
    weights[name] = 1;
    return SelectionCosts(corpus.takes[0].labels, database, weights)
        .joinCost(PhoneIndex(2), {TakeIndex(0), PhoneIndex(2)}, {TakeIndex(take), PhoneIndex(2)});
  };
  constexpr double kPacked = 0.01;  // PackedShapes
  EXPECT_NEAR(join(LatticeWeights(), "join position", 1), 4, kPacked);
  EXPECT_NEAR(join(LatticeWeights(), "join opening", 1), 0, kPacked);
  EXPECT_NEAR(join(LatticeWeights(), "join opening", 2), 4, kPacked);
  EXPECT_LT(join(LatticeWeights(), "join velocity", 1), 1) << "mm/s: a constant difference does not move";
  EXPECT_NEAR(join(SelectionWeights(), "join position", 1), 4 / std::sqrt(3), kPacked) << "one of three markers";
  EXPECT_LT(join(SelectionWeights(), "join velocity", 1), 1);
  EXPECT_EQ(join(SelectionWeights(), "join position", 0), 0);
}

/// Part of a line may begin and end in speech: nothing before its first phone is looked at.
TEST(PartOfALine, IsSelectedLikeAnother) {
  Corpus corpus = tinyCorpus({"M-AE-N T-AY-M", "AE-N T-AY"});
  SpeechLabels part;
  const SpeechLabels line = tinyLabels("M-AE-N T-AY-M", 9);
  for (std::size_t i = 2; i < 6; ++i) {
    part.phones.push_back(line.phones[i]);
    part.phones.back().word.reset();
    part.phones.back().syllable.reset();
  }
  for (const bool has_model : {false, true}) {
    if (has_model) corpus.trajectory_model = samples::tinyModel(corpus);
    for (const SelectionMethod method : {SelectionMethod::kGreedy, SelectionMethod::kViterbi}) {
      const UnitDatabase database(corpus);
      const auto units = selectUnits(part, database, {.method = method});
      ASSERT_EQ(units.size(), 1U);
      EXPECT_EQ(units[0].phones.last.value, 3U);
      EXPECT_TRUE(std::isfinite(units[0].target_cost));
    }
  }
  PhoneColumns columns;
  columns.add(part, false);
  const PhoneFacts first = columns.factsOf({TakeIndex(0), PhoneIndex(0)});
  const PhoneFacts last = columns.factsOf({TakeIndex(0), PhoneIndex(3)});
  EXPECT_EQ(first.phones[1], Phone::kSil);
  EXPECT_EQ(first.edges, 16U) << "begins a phrase";
  EXPECT_EQ(last.edges, 32U);
  EXPECT_TRUE(first.is_first && last.is_last && !first.is_last);
}

TEST(RoughCost, IsTheTargetCostOfDurationsAndNearestNeighbours) {
  Corpus corpus = tinyCorpus();
  corpus.trajectory_model = samples::tinyModel(corpus);
  const UnitDatabase database(corpus);
  const SpeechLabels line = tinyLabels("T-EH-N N-AW", 5);
  LatticeWeights durations;
  for (double& weight : durations.values()) weight = 0;
  durations["duration"] = 1;
  const SelectionCosts costs(line, database, durations);
  std::size_t compared = 0;
  for (std::size_t first = 0; first + 1 < line.phones.size(); ++first) {
    for (const PhonePlace& place : database.diphones(line.phones[first].phone, line.phones[first + 1].phone)) {
      EXPECT_NEAR(costs.roughCost(first, place), costs.targetCost({PhoneIndex(first), PhoneIndex(first + 1)}, place),
                  1e-5);
      ++compared;
    }
  }
  EXPECT_GT(compared, 5U);
}

}  // namespace
}  // namespace mouthpiece
