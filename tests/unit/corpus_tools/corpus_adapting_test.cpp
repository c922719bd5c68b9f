// A large corpus adapted to a person with few takes. The person is made: another size, and lips that part further, draw
// in their corners and carry less of the chin along.
#include "corpus_tools/building/corpus_adapting.h"

#include <gtest/gtest.h>

#include <cmath>

#include "corpus_tools/building/settings_fit.h"
#include "corpus_tools/research/evaluation/evaluation.h"
#include "corpus_tools/research/evaluation/evaluation_methods.h"
#include "support/error_of.h"
#include "support/run_program.h"
#include "synthetic_takes.h"

namespace mouthpiece {
namespace {

constexpr double kSize = 1.2;

CorpusTake asPerson(CorpusTake take) {
  const Corpus any = corpusOf("any", {});
  const MarkerPositions neutral = syntheticNeutral();
  for (Eigen::Index frame = 0; frame < take.motion.positions_mm.rows(); ++frame) {
    for (Eigen::Index marker = 0; marker < neutral.rows(); ++marker) {
      const LayoutMarker& own = any.layout.markers[unsignedIndex(marker)];
      auto place = take.motion.positions_mm.block<1, 3>(frame, 3 * marker);
      Eigen::RowVector3d move = place - neutral.row(marker);
      if (own.region == "chin" || own.region == "jaw") move *= 0.6;
      if (own.name.starts_with("LIP_CORNER")) move.x() = std::copysign(1.5 * move.y(), neutral(marker, 0));
      if (own.region == "lip") move.y() *= 1.5;
      place = kSize * (neutral.row(marker) + move);
    }
  }
  return take;
}

/// Takes 0 to `count` of speakingCorpus() as the person says them.
Corpus personsCorpus(std::size_t count) {
  Corpus own = speakingCorpus();
  own.name = "own";
  own.neutral_pose_mm *= kSize;
  own.takes.resize(count);
  for (CorpusTake& take : own.takes) take = asPerson(take);
  return own;
}

Corpus largeCorpus() {
  Corpus large = speakingCorpus();
  large.name = "large";
  fitMotion(large);
  return large;
}

std::vector<CorpusTake> unheard() {
  return {asPerson(saidTake("mani", {"M", "AA", "N", "IY"})), asPerson(saidTake("bima", {"B", "IY", "M", "AA"})),
          asPerson(saidTake("pina", {"P", "IH", "N", "AA", "M"}))};
}

double lipRms(const Corpus& corpus) {
  return evaluateCorpus(corpus, unheard(),
                        [](const Corpus&, const UnitDatabase& database) {
                          return std::vector{predictionMethod("prediction", database)};
                        })
      .rows[0]
      .lips.lipRms();
}

TEST(CorpusAdapting, BeatsTheLargeCorpusAndTheSmallOne) {
  const Corpus large = largeCorpus();
  Corpus small = personsCorpus(4);
  fitMotion(small);
  const double adapted = lipRms(adaptCorpus(large, small));
  EXPECT_LT(adapted, 0.7 * lipRms(adaptCorpus(large, personsCorpus(0)))) << "the large one, turned and sized";
  EXPECT_LT(adapted, lipRms(small));
}

/// Every other take says it faintly, those between say it broadly: no label tells which.
Corpus restlessCorpus(std::size_t count) {
  Corpus own = personsCorpus(count);
  const Eigen::Map<const Eigen::RowVectorXd> neutral(own.neutral_pose_mm.data(), own.neutral_pose_mm.size());
  for (std::size_t i = 0; i < own.takes.size(); ++i) {
    PositionMatrix& positions = own.takes[i].motion.positions_mm;
    positions = (i % 2 == 0 ? 0.3 : 1.7) * (positions.rowwise() - neutral);
    positions.rowwise() += neutral;
  }
  return own;
}

TEST(CorpusAdapting, MovesAsMuchAsThePersonDoesNotTheOther) {
  Corpus large = largeCorpus();
  const auto gainOf = [&](double others, const Corpus& own) {
    auto model = std::make_shared<TrajectoryModel>(*large.trajectory_model);
    model->gain = others;
    large.trajectory_model = model;
    return adaptCorpus(large, own).trajectory_model->gain;
  };
  const Corpus calm = personsCorpus(6), restless = restlessCorpus(6);
  EXPECT_NEAR(gainOf(1.25, calm), gainOf(1.0, calm), 1e-9) << "the other's is not this person's";
  EXPECT_GT(gainOf(1.0, restless), gainOf(1.0, calm) + 0.02) << "of whose movement less is predicted";
}

TEST(CorpusAdapting, HoldsThePersonsTakesAndTheOthersInThePersonsFace) {
  const Corpus large = largeCorpus(), own = personsCorpus(4);
  const Corpus adapted = adaptCorpus(large, own);
  ASSERT_EQ(adapted.takes.size(), 14U);
  EXPECT_EQ(adapted.neutral_pose_mm, own.neutral_pose_mm);
  EXPECT_EQ(motionOf(adapted, TakeIndex(2)).positions_mm, own.takes[2].motion.positions_mm);
  EXPECT_EQ(adapted.take_source->loadAudio(TakeIndex(2)).samples, own.takes[2].audio.samples);
  EXPECT_FALSE(isAdapted(adapted.takes[3]));
  EXPECT_TRUE(isAdapted(adapted.takes[4]));
  EXPECT_EQ(adapted.takes[13].name, "large/take9");
  EXPECT_TRUE(adapted.take_source->loadAudio(TakeIndex(13)).samples.empty()) << "another's voice";
  // A take that the person never said looks as the person would have said it.
  const PositionMatrix meant = asPerson(large.takes[9]).motion.positions_mm;
  const PositionMatrix mapped = motionOf(adapted, TakeIndex(13)).positions_mm;
  const auto column = signedIndex(3 * own.layout.indexOf("LIP_CORNER_L").value);
  const double moves = meant.col(column).maxCoeff() - meant.col(column).minCoeff();
  ASSERT_GT(moves, 3);
  EXPECT_LT((mapped - meant).col(column).cwiseAbs().maxCoeff(), 0.35 * moves) << "the other's corners stay";
}

TEST(CorpusAdapting, WithoutTakesOnlySizeAndAxesAreFitted) {
  const Corpus large = largeCorpus();
  Corpus own = personsCorpus(0);
  std::reverse(own.layout.markers.begin(), own.layout.markers.end());
  own.neutral_pose_mm = own.neutral_pose_mm.colwise().reverse().eval();
  const Corpus adapted = adaptCorpus(large, own);
  const MotionClip mapped = motionOf(adapted, TakeIndex(0));
  EXPECT_EQ(mapped.marker_names, own.layout.markerNames());
  const MotionClip back = selectMarkers(mapped, large.layout.markerNames());
  EXPECT_LT((back.positions_mm - kSize * large.takes[0].motion.positions_mm).cwiseAbs().maxCoeff(), 1e-3);
}

TEST(CorpusAdapting, ASampleThatWasNotSeenStaysSo) {
  Corpus large = largeCorpus();
  const auto column = signedIndex(3 * large.layout.indexOf("LIP_LO_MID").value);
  large.takes[1].motion.positions_mm.block<1, 3>(30, column).setConstant(std::nan(""));
  const Corpus own = personsCorpus(4), adapted = adaptCorpus(large, own);
  const MotionClip mapped = motionOf(adapted, TakeIndex(5));
  EXPECT_TRUE(std::isnan(mapped.positions_mm(30, column)));
  EXPECT_EQ((mapped.positions_mm.array().isNaN()).count(), 3);
}

TEST(CorpusAdapting, PrefersThePersonsOwnTakes) {
  const Corpus large = largeCorpus(), own = personsCorpus(10);
  Corpus adapted = adaptCorpus(large, own);
  const UnitDatabase database(adapted);
  SelectionOptions options;
  options.method = SelectionMethod::kViterbi;
  options.lattice = adapted.lattice_weights;
  const auto adaptedUnits = [&] {
    std::size_t count = 0;
    for (const CorpusTake& take : unheard()) {
      for (const SelectedUnit& unit : selectUnits(take.labels, database, options))
        count += isAdapted(database.takeOf(unit.source)) ? 1U : 0U;
    }
    return count;
  };
  EXPECT_EQ(adaptedUnits(), 0U) << "the person has said all that the other has";
  (*options.lattice)["adapted"] = 1e3;
  EXPECT_EQ(adaptedUnits(), 0U);
}

TEST(CorpusAdapting, TellsWhatItCannotUse) {
  const Corpus large = largeCorpus();
  Corpus other = personsCorpus(2);
  other.layout.markers[3].name = "WART";
  const std::string said = errorOf([&] { adaptCorpus(large, other); });
  EXPECT_NE(said.find("WART"), std::string::npos) << said;
  EXPECT_NE(errorOf([&] { adaptCorpus(speakingCorpus(), personsCorpus(2)); }).find("no trajectory model"),
            std::string::npos);
}

TEST(CorpusAdapting, TheProgramWritesACorpusThatIsWhole) {
  const test::ScratchFolder scratch;
  const auto at = [&](const char* name) { return (scratch.path() / name).string(); };
  writeCorpus(at("large.corpus"), largeCorpus());
  writeCorpus(at("own.corpus"), personsCorpus(4));
  const test::ProgramResult made =
      test::runProgram("corpus", {"adapt", at("large.corpus"), "--to", at("own.corpus"), "--out", at("both.corpus")});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_NE(made.out.find("4 own takes, 10 of large"), std::string::npos) << made.out;
  EXPECT_EQ(test::runProgram("corpus", {"check", at("both.corpus")}).exit_code, 0);
  const Corpus read = readCorpus(at("both.corpus"), CorpusAudio::kLoad);
  EXPECT_EQ(read.takes.size(), 14U);
  EXPECT_NEAR(lipRms(read), lipRms(adaptCorpus(largeCorpus(), personsCorpus(4))), 1e-3);
}

TEST(LearningCurve, ShowsALargeCorpusAloneAndAdapted) {
  const Corpus large = largeCorpus();
  EvaluationOptions options;
  options.adapted_from = &large;
  const Evaluation curve = learningCurve(personsCorpus(10), {4}, selectionMethods, options);
  std::vector<std::string> rows;
  for (const EvaluationRow& row : curve.rows) rows.push_back(row.method);
  EXPECT_EQ(rows, (std::vector<std::string>{"large: greedy", "large: guided", "   4: greedy", "   4: guided",
                                            "   4 adapted: greedy", "   4 adapted: guided"}));
}

}  // namespace
}  // namespace mouthpiece
