#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "base/errors.h"
#include "support/tiny_corpus.h"
#include "synthesis/curve_model.h"
#include "synthesis/synthesis.h"
#include "vocal/viseme_poses.h"

namespace mouthpiece {
namespace {

using samples::lipOpening;
using samples::tinyCorpus;
using samples::tinyLabels;

SynthesisRequest filledRequest(const SpeechLabels& labels, double frame_rate_hz = 240) {
  SynthesisRequest request;
  request.labels = labels;
  request.options.frame_rate_hz = frame_rate_hz;
  request.options.curves.fill_gaps = true;
  return request;
}

// The tiny corpus has T-AY-M and N-AW, but no M-B, B-AE, AE-D.
constexpr const char* kWithGaps = "DH-AH T-AY-M B-AE-D N-AW";

std::size_t indexOf(const SpeechLabels& labels, Phone phone) {
  const auto found = std::find_if(labels.phones.begin(), labels.phones.end(),
                                  [&](const LabelledPhone& labelled) { return labelled.phone == phone; });
  return static_cast<std::size_t>(found - labels.phones.begin());
}

TEST(CurveFill, FillsJustWhatTheCorpusLacks) {
  const Corpus corpus = tinyCorpus();
  const SpeechLabels labels = tinyLabels(kWithGaps, 3);
  const UtteranceAnimation made = synthesise(filledRequest(labels), corpus);
  EXPECT_TRUE(made.motion.positions_mm.allFinite());
  std::vector<PhoneRange> gaps;
  for (const PlacedUnit& unit : made.units) {
    EXPECT_EQ(unit.is_backoff, unit.scale == "curves");
    if (unit.is_backoff) gaps.push_back(unit.phones);
  }
  // M-B, B-AE, AE-D and D-N are four missing pairs in a row: one stretch.
  ASSERT_EQ(gaps.size(), 1U);
  EXPECT_EQ(gaps[0].first.value, indexOf(labels, Phone::kM));
  EXPECT_EQ(gaps[0].last.value, indexOf(labels, Phone::kN));
  for (std::size_t i = 1; i < made.units.size(); ++i)
    EXPECT_EQ(made.units[i].phones.first, made.units[i - 1].phones.last) << "neighbours share a phone";
}

TEST(CurveFill, WithoutGapsNothingChanges) {
  const Corpus corpus = tinyCorpus();
  SynthesisRequest request = filledRequest(tinyLabels("T-AY-M IH-Z T-EH-N", 42));
  const UtteranceAnimation filled = synthesise(request, corpus);
  request.options.curves.fill_gaps = false;
  EXPECT_EQ(filled.motion.positions_mm, synthesise(request, corpus).motion.positions_mm);
}

TEST(CurveFill, BeyondTheJoinsTheCaptureIsUntouched) {
  const Corpus corpus = tinyCorpus();
  const SpeechLabels labels = tinyLabels(kWithGaps, 3);
  const UtteranceAnimation whole = synthesise(filledRequest(labels), corpus);
  const UnitDatabase database(corpus);
  SynthesisRequest request = filledRequest(labels);
  SynthesisPlan plan = planLine(labels, database, request.options);
  ASSERT_EQ(plan.segments.back().kind(), Segment::Kind::kCaptured);
  // Up to the phone before the first gap's shared one, the units before it alone say what happens.
  const Seconds end = labels.phones[indexOf(labels, Phone::kAY)].span.start;
  plan.lay({{PhoneIndex(indexOf(labels, Phone::kM)), PhoneIndex(labels.phones.size() - 1)}, std::nullopt});
  const UtteranceAnimation units = renderPlan(plan, request, database);
  const auto rows = static_cast<Eigen::Index>(end * 240);
  EXPECT_LT((whole.motion.positions_mm.topRows(rows) - units.motion.positions_mm.topRows(rows)).cwiseAbs().maxCoeff(),
            1e-9);
}

TEST(CurveFill, ContinuousInPositionAndVelocity) {
  const Corpus corpus = tinyCorpus();
  for (std::uint64_t seed = 3; seed <= 6; ++seed) {
    const UtteranceAnimation coarse = synthesise(filledRequest(tinyLabels(kWithGaps, seed), 240), corpus);
    ASSERT_FALSE(coarse.joins.empty());
    // A jump in position would be as large at four times the frame rate, one in velocity would not shrink either.
    SynthesisRequest fine_request = filledRequest(tinyLabels(kWithGaps, seed), 960);
    const UtteranceAnimation fine = synthesise(fine_request, corpus);
    const auto largest = [](const UtteranceAnimation& made, double Join::*jump) {
      double most = 0;
      for (const Join& join : made.joins) most = std::max(most, join.*jump);
      return most;
    };
    EXPECT_LT(largest(fine, &Join::position_jump_mm), 0.4 * largest(coarse, &Join::position_jump_mm)) << seed;
    EXPECT_LT(largest(fine, &Join::velocity_jump_mm_s), 0.6 * largest(coarse, &Join::velocity_jump_mm_s)) << seed;
  }
}

TEST(CurveFill, BilabialsCloseTheLips) {
  const Corpus corpus = tinyCorpus();
  const SpeechLabels labels = tinyLabels(kWithGaps, 3);
  const UtteranceAnimation made = synthesise(filledRequest(labels), corpus);
  const TimeSpan span = labels.phones[indexOf(labels, Phone::kB)].span;
  const std::vector<double> opening = lipOpening(made.motion);
  const double rest = 1;  // mm apart in the neutral pose
  EXPECT_LT(opening[static_cast<std::size_t>(span.middle() * 240)], rest + 0.5);
  const TimeSpan vowel = labels.phones[indexOf(labels, Phone::kAE)].span;
  EXPECT_GT(opening[static_cast<std::size_t>(vowel.middle() * 240)], rest + 2) << "and open for the vowel";
}

TEST(CurveFill, ALineOfGapsAloneIsCurvesAlone) {
  const Corpus corpus = tinyCorpus();
  SynthesisRequest request = filledRequest(tinyLabels("Z-OY-G", 1));
  const UtteranceAnimation filled = synthesise(request, corpus);
  ASSERT_EQ(filled.units.size(), 1U);
  request.options.curves.alone = CurveStyle::kSpeech;
  const UtteranceAnimation alone = synthesise(request, corpus);
  EXPECT_EQ(alone.style, "speech");
  EXPECT_EQ(filled.motion.positions_mm, alone.motion.positions_mm);
  const UnitDatabase database(corpus);
  const CurveModel model(database);
  std::vector<Seconds> times;
  for (std::size_t frame = 0; frame < alone.motion.frameCount(); ++frame)
    times.push_back(alone.motion.timeOf(FrameIndex(frame)));
  PositionMatrix wanted = displacementsFromCurves(alone.curves, model.poses(), StyleSignal(1), StyleSignal(1), times);
  wanted.rowwise() += Eigen::Map<const Eigen::RowVectorXd>(corpus.neutral_pose_mm.data(), 12);
  EXPECT_LT((alone.motion.positions_mm - wanted).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(CurveFill, EditsMoveTheFaceWhereTheyAreAndNowhereElse) {
  const Corpus corpus = tinyCorpus();
  SynthesisRequest request = filledRequest(tinyLabels("T-AY-M IH-Z T-EH-N", 42), 60);
  const UtteranceAnimation plain = synthesise(request, corpus);
  request.options.edits.curves = {{"Ah", CurveEdit::Kind::kOffset, {0.3, 0.5}, 0.5, 0.05, {}}};
  const UtteranceAnimation edited = synthesise(request, corpus);
  const PositionMatrix change = edited.motion.positions_mm - plain.motion.positions_mm;
  for (Eigen::Index row = 0; row < change.rows(); ++row) {
    const Seconds time = static_cast<double>(row) / 60;
    if (time < 0.3 || time > 0.5) {
      EXPECT_LT(change.row(row).cwiseAbs().maxCoeff(), 1e-6) << time;
    }
  }
  EXPECT_GT(change.row(24).cwiseAbs().maxCoeff(), 0.1) << "0.4 s";
}

}  // namespace
}  // namespace mouthpiece
