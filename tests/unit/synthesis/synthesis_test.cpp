#include "synthesis/synthesis.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "base/errors.h"
#include "base/index.h"
#include "support/tiny_corpus.h"
#include "synthesis/fragment.h"
#include "synthesis/join.h"

namespace mouthpiece {
namespace {

using samples::lipOpening;
using samples::tinyCorpus;
using samples::tinyLabels;

SynthesisRequest requestFor(const SpeechLabels& labels, double frame_rate_hz = 60) {
  SynthesisRequest request;
  request.text = "text";
  request.voice = "voice";
  request.labels = labels;
  request.options.frame_rate_hz = frame_rate_hz;
  return request;
}

/// Least opening of the lips within the phone and 30 ms around it.
double tightest(const MotionClip& motion, const TimeSpan& span) {
  const std::vector<double> opening = lipOpening(motion);
  double least = 1e9;
  for (std::size_t frame = 0; frame < opening.size(); ++frame) {
    const double time = static_cast<double>(frame) / motion.frame_rate_hz;
    if (time >= span.start - 0.03 && time <= span.end + 0.03) least = std::min(least, opening[frame]);
  }
  return least;
}

TEST(Synthesis, ATakeOfTheCorpusComesBack) {
  const Corpus corpus = tinyCorpus();
  for (const CorpusTake& take : corpus.takes) {
    const UtteranceAnimation animation = synthesise(requestFor(take.labels, 120), corpus);
    ASSERT_EQ(animation.units.size(), 1U);
    EXPECT_EQ(animation.units[0].take, take.name);
    EXPECT_EQ(animation.units[0].scale, "sentence");
    EXPECT_TRUE(animation.joins.empty());
    const auto frames = animation.motion.positions_mm.rows();
    constexpr double kToleranceMm = 0.01;
    EXPECT_LT((animation.motion.positions_mm - take.motion.positions_mm.topRows(frames)).cwiseAbs().maxCoeff(),
              kToleranceMm)
        << take.text;
  }
}

TEST(Synthesis, FillsEveryFieldForEveryFrame) {
  const Corpus corpus = tinyCorpus();
  SynthesisRequest request = requestFor(tinyLabels("T-AY-M IH-Z T-EH-N", 42), 30);
  request.audio = {8000, std::vector<float>(8000 * 5, 0.5F)};
  const UtteranceAnimation animation = synthesise(request, corpus);
  EXPECT_EQ(animation.text, "text");
  EXPECT_EQ(animation.voice, "voice");
  EXPECT_EQ(animation.corpus, "tiny");
  EXPECT_EQ(animation.audio.samples.size(), request.audio.samples.size());
  EXPECT_EQ(animation.motion.frameCount(), 150U) << "as long as the sound, 5 s";
  EXPECT_EQ(animation.motion.frame_rate_hz, 30);
  EXPECT_EQ(animation.motion.marker_names, corpus.layout.markerNames());
  EXPECT_EQ(animation.tongue.size(), 150U);
  EXPECT_TRUE(animation.motion.positions_mm.allFinite());
  ASSERT_GE(animation.units.size(), 2U);
  EXPECT_EQ(animation.joins.size(), animation.units.size() - 1);
  EXPECT_GT(animation.timing_ms.motion, 0);
  for (const PlacedUnit& unit : animation.units) {
    EXPECT_EQ(unit.span, animation.labels.spanOf(unit.phones));
    EXPECT_GT(unit.source_span.duration(), 0);
  }
  for (std::size_t i = 0; i < animation.joins.size(); ++i) {
    const TimeSpan shared = animation.labels.phones[animation.units[i].phones.last.value].span;
    EXPECT_TRUE(shared.contains(animation.joins[i].time)) << "the blend lies in the shared phone";
  }
}

TEST(Synthesis, MotionOnDemandMakesTheSameLine) {
  class FromMemory : public TakeSource {
   public:
    explicit FromMemory(const Corpus& corpus) : corpus_(corpus) {}
    [[nodiscard]] MotionClip load(TakeIndex take) const override { return corpus_.takes[take.value].motion; }
    [[nodiscard]] AudioClip loadAudio(TakeIndex take) const override { return corpus_.takes[take.value].audio; }

   private:
    Corpus corpus_;
  };
  const Corpus corpus = tinyCorpus();
  Corpus on_demand = corpus;
  on_demand.take_source = std::make_shared<FromMemory>(corpus);
  for (CorpusTake& take : on_demand.takes) take.motion.positions_mm.resize(0, 0);
  const SynthesisRequest request = requestFor(tinyLabels("T-AY-M IH-Z T-EH-N", 42));
  EXPECT_EQ(synthesise(request, on_demand).motion.positions_mm, synthesise(request, corpus).motion.positions_mm);
}

/// A take's motion is loaded for its poses alone, and joins look at the takes so that of those in memory few are loaded
/// again: here one take fits beside another's.
TEST(Synthesis, ALineLoadsATakeFewTimes) {
  class Counting : public TakeSource {
   public:
    explicit Counting(const Corpus& corpus) : corpus_(corpus) {}
    [[nodiscard]] MotionClip load(TakeIndex take) const override {
      ++loads;
      return corpus_.takes[take.value].motion;
    }
    [[nodiscard]] std::optional<std::vector<bool>> loadUnseen(TakeIndex take) const override {
      return std::vector<bool>(corpus_.takes[take.value].motion.frameCount(), false);
    }
    [[nodiscard]] AudioClip loadAudio(TakeIndex /*take*/) const override { return {}; }
    mutable int loads = 0;

   private:
    Corpus corpus_;
  };
  Corpus corpus = tinyCorpus();
  const SpeechLabels line = corpus.takes[0].labels;
  const Eigen::Index large = 2'500'000 / corpus.takes[0].motion.positions_mm.cols();  // rows of 20 of the 32 MB kept
  for (CorpusTake& take : corpus.takes)
    take.motion.positions_mm.conservativeResizeLike(PositionMatrix::Zero(large, take.motion.positions_mm.cols()));
  Corpus on_demand = corpus;
  const auto source = std::make_shared<Counting>(corpus);
  on_demand.take_source = source;
  const UnitDatabase database(on_demand);
  std::vector<UnitFragment> fragments;
  for (std::size_t take = 0; take < 3; ++take) {
    fragments.push_back(
        {Fragment(line, {PhoneIndex(take), PhoneIndex(take + 1)}, database, {TakeIndex(take), PhoneIndex(take)}),
         take});
  }
  EXPECT_EQ(source->loads, 0);
  std::vector<JoinSpans> joins;
  for (std::size_t i = 0; i + 1 < fragments.size(); ++i) {
    const TimeSpan span = line.phones[i + 1].span;
    joins.push_back({span, span});
    (void)fragments[i].fragment.lipsAt(span.middle());
    (void)fragments[i + 1].fragment.lipsAt(span.middle());
  }
  EXPECT_EQ(source->loads, 3);
  EXPECT_EQ(findJoinOffsets(line, fragments, joins).size(), 2U);
  EXPECT_EQ(source->loads, 5) << "of four looks at takes the first finds it in memory, and the third";
}

/// All phones last 100 ms here, so nothing is sped up by warping and a join alone could make a jump.
/// Where fragments that move the mouth are joined lids would bring halves of blinks; as EDGE was published they do.
TEST(Synthesis, LidsRestInALineOfFragments) {
  Corpus corpus = tinyCorpus();
  corpus.layout.markers.back().region = "lid";
  const Eigen::Index lid = signedIndex(3 * corpus.layout.markers.size()) - 2;
  for (CorpusTake& take : corpus.takes) {
    for (Eigen::Index frame = 0; frame < take.motion.positions_mm.rows(); ++frame)
      take.motion.positions_mm(frame, lid) += 3 * std::sin(0.2 * asReal(frame));
  }
  const auto travel = [&](const SpeechLabels& labels, const SynthesisOptions& options) {
    SynthesisRequest request = requestFor(labels, 120);
    request.options = options;
    const MotionClip motion = synthesise(request, corpus).motion;
    return (motion.positions_mm.col(lid).array() - corpus.neutral_pose_mm.data()[lid]).abs().maxCoeff();
  };
  const SpeechLabels joined = tinyLabels("T-AY-M IH-Z", 42);
  EXPECT_EQ(travel(joined, {}), 0);
  EXPECT_GT(travel(joined, edgeAsPublished()), 1);
  EXPECT_GT(travel(corpus.takes[0].labels, {}), 1) << "a take that comes back whole keeps its blinks";
}

TEST(Synthesis, JoinsMoveNoFasterThanTheCaptureDoes) {
  Corpus corpus = tinyCorpus();
  for (CorpusTake& take : corpus.takes) take = samples::tinyTake(take.name, take.text, 0);
  const FrameChange fastest = frameChangePercentile(corpus, 60, 100);
  std::size_t joins = 0;
  for (const char* words :
       {"T-AY-M IH-Z T-EH-N", "M-AE-N IH-Z N-AW", "DH-AH M-AE-N AE-T N-UW-N", "N-UW-N | DH-AH M-AE-P"}) {
    const UtteranceAnimation animation = synthesise(requestFor(tinyLabels(words, 0)), corpus);
    joins += animation.joins.size();
    for (const Join& join : animation.joins) {
      // A blend of two movements that were each captured may be a little faster than either, and turns sooner.
      EXPECT_LE(join.position_jump_mm, 1.2 * fastest.step_mm) << words;
      EXPECT_LE(join.velocity_jump_mm_s, 2 * fastest.velocity_change_mm_s) << words;
    }
  }
  EXPECT_GE(joins, 8U);
}

/// Without a blend the same joins jump: the test above can fail.
TEST(Synthesis, WithoutABlendJoinsJump) {
  Corpus corpus = tinyCorpus();
  for (CorpusTake& take : corpus.takes) take = samples::tinyTake(take.name, take.text, 0);
  for (CorpusTake& take : corpus.takes) take.motion.positions_mm.array() += take.name == "take0" ? 10 : 0;
  const FrameChange fastest = frameChangePercentile(corpus, 60, 100);
  SynthesisRequest request = requestFor(tinyLabels("DH-AH M-AE-N AE-T N-UW-N", 0));
  const auto worst = [&](double overlap_ms) {
    request.options.overlap_ms = overlap_ms;
    double largest = 0;
    for (const Join& join : synthesise(request, corpus).joins) largest = std::max(largest, join.position_jump_mm);
    return largest;
  };
  EXPECT_GT(worst(0), fastest.step_mm);
  EXPECT_LT(worst(60), 0.5 * worst(0));
}

TEST(Synthesis, LipsThatCloseInTheCaptureCloseInTheResult) {
  const Corpus corpus = tinyCorpus();
  for (const char* words : {"M-AE-N AE-T T-AY-M", "AH-P T-AY-M M-AE-N", "M-EH-N IH-T M-UW-N", "T-AY-M AH-P AE-M"}) {
    for (std::uint64_t seed = 200; seed < 210; ++seed) {
      const UtteranceAnimation animation = synthesise(requestFor(tinyLabels(words, seed)), corpus);
      for (const LabelledPhone& phone : animation.labels.phones) {
        if (!isBilabial(phone.phone)) continue;
        EXPECT_LT(tightest(animation.motion, phone.span), 1.5) << words << " seed " << seed;
      }
    }
  }
}

TEST(Synthesis, SilenceIsNotStretchedButRelaxes) {
  const Corpus corpus = tinyCorpus();
  const CorpusTake& take = corpus.takes[0];
  SpeechLabels labels = take.labels;
  constexpr double kLonger = 2.8;  // the silence of 0.2 s becomes 3 s
  labels.phones.front().span.end += kLonger;
  for (std::size_t i = 1; i < labels.phones.size(); ++i) {
    labels.phones[i].span.start += kLonger;
    labels.phones[i].span.end += kLonger;
  }
  labels.phones.back().span.end += kLonger;
  const UtteranceAnimation animation = synthesise(requestFor(labels, 120), corpus);
  const auto shift = static_cast<Eigen::Index>(std::lround(kLonger * 120));
  const auto captured = take.motion.positions_mm.rows() - 2;
  EXPECT_LT((animation.motion.positions_mm.middleRows(shift, captured) - take.motion.positions_mm.topRows(captured))
                .cwiseAbs()
                .maxCoeff(),
            0.01)
      << "beside the speech, the capture's own speed";
  const Eigen::Map<const Eigen::RowVectorXd> neutral(corpus.neutral_pose_mm.data(), corpus.neutral_pose_mm.size());
  EXPECT_LT((animation.motion.positions_mm.row(0) - neutral).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_LT((animation.motion.positions_mm.bottomRows(1) - neutral).cwiseAbs().maxCoeff(), 1e-6);
  const double largest_step = (animation.motion.positions_mm.bottomRows(animation.motion.positions_mm.rows() - 1) -
                               animation.motion.positions_mm.topRows(animation.motion.positions_mm.rows() - 1))
                                  .cwiseAbs()
                                  .maxCoeff();
  const double captured_step =
      (take.motion.positions_mm.bottomRows(captured - 1) - take.motion.positions_mm.topRows(captured - 1))
          .cwiseAbs()
          .maxCoeff();
  EXPECT_LE(largest_step, 1.05 * captured_step);
}

TEST(Synthesis, AMuchShorterSilenceIsCutNotSqueezed) {
  const Corpus corpus = tinyCorpus({"T-AY-M | N-AW"});
  const CorpusTake& take = corpus.takes[0];
  SpeechLabels labels = take.labels;
  const Seconds cut = 0.15;
  for (std::size_t i = 4; i < labels.phones.size(); ++i) {
    if (i > 4) labels.phones[i].span.start -= cut;
    labels.phones[i].span.end -= cut;
  }
  ASSERT_EQ(labels.phones[4].phone, Phone::kSil);
  const UtteranceAnimation animation = synthesise(requestFor(labels, 120), corpus);
  EXPECT_EQ(animation.units.size(), 1U);
  const auto before = static_cast<Eigen::Index>(labels.phones[4].span.start * 120);
  EXPECT_LT(
      (animation.motion.positions_mm.topRows(before) - take.motion.positions_mm.topRows(before)).cwiseAbs().maxCoeff(),
      0.01);
}

TEST(Synthesis, WorksAtEveryRateAndFromSlowCapture) {
  const Corpus slow = tinyCorpus({"DH-AH T-AY-M IH-Z N-AW", "IH-T IH-Z T-EH-N", "T-EH-N M-EH-N | AH-P N-AW"}, 25);
  const SpeechLabels labels = tinyLabels("T-AY-M IH-Z T-EH-N", 5);
  for (const double rate : {24.0, 25.0, 60.0, 240.0}) {
    const UtteranceAnimation animation = synthesise(requestFor(labels, rate), slow);
    EXPECT_TRUE(animation.motion.positions_mm.allFinite()) << rate;
    EXPECT_NEAR(animation.motion.duration(), labels.duration(), 1 / rate) << rate;
  }
}

TEST(Synthesis, NothingUnseenReachesTheResult) {
  Corpus corpus = tinyCorpus({"T-AY-M IH-Z N-AW", "IH-T IH-Z T-EH-N"});
  // Unseen right after the phone that is shared: the blend's context must not let it in.
  const TimeSpan next = corpus.takes[0].labels.phones[6].span;
  corpus.takes[0]
      .motion.positions_mm.middleRows(static_cast<Eigen::Index>(next.start * 120) + 3, 4)
      .setConstant(std::numeric_limits<double>::quiet_NaN());
  const UtteranceAnimation animation = synthesise(requestFor(tinyLabels("T-AY-M IH-Z T-EH-N", 5)), corpus);
  EXPECT_TRUE(animation.motion.positions_mm.allFinite());
}

TEST(Synthesis, PhonesOfNextToNoTimeMakeNoFolds) {
  const Corpus corpus = tinyCorpus();
  SpeechLabels labels = corpus.takes[0].labels;
  labels.phones[3].span.end = labels.phones[3].span.start + 1e-12;
  labels.phones[4].span.start = labels.phones[3].span.end;
  const UtteranceAnimation animation = synthesise(requestFor(labels), corpus);
  EXPECT_TRUE(animation.motion.positions_mm.allFinite());
  EXPECT_LT(animation.motion.positions_mm.cwiseAbs().maxCoeff(), 100) << "no overshoot";
}

TEST(Synthesis, APauseInsideAUnitLeavesNoTrace) {
  const Corpus corpus = tinyCorpus({"T-EH-N M-EH-N | AH-P N-AW", "T-EH-N M-EH-N | AH-P N-AW"});
  const UtteranceAnimation animation = synthesise(requestFor(corpus.takes[1].labels, 120), corpus);
  ASSERT_EQ(animation.units.size(), 1U);
  const auto frames = animation.motion.positions_mm.rows();
  EXPECT_LT((animation.motion.positions_mm - corpus.takes[1].motion.positions_mm.topRows(frames)).cwiseAbs().maxCoeff(),
            0.01)
      << "a pause inside a unit is not seen, in the brows either";
}

TEST(Synthesis, SilenceAloneRests) {
  const Corpus corpus = tinyCorpus();
  SpeechLabels labels;
  labels.phones.push_back({Phone::kSil, {0, 1}, std::nullopt, std::nullopt});
  const UtteranceAnimation animation = synthesise(requestFor(labels), corpus);
  EXPECT_EQ(animation.motion.frameCount(), 60U);
  EXPECT_TRUE(animation.units.empty());
  EXPECT_TRUE(animation.motion.positions_mm.allFinite());
}

TEST(Synthesis, RefusesWhatCannotBeMade) {
  const Corpus corpus = tinyCorpus();
  EXPECT_THROW(synthesise(requestFor(tinyLabels("T-AY-M", 1), 0), corpus), InputError);
  EXPECT_THROW(synthesise(requestFor(SpeechLabels{}), corpus), InputError);
  Corpus empty = corpus;
  empty.takes.clear();
  EXPECT_THROW(synthesise(requestFor(tinyLabels("T-AY-M", 1)), empty), InputError);
}

TEST(Tongue, MakesContactWhereThePhonesAskForIt) {
  const Corpus corpus = tinyCorpus({"N-AW", "T-AY-K", "DH-AH"});
  const SpeechLabels labels = tinyLabels("DH-AH", 3);
  const UtteranceAnimation animation = synthesise(requestFor(labels, 240), corpus);
  const auto frameAt = [&](double time) { return static_cast<std::size_t>(time * 240); };
  EXPECT_FLOAT_EQ(animation.tongue[frameAt(labels.phones[1].span.middle())].tip_forward, 1.0F);
  EXPECT_EQ(animation.tongue[0].tip_forward, 0.0F);
  EXPECT_EQ(animation.tongue.back().tip_forward, 0.0F);
  for (std::size_t i = 1; i < animation.tongue.size(); ++i) {
    EXPECT_LT(std::abs(animation.tongue[i].tip_forward - animation.tongue[i - 1].tip_forward), 0.1F)
        << "about 100 ms from rest to contact";
  }
}

}  // namespace
}  // namespace mouthpiece
