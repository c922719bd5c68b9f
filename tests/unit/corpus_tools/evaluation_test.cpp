#include "corpus_tools/research/evaluation/evaluation.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <nlohmann/json.hpp>

#include "base/errors.h"
#include "corpus_tools/research/evaluation/evaluation_methods.h"
#include "motion/formats/motion_file.h"
#include "motion/lip_gauge.h"
#include "support/run_program.h"
#include "synthetic_takes.h"

namespace mouthpiece {
namespace {

/// Interpolation at the captured frames reproduces them; what is left is rounding.
constexpr double kReproducedMm = 1e-3;

Corpus smallCorpus() {
  return corpusOf("small", {saidTake("bimini", {"B", "IH", "M", "IH", "N", "IY"}),
                            saidTake("mama", {"M", "AA", "M", "AA"}), saidTake("papa", {"P", "AA", "P", "AA", "N"}),
                            saidTake("annie", {"AA", "N", "IY"}), saidTake("been", {"B", "IY", "N"})});
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
  ASSERT_EQ(evaluation.rows.size(), 7U);
  EXPECT_EQ(row(evaluation, 3).method, "EDGE as published");
  for (const std::size_t unit_row : {0U, 1U, 2U, 3U}) {
    EXPECT_LT(row(evaluation, unit_row).lips.lipRms(), kReproducedMm) << row(evaluation, unit_row).method;
    EXPECT_NEAR(row(evaluation, unit_row).lips.openingCorrelation(), 1, 1e-6);
    EXPECT_EQ(row(evaluation, unit_row).lips.closureRecall(), 1.0);
    EXPECT_EQ(row(evaluation, unit_row).backoffShare(), 0.0);
    EXPECT_NEAR(row(evaluation, unit_row).lips.varianceRatio(), 1, 1e-3);
  }
}

TEST(Evaluation, RecombinedTakesBeatDominanceAndTheMeanPose) {
  Corpus corpus = smallCorpus();
  const CorpusTake fresh = saidTake("mani", {"M", "AA", "N", "IY"});
  const Evaluation evaluation = evaluateCorpus(corpus, {fresh}, evaluationMethods);
  const double greedy = row(evaluation, "greedy, any units").lips.lipRms(),
               dominance = row(evaluation, "dominance").lips.lipRms(),
               mean = row(evaluation, "mean pose").lips.lipRms();
  EXPECT_LT(greedy, dominance);
  EXPECT_LT(dominance, mean);
  EXPECT_GT(row(evaluation, "greedy, any units").units, 1U);
  EXPECT_EQ(row(evaluation, "mean pose").lips.openingCorrelation(), 0.0);
  EXPECT_EQ(row(evaluation, "mean pose").lips.closureRecall(), 0.0);
}

TEST(Evaluation, AConstantOffsetIsNoError) {
  const CorpusTake take = saidTake("mama", {"M", "AA", "M", "AA"});
  MotionClip moved = take.motion;
  moved.positions_mm.array() += 5;
  const LipMeasures measures = measureLips(take.motion, moved, take.labels, defaultLayout());
  EXPECT_LT(measures.lipRms(), 1e-9);
  EXPECT_EQ(measures.closures, 2U);
  EXPECT_EQ(measures.closures_kept, 2U);
  EXPECT_EQ(measures.false_closures, 0U);
}

TEST(Evaluation, MeasuresHaveTheirDefinedValues) {
  const CorpusTake take = saidTake("mama", {"M", "AA", "M", "AA"});
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

TEST(Evaluation, ProtrusionHasItsOwnCorrelationAndDepth) {
  const CorpusTake take = saidTake("mama", {"M", "AA", "M", "AA"});
  MotionClip forward = take.motion, half = take.motion;
  for (Eigen::Index row = 0; row < forward.positions_mm.rows(); ++row) {
    const double wave = std::sin(0.3 * static_cast<double>(row));
    for (const char* marker : {"LIP_UP_MID", "LIP_LO_MID"}) {
      const auto z = static_cast<Eigen::Index>(3 * defaultLayout().indexOf(marker).value + 2);
      forward.positions_mm(row, z) += 2 * wave;
      half.positions_mm(row, z) += wave;
    }
  }
  const LipMeasures measures = measureLips(forward, half, take.labels, defaultLayout());
  EXPECT_NEAR(measures.protrusionCorrelation(), 1, 1e-6);
  EXPECT_NEAR(measures.protrusionDepth(), 0.5, 1e-6);
  EXPECT_LT(measureLips(forward, take.motion, take.labels, defaultLayout()).protrusionDepth(), 1e-6);
}

TEST(Evaluation, OnlyTheStretchesAskedForAreMeasured) {
  const CorpusTake take = saidTake("mama", {"M", "AA", "M", "AA"});
  MotionClip wrong = take.motion;
  const TimeSpan late = take.labels.phones[4].span;
  for (Eigen::Index row = 0; row < wrong.positions_mm.rows(); ++row) {
    if (late.contains(wrong.timeOf(FrameIndex(static_cast<std::size_t>(row)))))
      wrong.positions_mm.row(row).array() += 3;
  }
  const TimeSpan early = take.labels.phones[1].span;
  const double in_late = measureLips(take.motion, wrong, take.labels, defaultLayout(), {late}).lipRms();
  const double in_early = measureLips(take.motion, wrong, take.labels, defaultLayout(), {early}).lipRms();
  EXPECT_GT(in_late, 4 * in_early) << "what is left in the early one is the constant offset";
  const LipMeasures first = measureLips(take.motion, take.motion, take.labels, defaultLayout(), {early});
  EXPECT_EQ(first.closures, 1U) << "the second M lies elsewhere";
}

TEST(Evaluation, WhatIsUnseenIsInNoTakeThatSpeaks) {
  const Corpus corpus = speakingCorpus();
  for (const Unseen unseen : {Unseen::kWords, Unseen::kPairs, Unseen::kPhones}) {
    std::size_t rounds = 0;
    const EvaluationMethods methods = [&](const Corpus& rest, const UnitDatabase& database) {
      ++rounds;
      EXPECT_LT(rest.takes.size(), corpus.takes.size());
      return selectionMethods(rest, database);
    };
    const Evaluation evaluation = evaluateUnseen(corpus, unseen, methods, {}, {.most_rounds = 3, .most_takes = 2});
    EXPECT_EQ(rounds, 3U);
    ASSERT_EQ(evaluation.rows.size(), 2U);
    EXPECT_LT(evaluation.rows[0].lips.frames, crossValidate(corpus, 3, selectionMethods).rows[0].lips.frames);
  }
  Corpus one = corpus;
  one.takes.resize(1);
  EXPECT_THROW(evaluateUnseen(one, Unseen::kWords, selectionMethods), InputError);
}

TEST(Evaluation, ClosuresThatAreLostOrInventedAreCounted) {
  const CorpusTake closing = saidTake("mam", {"M", "AA", "M"}), open = saidTake("nan", {"N", "AA", "N"});
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

TEST(Evaluation, LowerLipsThatMissTheTeethAreCounted) {
  CorpusTake touching = saidTake("mam", {"M", "AA", "M"});  // of the made-up face only M B P lift the lower lip
  for (LabelledPhone& phone : touching.labels.phones) {
    if (phone.phone == Phone::kM) phone.phone = Phone::kF;
  }
  const auto lower = static_cast<Eigen::Index>(3 * defaultLayout().indexOf("LIP_LO_MID").value + 1);
  MotionClip low = touching.motion;
  const LipMeasures same = measureLips(touching.motion, low, touching.labels, defaultLayout());
  EXPECT_EQ(same.contacts, 2U);
  EXPECT_EQ(same.contactRecall(), 1.0);
  const double rest = touching.motion.positions_mm(0, lower);
  for (Eigen::Index row = 0; row < low.positions_mm.rows(); ++row) {
    const Seconds time = touching.motion.timeOf(FrameIndex(static_cast<std::size_t>(row)));
    const TimeSpan& last = touching.labels.phones[3].span;
    if (time > last.start - 0.03 && time < last.end + 0.03) low.positions_mm(row, lower) = rest - 6;
  }
  EXPECT_EQ(measureLips(touching.motion, low, touching.labels, defaultLayout()).contacts_kept, 1U);
}

TEST(Evaluation, JsonHoldsNoNaN) {
  const Corpus corpus = smallCorpus();
  const Evaluation evaluation = evaluateCorpus(corpus, {saidTake("anna", {"AA", "N", "IY"})}, evaluationMethods);
  const nlohmann::json json = nlohmann::json::parse(evaluationJson(evaluation));
  EXPECT_EQ(json["rows"].size(), 7U);
  EXPECT_TRUE(json["rows"][0]["closure_recall"].is_null());
  EXPECT_TRUE(json["rows"][0]["lip_rms_mm"].is_number());
  const std::string table = evaluationTable(evaluation);
  EXPECT_NE(table.find("dominance"), std::string::npos);
  EXPECT_TRUE(table.starts_with("1 take against")) << table;
  EXPECT_EQ(table.find("interval"), std::string::npos) << "of a single take there is none";
  EXPECT_TRUE(json["rows"][0]["intervals"]["lip_rms_mm"][0].is_null());
  const std::string two = evaluationTable(evaluateCorpus(
      corpus, {saidTake("anna", {"AA", "N", "IY"}), saidTake("mina", {"M", "IY", "N", "AA"})}, evaluationMethods));
  EXPECT_TRUE(two.starts_with("2 takes against")) << two;
  EXPECT_NE(two.find(" to "), std::string::npos) << two;
}

TEST(Evaluation, KeepsTheCurvesThatAPageDraws) {
  const Corpus corpus = smallCorpus();
  const std::vector<CorpusTake> fresh = {saidTake("</script>", {"M", "AA", "N", "IY"}), saidTake("anna", {"AA", "N"})};
  EvaluationOptions options;
  EXPECT_TRUE(evaluateCorpus(corpus, fresh, selectionMethods, options).compared.empty());
  options.keep_curves = true;
  const Evaluation evaluation = evaluateCorpus(corpus, fresh, selectionMethods, options);
  ASSERT_EQ(evaluation.compared.size(), 2U);
  EXPECT_EQ(evaluation.compared[0].captured.opening_mm.size(), fresh[0].motion.frameCount());
  for (const EvaluationRow& each : evaluation.rows) {
    ASSERT_EQ(each.curves.size(), 2U);
    std::size_t joins = 0;
    for (const LipCurves& curves : each.curves) joins += curves.joins.size();
    EXPECT_EQ(joins, each.join_jumps_mm.size());
    EXPECT_EQ(each.curves[1].width_mm.size(), fresh[1].motion.frameCount());
  }
  const std::string page = evaluationHtml(evaluation);
  EXPECT_NE(page.find("opening_mm"), std::string::npos);
  EXPECT_EQ(page.find("</script>", page.find("</script>") + 1), std::string::npos) << "a take's name ends the script";
  EXPECT_LT(evaluationHtml(evaluation, 1).size(), page.size());
}

TEST(Evaluation, ComparesWithTheTruthThatItIsGiven) {
  const Corpus corpus = smallCorpus();
  CorpusTake blurred = corpus.takes[0];
  blurred.motion.positions_mm.array() += 0.2 * (blurred.motion.positions_mm.array() * 7).sin();
  const auto error = [&](const EvaluationOptions& options) {
    return evaluateCorpus(corpus, {blurred}, selectionMethods, options).rows[0].lips.lipRms();
  };
  EXPECT_GT(error({}), 10 * kReproducedMm);
  EvaluationOptions options;
  options.truth[blurred.name] = corpus.takes[0].motion;
  EXPECT_LT(error(options), kReproducedMm);
}

TEST(Evaluation, BringsTheTruthIntoTheCorpusFrame) {
  const test::ScratchFolder scratch;
  const Corpus corpus = corpusOf("one", {saidTake("mama", {"M", "AA", "M", "AA"})});
  MotionClip turned = corpus.takes[0].motion;
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.2, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  for (Eigen::Index frame = 0; frame < turned.positions_mm.rows(); ++frame) {
    for (Eigen::Index column = 0; column < turned.positions_mm.cols(); column += 3) {
      const Eigen::Vector3d place = turned.positions_mm.block<1, 3>(frame, column).transpose();
      turned.positions_mm.block<1, 3>(frame, column) = (turn * place).transpose() + Eigen::RowVector3d(5, -3, 20);
    }
  }
  writeMotion(scratch.path() / "mama.c3d", turned);
  const std::map<std::string, MotionClip> truth = readTruth(corpus, scratch.path());
  constexpr double kFileRoundingMm = 1e-3;
  EXPECT_LT((truth.at("mama").positions_mm - corpus.takes[0].motion.positions_mm).cwiseAbs().maxCoeff(),
            kFileRoundingMm);
  turned.positions_mm.conservativeResize(turned.positions_mm.rows() - 1, Eigen::NoChange);
  writeMotion(scratch.path() / "mama.c3d", turned);
  EXPECT_THROW(readTruth(corpus, scratch.path()), InputError);
  EXPECT_THROW(readTruth(corpus, scratch.path() / "nowhere"), InputError);
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
