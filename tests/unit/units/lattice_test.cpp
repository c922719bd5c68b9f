#include "units/selection/lattice.h"

#include <gtest/gtest.h>

#include <array>
#include <limits>

#include "base/errors.h"
#include "support/tiny_corpus.h"
#include "support/tiny_model.h"

namespace mouthpiece {
namespace {

using samples::tinyCorpus;
using samples::tinyLabels;

Corpus modelledCorpus(const std::vector<std::string>& lines) {
  Corpus corpus = lines.empty() ? tinyCorpus() : tinyCorpus(lines);
  corpus.trajectory_model = samples::tinyModel(corpus);
  return corpus;
}

SelectionOptions viterbi() {
  SelectionOptions options;
  options.method = SelectionMethod::kViterbi;
  options.pairs_kept = 1000;
  return options;
}

double totalCost(const std::vector<SelectedUnit>& units) {
  double cost = 0;
  for (const SelectedUnit& unit : units) cost += unit.target_cost + unit.join_cost;
  return cost;
}

TEST(Lattice, AWholeTakeIsOneUnit) {
  const Corpus corpus = modelledCorpus({});
  const UnitDatabase database(corpus);
  for (std::size_t take = 0; take < corpus.takes.size(); ++take) {
    const auto units = selectUnits(corpus.takes[take].labels, database, viterbi());
    ASSERT_EQ(units.size(), 1U);
    EXPECT_EQ(units[0].source, (PhonePlace{TakeIndex(take), PhoneIndex(0)}));
    EXPECT_EQ(units[0].join_cost, 0);
  }
}

TEST(Lattice, FindsTheLeastCostOfAllPaths) {
  const Corpus corpus = modelledCorpus({"T-AE-M", "T-AE-M", "M-AE-T", "AE-M T-AE"});
  const UnitDatabase database(corpus);
  const SpeechLabels line = tinyLabels("T-AE-M", 50);
  const SelectionOptions options = viterbi();
  const SelectionCosts costs(line, database, corpus.lattice_weights);
  const double unit = corpus.lattice_weights["unit"];
  double least = std::numeric_limits<double>::infinity();
  std::size_t paths = 0;
  const auto extend = [&](auto&& self, std::size_t first, double cost, const PhonePlace* before) -> void {
    if (first + 1 == line.phones.size()) {
      least = std::min(least, cost);
      ++paths;
      return;
    }
    for (const PhonePlace& place : database.diphones(line.phones[first].phone, line.phones[first + 1].phone)) {
      double own = costs.targetCost({PhoneIndex(first), PhoneIndex(first + 1)}, place);
      if (before != nullptr && advance(*before, 1) != place)
        own += unit + costs.joinCost(PhoneIndex(first), advance(*before, 1), place);
      self(self, first + 1, cost + own, &place);
    }
  };
  extend(extend, 0, 0, nullptr);
  ASSERT_GT(paths, 20U);
  const auto units = selectUnits(line, database, options);
  constexpr double kOrder = 1e-9;  // of the sums
  EXPECT_NEAR(totalCost(units), least, kOrder);
}

TEST(Lattice, KeepingFewPlacesNeverBeatsKeepingAll) {
  const Corpus corpus = modelledCorpus({});
  const UnitDatabase database(corpus);
  const SpeechLabels line = tinyLabels("N-UW-N IH-Z T-EH-N", 9);
  SelectionOptions few = viterbi();
  few.pairs_kept = 1;
  EXPECT_GE(totalCost(selectUnits(line, database, few)) + 1e-4, totalCost(selectUnits(line, database, viterbi())));
}

TEST(Lattice, AMissingPairGetsAStandInThatClosesTheLips) {
  const Corpus corpus = modelledCorpus({"M-AE-N", "T-AE-T"});
  const UnitDatabase database(corpus);
  const SpeechLabels line = tinyLabels("P-AE-N", 3);  // no P in the corpus
  const auto units = selectUnits(line, database, viterbi());
  std::size_t stand_ins = 0;
  for (const SelectedUnit& unit : units) {
    if (!unit.is_backoff) continue;
    ++stand_ins;
    const std::size_t p = 1 - unit.phones.first.value;
    EXPECT_TRUE(isBilabial(database.phoneAt(advance(unit.source, p)).phone));
  }
  EXPECT_EQ(stand_ins, 2U);
  SelectionOptions strict = viterbi();
  strict.backoff = Backoff::kNone;
  EXPECT_THROW(selectUnits(line, database, strict), InputError);
}

TEST(Lattice, WhatWasNotSeenIsNotOffered) {
  Corpus corpus = modelledCorpus({"M-AE-N", "M-AE-N"});
  corpus.takes[0].motion.positions_mm.leftCols(3).setConstant(std::numeric_limits<double>::quiet_NaN());
  // A marker that no component looks at may be missing.
  corpus.takes[1].motion.positions_mm.rightCols(3).setConstant(std::numeric_limits<double>::quiet_NaN());
  const UnitDatabase database(corpus);
  for (const SelectedUnit& unit : selectUnits(corpus.takes[0].labels, database, viterbi())) {
    EXPECT_EQ(unit.source.take.value, 1U);
  }
}

TEST(LinePrediction, ReachesTheTargetOfALongPhone) {
  const Corpus corpus = modelledCorpus({});
  const TrajectoryModel& model = *corpus.trajectory_model;
  SpeechLabels line = tinyLabels("M-AE-M", 0);
  line.phones[1].span = {0.2, 1.2};
  line.phones[2].span = {1.2, 2.2};
  line.phones[3].span = {2.2, 3.2};
  line.phones[4].span = {3.2, 4.0};
  const std::array<Seconds, 3> middles{0.7, 1.7, 2.7};
  const Eigen::MatrixXd values = model.predict(line, middles);
  EXPECT_NEAR(values(0, 0), 4 - 4, 1e-3);
  EXPECT_NEAR(values(1, 0), 4 + 5, 1e-3);  // AE is of the class Eh: no length feature
  EXPECT_NEAR(values(1, 1), -1 - 3, 1e-3);
  EXPECT_NEAR(values(2, 0), 4 - 4, 1e-3);
}

TEST(ContextMean, IsWhatTheCorpusHasInCommonBeyondThePrediction) {
  Corpus corpus = modelledCorpus({"T-AE-T", "T-AE-T", "T-AE-T", "T-AE-T", "T-AE-T", "T-AE-T"});
  for (CorpusTake& take : corpus.takes) take.labels = corpus.takes[0].labels;
  // Every take is the prediction, and 2 mm wider open.
  const TrajectoryModel& model = *corpus.trajectory_model;
  for (CorpusTake& take : corpus.takes) {
    MotionClip& motion = take.motion;
    std::vector<Seconds> times;
    for (std::size_t frame = 0; frame < motion.frameCount(); ++frame) times.push_back(motion.timeOf(FrameIndex(frame)));
    Eigen::MatrixXd values = model.predict(take.labels, times);
    values.col(0).array() += 2;
    const Eigen::Map<const Eigen::RowVectorXd> neutral(corpus.neutral_pose_mm.data(), corpus.neutral_pose_mm.size());
    motion.positions_mm = (values * model.shapes).rowwise() + neutral;
  }
  const UnitDatabase database(corpus);
  const Eigen::MatrixXd mean =
      contextMean(corpus.takes[0].labels, database, predictedShapes(model, corpus.takes[0].labels));
  const Eigen::Index vowel = 2 * PhoneShapes::kPoints + 2;
  // Six takes by two pairs against one that holds back.
  constexpr double kBetweenFrames = 0.02;  // mm
  EXPECT_NEAR(mean(vowel, 0), 2 * 12.0 / 13.0, kBetweenFrames);
  EXPECT_NEAR(mean(vowel, 1), 0, kBetweenFrames);
}

}  // namespace
}  // namespace mouthpiece
