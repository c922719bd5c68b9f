// What a face does beside speaking: lids, brows, gaze, head and moods.
#include "expression/expression.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "base/errors.h"
#include "motion/resample.h"
#include "support/error_of.h"
#include "support/run_program.h"
#include "support/tiny_corpus.h"
#include "synthesis/synthesis.h"
#include "units/file/corpus.h"

namespace mouthpiece {
namespace {

using samples::tinyLabels;

constexpr double kRateHz = 100;
constexpr double kOpenMm = 10;  ///< lids at rest
const std::vector<std::string> kLines{"DH-AH T-AY-M | N-AW", "M-AE-N | B-AY", "T-AY-M N-AW | DH-AH M-AE-N",
                                      "N-AW | T-AY-M"};

MarkerPositions neutralPose(const MarkerLayout& layout) {
  MarkerPositions pose(static_cast<Eigen::Index>(layout.markers.size()), 3);
  for (std::size_t m = 0; m < layout.markers.size(); ++m)
    pose.row(static_cast<Eigen::Index>(m)) << 3.0 * static_cast<double>(m), 50, 1;
  for (const char* side : {"R", "L"}) {
    pose(layout.indexOf(std::string("LID_UP_") + side).row(), 1) = 60 + kOpenMm;
    pose(layout.indexOf(std::string("LID_LO_") + side).row(), 1) = 60;
  }
  return pose;
}

Eigen::Index heightOf(const MarkerLayout& layout, std::string_view marker) {
  return 3 * layout.indexOf(marker).row() + 1;
}

/// A corpus whose speaker blinks once in each take, in the pause, and whose mouth trembles.
Corpus blinkingCorpus(double depth = 0.95) {
  Corpus corpus;
  corpus.name = "blinking";
  corpus.layout = defaultLayout();
  corpus.neutral_pose_mm = neutralPose(corpus.layout);
  const Eigen::Map<const Eigen::RowVectorXd> rest(corpus.neutral_pose_mm.data(), corpus.neutral_pose_mm.size());
  for (std::size_t i = 0; i < kLines.size(); ++i) {
    CorpusTake& take = corpus.takes.emplace_back();
    take.name = "take" + std::to_string(i);
    take.labels = tinyLabels(kLines[i], 0);
    const auto pause = std::find_if(take.labels.phones.begin() + 1, take.labels.phones.end(),
                                    [](const LabelledPhone& phone) { return phone.phone == Phone::kSil; });
    const auto frames = static_cast<Eigen::Index>(std::lround(take.labels.duration() * kRateHz)) + 1;
    take.motion = {kRateHz, corpus.layout.markerNames(), rest.replicate(frames, 1)};
    const std::vector<bool> upper = upperFaceColumns(corpus.layout);
    for (Eigen::Index k = 0; k < frames; ++k) {
      const double since = (static_cast<double>(k) / kRateHz - pause->span.middle()) / 0.08;
      for (const char* lid : {"LID_UP_R", "LID_UP_L"})
        take.motion.positions_mm(k, heightOf(corpus.layout, lid)) -= depth * kOpenMm * std::exp(-since * since);
      for (std::size_t c = 0; c < upper.size(); ++c) {
        if (!upper[c])
          take.motion.positions_mm(k, static_cast<Eigen::Index>(c)) += std::sin(0.3 * static_cast<double>(k));
      }
    }
  }
  return corpus;
}

/// A minute of four words and a pause again and again.
SpeechLabels longLabels() {
  std::string text;
  for (int i = 0; i < 60; ++i) text += i == 0 ? "T-AY-M N-AW M-AE-N B-AY" : " | T-AY-M N-AW M-AE-N B-AY";
  return tinyLabels(text, 1);
}

std::vector<Seconds> timesOf(const SpeechLabels& labels) {
  return frameTimes(0, static_cast<std::size_t>(labels.duration() * kRateHz), kRateHz);
}

LineExpression expressionOfLine(const SpeechLabels& labels, const Corpus& corpus, const ExpressionOptions& options,
                                bool asks = false) {
  const UnitDatabase database(corpus);
  return expressionOf(labels, asks, timesOf(labels), database, options);
}

Eigen::VectorXd lidOpening(const LineExpression& made, const MarkerLayout& layout) {
  return made.upper_mm.col(heightOf(layout, "LID_UP_R")) - made.upper_mm.col(heightOf(layout, "LID_LO_R"));
}

TEST(CapturedUpperFace, ASentenceOfTheCorpusHasItsOwnLidsAndNoMouth) {
  const Corpus corpus = blinkingCorpus();
  for (const CorpusTake& take : corpus.takes) {
    const LineExpression made = expressionOfLine(take.labels, corpus, {.upper_face = UpperFaceSource::kBest});
    EXPECT_EQ(made.upper_face, "captured");
    EXPECT_EQ(made.stretches, 1U) << take.name << ": a cut where none is needed";
    EXPECT_NEAR(lidOpening(made, corpus.layout).minCoeff(), 0.05 * kOpenMm, 0.3);
    const std::vector<bool> upper = upperFaceColumns(corpus.layout);
    for (std::size_t c = 0; c < upper.size(); ++c) {
      if (upper[c]) continue;
      EXPECT_TRUE(made.upper_mm.col(static_cast<Eigen::Index>(c)).isZero(0)) << "column " << c;
    }
  }
}

TEST(CapturedUpperFace, BlinksComeInPausesAsTheyWereCapturedAndNeverJump) {
  const Corpus corpus = blinkingCorpus();
  const SpeechLabels labels = tinyLabels("M-AE-N T-AY-M | N-AW DH-AH | B-AY N-AW | T-AY-M M-AE-N", 3);
  const LineExpression made = expressionOfLine(labels, corpus, {.upper_face = UpperFaceSource::kCaptured});
  const Eigen::VectorXd open = lidOpening(made, corpus.layout);
  ASSERT_TRUE(open.allFinite());
  int pauses = 0, blinked = 0;
  for (std::size_t i = 1; i + 1 < labels.phones.size(); ++i) {
    if (labels.phones[i].phone != Phone::kSil) continue;
    ++pauses;
    const auto first = static_cast<Eigen::Index>(labels.phones[i].span.start * kRateHz);
    const auto count = static_cast<Eigen::Index>(labels.phones[i].span.duration() * kRateHz);
    blinked += open.segment(first, count).minCoeff() < 0.3 * kOpenMm ? 1 : 0;
  }
  EXPECT_EQ(blinked, pauses);
  const double fastest = (open.tail(open.size() - 1) - open.head(open.size() - 1)).cwiseAbs().maxCoeff();
  EXPECT_LT(fastest, 0.25 * kOpenMm) << "of a lid in a hundredth of a second";
}

TEST(CapturedUpperFace, LidsThatNeverCloseAreNoCapture) {
  const Corpus corpus = blinkingCorpus(0.3);
  const SpeechLabels labels = tinyLabels(kLines[0], 0);
  EXPECT_EQ(expressionOfLine(labels, corpus, {.upper_face = UpperFaceSource::kBest}).upper_face, "rules");
  EXPECT_NE(errorOf([&] {
              expressionOfLine(labels, corpus, {.upper_face = UpperFaceSource::kCaptured});
            }).find("the corpus blinking has captured no lids that blink"),
            std::string::npos);
}

TEST(RuledUpperFace, BlinksAsOftenAsPeopleDoAndWhollyMoreInPauses) {
  const Corpus corpus = blinkingCorpus();
  const SpeechLabels labels = longLabels();
  double rate = 0, in_pauses = 0, paused = 0;
  constexpr int kSeeds = 8;
  for (std::uint32_t seed = 1; seed <= kSeeds; ++seed) {
    const LineExpression made = expressionOfLine(labels, corpus, {.upper_face = UpperFaceSource::kRules, .seed = seed});
    const Eigen::VectorXd open = lidOpening(made, corpus.layout);
    EXPECT_NEAR(open(open.size() - 1), kOpenMm, 0.3) << "a line ends with open eyes";
    EXPECT_NEAR(open.maxCoeff(), kOpenMm, 0.3) << "brows take lids along a little";
    rate += static_cast<double>(made.blinks.size()) / labels.duration() * 60 / kSeeds;
    for (const Seconds blink : made.blinks) {
      const auto shut = static_cast<Eigen::Index>((blink + 0.105) * kRateHz);
      EXPECT_LT(std::abs(open(shut)), 0.05 * kOpenMm) << "at " << blink << " s";
      in_pauses += std::any_of(labels.phones.begin(), labels.phones.end(), [&](const LabelledPhone& phone) {
        return phone.phone == Phone::kSil && phone.span.start <= blink && blink < phone.span.end;
      });
    }
  }
  for (const LabelledPhone& phone : labels.phones) paused += phone.phone == Phone::kSil ? phone.span.duration() : 0;
  EXPECT_GT(rate, 12);
  EXPECT_LT(rate, 32);
  const double all = rate / 60 * labels.duration() * kSeeds;
  EXPECT_GT(in_pauses / all, 1.2 * paused / labels.duration());
}

TEST(RuledUpperFace, ASeedIsAFaceAndAQuestionRaisesTheBrows) {
  const Corpus corpus = blinkingCorpus();
  const SpeechLabels labels = longLabels();
  const auto made = [&](std::uint32_t seed, bool asks) {
    return expressionOfLine(labels, corpus,
                            {.upper_face = UpperFaceSource::kRules, .gaze = true, .head = true, .seed = seed}, asks);
  };
  EXPECT_EQ(made(4, false).upper_mm, made(4, false).upper_mm);
  EXPECT_NE(made(4, false).upper_mm, made(5, false).upper_mm);
  const auto brow = heightOf(corpus.layout, "BROW_IN_R");
  const PositionMatrix asked = made(4, true).upper_mm, told = made(4, false).upper_mm;
  const Eigen::Index end = asked.rows() - 20;
  EXPECT_GT(asked.col(brow).segment(end - 30, 30).maxCoeff(), told.col(brow).segment(end - 30, 30).minCoeff() + 1);
  EXPECT_EQ(asked.topRows(200), told.topRows(200)) << "what was said before is not changed by it";
}

TEST(RuledUpperFace, AQuestionEndsWithAMarkOfAnyScript) {
  for (const char* text :
       {"Is it?", "Is it?\" ", "Was?!", "¿Qué?»", "何ですか？」", "هل هذا؟", "Ti ine\u037E", "So. Is it? 🙂"})
    EXPECT_TRUE(isQuestion(text)) << text;
  for (const char* text : {"", "It is.", "Is it? It is.", "¿", "何です。", "\"Is it?\" he asked", "Is it?\xFF"})
    EXPECT_FALSE(isQuestion(text)) << text;
}

TEST(RuledUpperFace, SaysWhereNothingCanMove) {
  Corpus corpus = samples::tinyCorpus();
  for (LayoutMarker& marker : corpus.layout.markers) marker.name = "my " + marker.name;
  const LineExpression made = expressionOfLine(longLabels(), corpus, {.upper_face = UpperFaceSource::kRules});
  ASSERT_EQ(made.warnings.size(), 1U);
  EXPECT_NE(made.warnings[0].find("no marker of lids or brows"), std::string::npos);
}

TEST(HeadAndGaze, RestAtBothEndsAndTheEyesMakeUpForTheHead) {
  const Corpus corpus = blinkingCorpus();
  const SpeechLabels labels = longLabels();
  const LineExpression made = expressionOfLine(labels, corpus, {.gaze = true, .head = true});
  EXPECT_TRUE(made.upper_face.empty());
  ASSERT_EQ(made.head.size(), made.gaze.size());
  const std::size_t last = made.head.size() - 1;
  for (const std::size_t end : {std::size_t{0}, last}) {
    EXPECT_NEAR(made.head[end].pitch, 0, 1e-3);
    EXPECT_NEAR(made.gaze[end].yaw, 0, 1e-3);
  }
  float widest = 0, lowest = 0;
  std::size_t at_listener = 0, shifts = 0;
  for (std::size_t k = 0; k <= last; ++k) {
    widest = std::max(widest, std::abs(made.head[k].yaw));
    lowest = std::min(lowest, made.head[k].pitch);
    const float world = made.gaze[k].yaw + made.head[k].yaw;
    at_listener += std::abs(world) < 0.03F ? 1U : 0U;
    EXPECT_LT(std::abs(world), 0.25F);
    if (k > 0) shifts += std::abs(world - made.gaze[k - 1].yaw - made.head[k - 1].yaw) > 0.03F ? 1U : 0U;
  }
  EXPECT_GT(widest, 0.01F);
  EXPECT_LT(lowest, -0.02F) << "it nods";
  EXPECT_GT(lowest, -0.12F);
  EXPECT_GT(at_listener, last / 2) << "the listener is looked at most of the time";
  EXPECT_GT(shifts, 5U) << "and not all of it: eyes jump";
}

TEST(Moods, AreNamedScaledOrReadAndRefusedInOneLine) {
  const MoodPose joy = moodOf("joy"), half = moodOf("joy:0.5");
  for (std::size_t i = 0; i < joy.size(); ++i) EXPECT_DOUBLE_EQ(half[i], 0.5 * joy[i]);
  const auto smile = static_cast<std::size_t>(arkitIndex("MouthSmileLeft"));
  EXPECT_GT(joy[smile], 0.3);
  EXPECT_EQ(joy[smile], joy[static_cast<std::size_t>(arkitIndex("MouthSmileRight"))]);
  for (const std::string_view name : moodNames()) {
    const MoodPose pose = moodOf(std::string(name));
    EXPECT_TRUE(std::any_of(pose.begin(), pose.end(), [](double weight) { return weight > 0.2; })) << name;
  }
  const test::ScratchFolder scratch;
  const auto file = [&](const std::string& text) { return scratch.write("mood.json", text).string(); };
  EXPECT_DOUBLE_EQ(
      moodOf(file(R"({"browInnerUp": 0.5})") + ":0.5")[static_cast<std::size_t>(arkitIndex("BrowInnerUp"))], 0.25);
  EXPECT_EQ(
      errorOf([&] { moodOf("hapy"); }),
      "mood: found 'hapy'; expected anger, contempt, disgust, joy, sadness, surprise, or a file of weights (.json)");
  EXPECT_EQ(errorOf([&] { moodOf("joy:2"); }), "mood: found the strength '2'; expected 0 to 1");
  const std::string bad = file(R"({"browInnerUp": 3})");
  EXPECT_NE(errorOf([&] { moodOf(bad); }).find("browInnerUp"), std::string::npos);
  const std::string foreign = file(R"({"grin": 1})");
  EXPECT_NE(errorOf([&] { moodOf(foreign); }).find("expected one of ARKit's 52"), std::string::npos);
}

TEST(Moods, LeaveClosedLipsAndClosedLids) {
  const Corpus corpus = samples::tinyCorpus();
  SynthesisRequest request;
  request.labels = tinyLabels("M-AE-N B-AY T-AY-M", 2);
  request.options.frame_rate_hz = kRateHz;
  const PositionMatrix plain = synthesise(request, corpus).motion.positions_mm;
  request.options.expression.mood = moodOf("surprise");
  const UtteranceAnimation made = synthesise(request, corpus);
  const auto opening = [&](const PositionMatrix& rows) {
    return samples::lipOpening({kRateHz, corpus.layout.markerNames(), rows});
  };
  const std::vector<double> before = opening(plain), after = opening(made.motion.positions_mm);
  EXPECT_GT((made.motion.positions_mm - plain).cwiseAbs().maxCoeff(), 0.1) << "the mood shows";
  const double closed = *std::min_element(before.begin(), before.end());
  for (std::size_t k = 0; k < before.size(); ++k) {
    if (before[k] >= closed + 0.05) continue;
    EXPECT_NEAR(after[k], before[k], 0.1) << "frame " << k;
  }
  EXPECT_EQ(made.mouth.closures, made.mouth.bilabials);

  const Corpus blinking = blinkingCorpus();
  PositionMatrix weights = PositionMatrix::Zero(1, 52);
  for (const char* blink : {"EyeBlinkLeft", "EyeBlinkRight"}) weights(0, arkitIndex(blink)) = 1;
  const PositionMatrix shut = shapeDisplacements(weights, blinking.layout, blinking.neutral_pose_mm);
  const double left =
      kOpenMm + shut(0, heightOf(blinking.layout, "LID_UP_R")) - shut(0, heightOf(blinking.layout, "LID_LO_R"));
  EXPECT_NEAR(left, 0, 0.01) << "a blink closes the lids of this face";
}

}  // namespace
}  // namespace mouthpiece
