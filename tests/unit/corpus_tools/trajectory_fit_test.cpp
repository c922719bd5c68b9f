#include "corpus_tools/building/trajectory_fit.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/errors.h"
#include "corpus_tools/research/evaluation/evaluation.h"
#include "corpus_tools/research/evaluation/evaluation_methods.h"
#include "synthetic_takes.h"

namespace mouthpiece {
namespace {

double correlation(const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
  const Eigen::VectorXd x = a.array() - a.mean(), y = b.array() - b.mean();
  return x.dot(y) / (x.norm() * y.norm());
}

TEST(TrajectoryFit, PredictsATakeThatItHasNotSeen) {
  Corpus corpus = speakingCorpus();
  const CorpusTake fresh = saidTake("mani", {"M", "AA", "N", "IY"});
  const auto model = fitTrajectoryModel(corpus);
  ASSERT_NE(model, nullptr);
  std::vector<Seconds> times;
  for (std::size_t frame = 0; frame < fresh.motion.frameCount(); ++frame)
    times.push_back(fresh.motion.timeOf(FrameIndex(frame)));
  const Eigen::MatrixXd predicted = model->predict(fresh.labels, times) * model->shapes;
  const auto column = static_cast<Eigen::Index>(3 * corpus.layout.indexOf("LIP_LO_MID").value + 1);
  EXPECT_GT(correlation(predicted.col(column), fresh.motion.positions_mm.col(column)), 0.9);
  // Nothing that speech does not move is predicted.
  EXPECT_EQ(predicted.col(static_cast<Eigen::Index>(3 * corpus.layout.indexOf("BROW_MID_L").value)).norm(), 0);
  EXPECT_GE(model->gain, 1);
  const auto threaded = fitTrajectoryModel(corpus, {.jobs = 3});
  EXPECT_EQ(threaded->targets, model->targets);
  ASSERT_EQ(threaded->networks.size(), model->networks.size());
  for (std::size_t i = 0; i < model->networks.size(); ++i)
    EXPECT_EQ(threaded->networks[i].input, model->networks[i].input) << "threads change nothing";
}

/// A long corpus: only some takes are kept in memory, and still every one of them tells targets.
TEST(TrajectoryFit, LearnsFromTakesThatItDoesNotKeep) {
  const Corpus corpus = speakingCorpus();
  double frames = 0;
  for (const CorpusTake& take : corpus.takes) frames += 30 * take.labels.duration();
  const auto whole = fitTrajectoryModel(corpus);
  const auto streamed = fitTrajectoryModel(corpus, {.most_kept_frames = 0.6 * frames});
  ASSERT_NE(streamed, nullptr);
  EXPECT_EQ(streamed->targets.size(), whole->targets.size());
  for (const auto& [feature, target] : whole->targets) {
    const auto found = streamed->targets.find(feature);
    ASSERT_NE(found, streamed->targets.end()) << feature;
    if (target.norm() > 0.1) {
      EXPECT_GT(found->second.norm(), 0) << feature;
    }
  }
  Corpus thinned = corpus;
  thinned.takes.clear();
  for (std::size_t i = 0; i < corpus.takes.size(); i += 2) thinned.takes.push_back(corpus.takes[i]);
  EXPECT_LT(fitTrajectoryModel(thinned)->targets.size(), streamed->targets.size()) << "they say something of their own";
}

TEST(TrajectoryFit, TooLittleGivesNone) {
  Corpus corpus = speakingCorpus();
  corpus.takes.resize(3);
  EXPECT_EQ(fitTrajectoryModel(corpus), nullptr);
}

TEST(CrossValidation, HoldsEveryTakeOutOnce) {
  const Corpus corpus = speakingCorpus();
  const Evaluation evaluation = crossValidate(corpus, 3, selectionMethods);
  EXPECT_EQ(evaluation.takes.size(), corpus.takes.size());
  ASSERT_EQ(evaluation.rows.size(), 2U);
  for (const EvaluationRow& row : evaluation.rows) {
    EXPECT_EQ(row.takes.size(), corpus.takes.size());
    EXPECT_GT(row.lips.lipRms(), 0.01);  // none was played from itself
  }
  EXPECT_THROW(crossValidate(corpus, 1, selectionMethods), InputError);
  EXPECT_THROW(crossValidate(corpus, 11, selectionMethods), InputError);
}

TEST(LearningCurve, NamesTheSizesOfItsCorpora) {
  const Corpus corpus = speakingCorpus();
  const Evaluation curve = learningCurve(corpus, {4, 8}, selectionMethods);
  ASSERT_EQ(curve.rows.size(), 4U);
  EXPECT_EQ(curve.takes.size(), 2U);
  EXPECT_EQ(curve.rows[3].method, "   8: guided");
  EXPECT_THROW(learningCurve(corpus, {0}, selectionMethods), InputError);
  EXPECT_THROW(learningCurve(corpus, {9}, selectionMethods), InputError);
}

TEST(Ablation, TurnsOneThingOffInEachRow) {
  Corpus corpus = speakingCorpus();
  corpus.trajectory_model = fitTrajectoryModel(corpus);
  const Evaluation evaluation = evaluateCorpus(corpus, {saidTake("pani", {"P", "AA", "N", "IY"})}, ablationMethods);
  ASSERT_GT(evaluation.rows.size(), 10U);
  EXPECT_EQ(evaluation.rows[0].method, "EDGE as published");
  for (const EvaluationRow& row : evaluation.rows) EXPECT_TRUE(std::isfinite(row.lips.lipRms())) << row.method;
}

TEST(Bootstrap, ItsIntervalHoldsTheMeasure) {
  const Corpus corpus = speakingCorpus();
  const Evaluation evaluation = crossValidate(corpus, 5, selectionMethods);
  const EvaluationRow& row = evaluation.rows[0];
  const Interval range = bootstrapInterval(row, [](const LipMeasures& lips) { return lips.lipRms(); });
  EXPECT_LT(range.low, row.lips.lipRms());
  EXPECT_GT(range.high, row.lips.lipRms());
  EXPECT_TRUE(std::isnan(bootstrapInterval(row, [](const LipMeasures&) { return std::nan(""); }).low));
}

}  // namespace
}  // namespace mouthpiece
