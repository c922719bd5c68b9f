// A line's motion made some frames at a time is the motion that is made at once.
#include "synthesis/line_motion.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <random>
#include <string>
#include <vector>

#include "support/tiny_corpus.h"
#include "support/tiny_model.h"

namespace mouthpiece {
namespace {

constexpr double kRounding = 1e-9;  // mm: sums over rows go by blocks

/// Words of a line of several seconds, some twice in a row, with pauses and many B P M F V.
SynthesisRequest longRequest(std::mt19937& random) {
  constexpr std::array kWords = {"M-AE-N", "AE-T", "N-UW-N", "DH-AH",  "T-AY-M",
                                 "IH-Z",   "N-AW", "B-IH-B", "F-AY-V", "T-EH-N"};
  std::string words;
  for (int word = 0; word < 60; ++word) {
    if (word > 0) words += random() % 6 == 0 ? " | " : " ";
    words += kWords[random() % kWords.size()];
  }
  SynthesisRequest request;
  request.labels = samples::tinyLabels(words, random());
  request.options.selection.method = SelectionMethod::kViterbi;
  request.options.expression.head = true;
  return request;
}

class LineMotionTest : public ::testing::Test {
 protected:
  LineMotionTest()
      : corpus_(samples::tinyCorpus({"M-AE-N AE-T N-UW-N", "DH-AH T-AY-M IH-Z N-AW", "B-IH-B F-AY-V", "T-EH-N M-EH-N",
                                     "IH-T IH-Z T-EH-N | N-AW"})) {
    corpus_.trajectory_model = samples::tinyModel(corpus_);
  }
  Corpus corpus_;
  AudioClip silence_;
};

TEST_F(LineMotionTest, InPiecesIsAsAtOnce) {
  const UnitDatabase database(corpus_);
  std::mt19937 random(3);
  for (int trial = 0; trial < 12; ++trial) {
    const SynthesisRequest request = longRequest(random);
    const SynthesisPlan plan = planLine(request.labels, database, request.options);
    ASSERT_TRUE(LineMotion::canMake(plan, request, database));
    const UtteranceAnimation at_once = renderPlan(plan, request, database);
    const Seconds piece = 1 + trial % 4;
    LineMotion motion(plan, request, database, silence_, piece);
    std::size_t next = 0, pieces = 0;
    double worst = 0;
    const MotionTold told = motion.forEachPiece([&](const MotionPiece& made) {
      ASSERT_EQ(made.first_frame, next);
      const PositionMatrix& whole = at_once.motion.positions_mm;
      ASSERT_EQ(made.positions_mm.cols(), whole.cols());
      const auto own = whole.middleRows(static_cast<Eigen::Index>(next), made.positions_mm.rows());
      worst = std::max(worst, (made.positions_mm - own).cwiseAbs().maxCoeff());
      next += static_cast<std::size_t>(made.positions_mm.rows());
      ++pieces;
    });
    EXPECT_EQ(next, at_once.motion.frameCount());
    EXPECT_GT(pieces, 3U) << "else nothing was tried";
    EXPECT_LE(worst, kRounding) << "trial " << trial;

    ASSERT_EQ(told.joins.size(), at_once.joins.size());
    for (std::size_t i = 0; i < told.joins.size(); ++i) {
      EXPECT_EQ(told.joins[i].time, at_once.joins[i].time);
      EXPECT_NEAR(told.joins[i].position_jump_mm, at_once.joins[i].position_jump_mm, kRounding);
      EXPECT_NEAR(told.joins[i].velocity_jump_mm_s, at_once.joins[i].velocity_jump_mm_s, 1e-6);
    }
    ASSERT_EQ(told.shares.size(), at_once.shares.size());
    for (std::size_t i = 0; i < told.shares.size(); ++i) {
      EXPECT_EQ(told.shares[i].start, at_once.shares[i].start);
      EXPECT_NEAR(told.shares[i].capture, at_once.shares[i].capture, 1e-6);
      EXPECT_NEAR(told.shares[i].contact, at_once.shares[i].contact, 1e-6);
    }
    EXPECT_GT(at_once.mouth.closures, 0U);
    EXPECT_EQ(told.mouth.bilabials, at_once.mouth.bilabials);
    EXPECT_EQ(told.mouth.closures, at_once.mouth.closures);
    EXPECT_NEAR(told.mouth.jitter_mm, at_once.mouth.jitter_mm, kRounding);
  }
}

TEST_F(LineMotionTest, LongLinesAloneAreLeftForLaterAndToldAllTheSame) {
  const UnitDatabase database(corpus_);
  std::mt19937 random(4);
  SynthesisRequest request = longRequest(random);
  EXPECT_EQ(synthesiseForPieces(request, database, silence_).motion, nullptr);
  request.sound_lasts = LineMotion::kPiece + 1;  // the face rests after it
  const UtteranceAnimation whole = synthesise(request, database);
  const SynthesisedLine later = synthesiseForPieces(request, database, silence_);
  ASSERT_NE(later.motion, nullptr);
  EXPECT_EQ(later.animation.motion.frameCount(), whole.motion.frameCount());
  EXPECT_EQ(later.animation.motion.positions_mm.size(), 0);
  EXPECT_EQ(later.animation.motion.marker_names, whole.motion.marker_names);
  EXPECT_EQ(later.animation.units.size(), whole.units.size());
  EXPECT_EQ(later.animation.curves, whole.curves);
  EXPECT_EQ(later.animation.lips.size(), whole.lips.size());
  EXPECT_EQ(later.animation.head.size(), whole.head.size());
  ASSERT_EQ(later.animation.settings.size(), whole.settings.size());

  request.options.dials.strength = StyleSignal(1.2);
  EXPECT_EQ(synthesiseForPieces(request, database, silence_).motion, nullptr) << "dials look at all of a line";
}

TEST_F(LineMotionTest, IsTheSameEachTime) {
  const UnitDatabase database(corpus_);
  std::mt19937 random(5);
  const SynthesisRequest request = longRequest(random);
  LineMotion motion(planLine(request.labels, database, request.options), request, database, silence_, 2);
  const auto all = [&] {
    std::vector<double> numbers;
    motion.forEachPiece([&](const MotionPiece& made) {
      numbers.insert(numbers.end(), made.positions_mm.data(), made.positions_mm.data() + made.positions_mm.size());
    });
    return numbers;
  };
  const std::vector<double> once = all();
  EXPECT_EQ(once, all());
  motion.release();
  EXPECT_EQ(once, all());
}

}  // namespace
}  // namespace mouthpiece
