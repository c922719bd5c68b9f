#include "corpus_tools/evaluation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "base/errors.h"
#include "corpus_tools/dominance_model.h"
#include "corpus_tools/evaluation_methods.h"
#include "synthetic_takes.h"

namespace mouthpiece {
namespace {

/// Interpolation at the captured frames reproduces them; what is left is rounding.
constexpr double kReproducedMm = 1e-3;

CorpusTake said(const std::string& name, const std::vector<std::string>& phones) {
  SyntheticTake take;
  take.name = name;
  take.phones = {"sil"};
  take.phones.insert(take.phones.end(), phones.begin(), phones.end());
  take.phones.emplace_back("sil");
  take.words = {name};
  return take.clean();
}

Corpus smallCorpus() {
  Corpus corpus;
  corpus.name = "small";
  corpus.layout = defaultLayout();
  corpus.neutral_pose_mm = syntheticNeutral();
  corpus.takes = {said("bimini", {"B", "IH", "M", "IH", "N", "IY"}), said("mama", {"M", "AA", "M", "AA"}),
                  said("papa", {"P", "AA", "P", "AA", "N"}), said("annie", {"AA", "N", "IY"}),
                  said("been", {"B", "IY", "N"})};
  return corpus;
}

const EvaluationRow& row(const Evaluation& evaluation, std::size_t i) { return evaluation.rows.at(i); }

const EvaluationRow& row(const Evaluation& evaluation, std::string_view method) {
  for (const EvaluationRow& own : evaluation.rows) {
    if (own.method == method) return own;
  }
  throw std::out_of_range(std::string(method));
}

TEST(Evaluation, ATakeOfTheCorpusComesBackAsItself) {
  const Corpus corpus = smallCorpus();
  const Evaluation evaluation = evaluateCorpus(corpus, {corpus.takes[0]}, evaluationMethods);
  ASSERT_EQ(evaluation.rows.size(), 6U);
  for (const std::size_t unit_row : {0U, 1U, 2U}) {
    EXPECT_LT(row(evaluation, unit_row).lips.lipRms(), kReproducedMm) << row(evaluation, unit_row).method;
    EXPECT_NEAR(row(evaluation, unit_row).lips.openingCorrelation(), 1, 1e-6);
    EXPECT_EQ(row(evaluation, unit_row).lips.closureRecall(), 1.0);
    EXPECT_EQ(row(evaluation, unit_row).backoffShare(), 0.0);
    EXPECT_NEAR(row(evaluation, unit_row).lips.varianceRatio(), 1, 1e-3);
  }
}

TEST(Evaluation, RecombinedTakesBeatDominanceAndTheMeanPose) {
  Corpus corpus = smallCorpus();
  const CorpusTake fresh = said("mani", {"M", "AA", "N", "IY"});
  const Evaluation evaluation = evaluateCorpus(corpus, {fresh}, evaluationMethods);
  const double greedy = row(evaluation, 0).lips.lipRms(), dominance = row(evaluation, "dominance").lips.lipRms(),
               mean = row(evaluation, "mean pose").lips.lipRms();
  EXPECT_LT(greedy, dominance);
  EXPECT_LT(dominance, mean);
  EXPECT_GT(row(evaluation, 0).units, 1U);
  EXPECT_EQ(row(evaluation, "mean pose").lips.openingCorrelation(), 0.0);
  EXPECT_EQ(row(evaluation, "mean pose").lips.closureRecall(), 0.0);
}

TEST(Evaluation, AConstantOffsetIsNoError) {
  const CorpusTake take = said("mama", {"M", "AA", "M", "AA"});
  MotionClip moved = take.motion;
  moved.positions_mm.array() += 5;
  const LipMeasures measures = measureLips(take.motion, moved, take.labels, defaultLayout());
  EXPECT_LT(measures.lipRms(), 1e-9);
  EXPECT_EQ(measures.closures, 2U);
  EXPECT_EQ(measures.closures_kept, 2U);
  EXPECT_EQ(measures.false_closures, 0U);
}

TEST(Evaluation, MeasuresHaveTheirDefinedValues) {
  const CorpusTake take = said("mama", {"M", "AA", "M", "AA"});
  MotionClip half = take.motion;
  const Eigen::RowVectorXd mean = half.positions_mm.colwise().mean();
  half.positions_mm = (0.5 * (half.positions_mm.rowwise() - mean)).rowwise() + mean;
  const LipMeasures measures = measureLips(take.motion, half, take.labels, defaultLayout());
  EXPECT_NEAR(measures.varianceRatio(), 0.25, 1e-9);
  EXPECT_NEAR(measures.jerkRatio(), 0.5, 1e-9);
  EXPECT_NEAR(measures.openingCorrelation(), 1.0, 1e-6);
  // The lower lip goes farthest: LVE is its variance left, a quarter of its own.
  const auto column = static_cast<Eigen::Index>(3 * defaultLayout().indexOf("LIP_LO_MID").value + 1);
  const Eigen::VectorXd lower = take.motion.positions_mm.col(column);
  const double variance = (lower.array() - lower.mean()).square().mean();
  EXPECT_NEAR(measures.lve(), 0.25 * variance, 1e-6);
}

TEST(Evaluation, ClosuresThatAreLostOrInventedAreCounted) {
  const CorpusTake closing = said("mam", {"M", "AA", "M"}), open = said("nan", {"N", "AA", "N"});
  const LipMeasures lost = measureLips(closing.motion, open.motion, closing.labels, defaultLayout());
  EXPECT_EQ(lost.closures, 2U);
  EXPECT_EQ(lost.closures_kept, 0U);
  EXPECT_EQ(lost.open_phones, 1U);
  EXPECT_EQ(lost.false_closures, 0U);
  const LipMeasures invented = measureLips(open.motion, closing.motion, open.labels, defaultLayout());
  EXPECT_EQ(invented.closures, 0U);
  EXPECT_TRUE(std::isnan(invented.closureRecall()));
  EXPECT_EQ(invented.open_phones, 3U);
  EXPECT_EQ(invented.false_closures, 2U);
}

TEST(Evaluation, JsonHoldsNoNaN) {
  const Corpus corpus = smallCorpus();
  const Evaluation evaluation = evaluateCorpus(corpus, {said("anna", {"AA", "N", "IY"})}, evaluationMethods);
  const nlohmann::json json = nlohmann::json::parse(evaluationJson(evaluation));
  EXPECT_EQ(json["rows"].size(), 6U);
  EXPECT_TRUE(json["rows"][0]["closure_recall"].is_null());
  EXPECT_TRUE(json["rows"][0]["lip_rms_mm"].is_number());
  EXPECT_NE(evaluationTable(evaluation).find("dominance"), std::string::npos);
}

TEST(HoldOut, TakesTheSameTakesForTheSameSeed) {
  const auto names_held = [](std::uint64_t seed, double share) {
    Corpus corpus = smallCorpus();
    std::vector<std::string> names;
    for (const CorpusTake& take : holdOut(corpus, share, seed)) names.push_back(take.name);
    EXPECT_EQ(corpus.takes.size() + names.size(), 5U);
    return names;
  };
  EXPECT_EQ(names_held(1, 0.4), names_held(1, 0.4));
  EXPECT_EQ(names_held(1, 0.4).size(), 2U);
  EXPECT_EQ(names_held(1, 0.01).size(), 1U);
  EXPECT_EQ(names_held(1, 0.999).size(), 4U);
  Corpus corpus = smallCorpus();
  EXPECT_THROW(holdOut(corpus, 0, 1), InputError);
  EXPECT_THROW(holdOut(corpus, 1, 1), InputError);
  EXPECT_THROW(holdOut(corpus, std::nan(""), 1), InputError);
  corpus.takes.resize(1);
  EXPECT_THROW(holdOut(corpus, 0.5, 1), InputError);
}

TEST(Dominance, ReachesTheTargetsOfLongPhones) {
  const Corpus corpus = smallCorpus();
  const DominanceModel model = DominanceModel::fit(corpus);
  const CorpusTake& take = corpus.takes[1];
  const MotionClip made = model.animate(take.labels, take.motion.frame_rate_hz, take.motion.frameCount());
  EXPECT_EQ(made.frameCount(), take.motion.frameCount());
  EXPECT_TRUE(made.positions_mm.allFinite());
  EXPECT_LT((made.positions_mm.row(0) - take.motion.positions_mm.row(0)).norm(), 1.0);
  const LipMeasures measures = measureLips(take.motion, made, take.labels, corpus.layout);
  EXPECT_GT(measures.openingCorrelation(), 0.9);
}

}  // namespace
}  // namespace mouthpiece
