// What labels say before anything is compared: segments, weights of movements, the prediction, PhoneShapes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "support/random_corpus.h"
#include "support/tiny_corpus.h"
#include "support/tiny_model.h"
#include "units/prediction/phone_shapes.h"
#include "units/prediction/speech_segments.h"
#include "units/prediction/trajectory_model.h"

namespace mouthpiece {
namespace {

using samples::tinyCorpus;
using samples::tinyLabels;

std::set<std::string> featuresOf(const SpeechSegment& segment) {
  std::set<std::string> names;
  for (const SegmentFeature& feature : segment.features) names.insert(feature.name);
  return names;
}

TEST(MovementStep, RisesSoftlyFromNothingToAll) {
  constexpr Seconds kConstant = 0.02;
  EXPECT_EQ(movementStep(-1, kConstant), 0);
  EXPECT_EQ(movementStep(0, kConstant), 0);
  EXPECT_EQ(movementStep(10, kConstant), 1);
  double before = 0;
  for (Seconds time = 0.001; time < 0.8; time += 0.001) {
    const double now = movementStep(time, kConstant);
    EXPECT_GE(now, before) << "never overshoots, at " << time;
    EXPECT_LE(now, 1);
    before = now;
  }
  // Of four stages in a row: the sum of the Poisson distribution's tail.
  EXPECT_NEAR(movementStep(kConstant, kConstant), 1 - std::exp(-1.0) * (1 + 1 + 0.5 + 1.0 / 6), 1e-12);
  EXPECT_LT(movementStep(1e-4, kConstant), 1e-8) << "three derivatives are 0 at the start";
}

TEST(SpeechSegments, FollowEachOtherFromEndToEnd) {
  samples::Chance chance(11);
  for (int round = 0; round < 50; ++round) {
    const SpeechLabels labels = tinyLabels(samples::randomWords(chance), 1 + chance.below(1000));
    const std::vector<SpeechSegment> segments = speechSegments(labels);
    ASSERT_FALSE(segments.empty());
    EXPECT_EQ(segments.front().span.start, 0);
    EXPECT_NEAR(segments.back().span.end, labels.duration(), 1e-12);
    for (std::size_t i = 0; i + 1 < segments.size(); ++i) {
      EXPECT_NEAR(segments[i].span.end, segments[i + 1].span.start, 1e-12);
      EXPECT_GT(segments[i].span.duration(), 0);
    }
  }
}

TEST(SpeechSegments, ADiphthongIsTwoShapesAndOthersAreOne) {
  const auto speech = [](const char* words) {
    std::vector<SpeechSegment> segments = speechSegments(tinyLabels(words, 0));
    std::erase_if(segments, [](const SpeechSegment& segment) { return !segment.in_speech; });
    return segments;
  };
  EXPECT_EQ(speech("T-AE-T").size(), 3U);
  const auto segments = speech("T-AY-T");
  ASSERT_EQ(segments.size(), 4U);
  EXPECT_TRUE(featuresOf(segments[1]).contains("phone AY 1"));
  EXPECT_TRUE(featuresOf(segments[2]).contains("phone AY 2"));
  EXPECT_TRUE(featuresOf(segments[1]).contains("viseme Ah"));
  EXPECT_TRUE(featuresOf(segments[2]).contains("viseme Ee") || featuresOf(segments[2]).contains("viseme Ih"));
}

TEST(SpeechSegments, ClosuresAreFastSilencesSlowAndBurstsBelongToWhatFollows) {
  const std::vector<SpeechSegment> segments = speechSegments(tinyLabels("AE-P-AE-M-AE", 0));
  const auto of = [&](Phone phone) {
    return *std::find_if(segments.begin(), segments.end(),
                         [&](const SpeechSegment& segment) { return segment.in_speech && segment.phone == phone; });
  };
  EXPECT_EQ(of(Phone::kP).pace, SegmentPace::kClosure);
  EXPECT_EQ(of(Phone::kAE).pace, SegmentPace::kSpeech);
  EXPECT_EQ(segments.front().pace, SegmentPace::kSilence);
  EXPECT_NEAR(of(Phone::kP).span.duration(), 0.1 - 0.02, 1e-9) << "its burst is the vowel's";
  EXPECT_NEAR(of(Phone::kM).span.duration(), 0.1, 1e-9) << "M has none";
}

TEST(SpeechSegments, FeaturesNameTheNeighboursUpToTwoAway) {
  const std::vector<SpeechSegment> segments = speechSegments(tinyLabels("T-AE-M", 0));
  const auto vowel = std::find_if(segments.begin(), segments.end(),
                                  [](const SpeechSegment& segment) { return segment.phone == Phone::kAE; });
  ASSERT_NE(vowel, segments.end());
  const std::set<std::string> names = featuresOf(*vowel);
  for (const char* name : {"phone AE", "viseme Eh", "left Eh LNTD", "right Eh MBP"}) {
    EXPECT_TRUE(names.contains(name)) << name;
  }
  EXPECT_EQ(names.size(), 6U);
}

/// Silence, M, a pause of that length, N, silence; both ends 0.6 s.
SpeechLabels withPause(Seconds pause) {
  SpeechLabels labels;
  Seconds time = 0;
  for (const auto& [phone, length] :
       {std::pair(Phone::kSil, 0.6), std::pair(Phone::kM, 0.1), std::pair(Phone::kSil, pause),
        std::pair(Phone::kN, 0.1), std::pair(Phone::kSil, 0.6)}) {
    labels.phones.push_back({phone, {time, time + length}, {}, {}});
    time += length;
  }
  return labels;
}

std::vector<SpeechSegment> partsOfPause(Seconds pause, const SilenceTiming& timing = {}) {
  std::vector<SpeechSegment> parts = speechSegments(withPause(pause), timing);
  std::erase_if(parts, [](const SpeechSegment& part) { return part.label != 2; });
  return parts;
}

TEST(SpeechSegments, HHHasTheMouthOfWhatFollowsIt) {
  const auto ofHH = [](const char* words) {
    for (const SpeechSegment& segment : speechSegments(tinyLabels(words, 0))) {
      if (segment.phone == Phone::kHH) return featuresOf(segment);
    }
    return std::set<std::string>{};
  };
  EXPECT_TRUE(ofHH("HH-IY").contains("viseme Ee"));
  EXPECT_TRUE(ofHH("HH-UW-T").contains("viseme Oo"));
  EXPECT_TRUE(ofHH("AE-HH").contains("viseme Uh")) << "before silence none in particular";
  EXPECT_TRUE(ofHH("T-HH-AA").contains("viseme Ah"));
}

TEST(SpeechSegments, ErIsHalfRAndHalfUh) {
  for (const SpeechSegment& segment : speechSegments(tinyLabels("T-ER-M", 0))) {
    if (segment.phone != Phone::kER) continue;
    std::map<std::string, double> weights;
    for (const SegmentFeature& feature : segment.features) weights[feature.name] += feature.weight;
    EXPECT_EQ(weights["phone ER"], 1);
    for (const char* name : {"viseme R", "viseme Uh", "left R LNTD", "right Uh MBP"})
      EXPECT_EQ(weights[name], 0.5) << name;
    return;
  }
  ADD_FAILURE() << "there is no ER";
}

/// Where a tenth of a second is left for it the face rests.
TEST(SpeechSegments, SilencesHaveARestWhereThereIsTime) {
  const auto parts = [](Seconds first, Seconds last) {
    SpeechLabels labels = tinyLabels("M-AE", 0);
    for (LabelledPhone& phone : labels.phones)
      phone.span = {phone.span.start + first - 0.2, phone.span.end + first - 0.2};
    labels.phones.front().span.start = 0;
    labels.phones.back().span.end = labels.phones.back().span.start + last;
    std::pair<std::size_t, std::size_t> counted{0, 0};
    for (const SpeechSegment& segment : speechSegments(labels)) {
      if (segment.in_speech) continue;
      ++(segment.label == 0 ? counted.first : counted.second);
    }
    return counted;
  };
  EXPECT_EQ(parts(0.44, 0.34), (std::pair<std::size_t, std::size_t>{1, 1}));
  EXPECT_EQ(parts(0.46, 0.36), (std::pair<std::size_t, std::size_t>{2, 2}));
}

TEST(SpeechSegments, AfterSpeechTheLipsSettleForAQuarterOfASecond) {
  SpeechLabels labels = tinyLabels("M-AE", 0);
  labels.phones.back().span.end += 1;
  const std::vector<SpeechSegment> segments = speechSegments(labels);
  const SpeechSegment &settling = segments[segments.size() - 2], &rest = segments.back();
  EXPECT_TRUE(featuresOf(settling).contains("silence after"));
  EXPECT_NEAR(settling.span.duration(), 0.25, 1e-12);
  EXPECT_TRUE(rest.features.empty());
  EXPECT_EQ(rest.span.end, labels.duration());
  for (const SpeechSegment& segment : segments) EXPECT_FALSE(segment.is_second_half);
  std::size_t second_halves = 0;
  for (const SpeechSegment& segment : speechSegments(tinyLabels("AY-OW-M", 0))) {
    second_halves += segment.is_second_half ? 1U : 0U;
    if (segment.is_second_half) {
      EXPECT_NEAR(segment.span.duration(), 0.055, 1e-9) << "0.55 of a diphthong";
    }
  }
  EXPECT_EQ(second_halves, 2U);
}

/// In a pause people do as after a line and before one: the lips settle, rest, and open to breathe.
TEST(SpeechSegments, PausesSettleRestAndOpenAgain) {
  const std::vector<SpeechSegment> all = speechSegments(withPause(1.0)), pause = partsOfPause(1.0);
  ASSERT_EQ(pause.size(), 3U);
  EXPECT_TRUE(featuresOf(pause[0]).contains("silence after"));
  EXPECT_TRUE(featuresOf(pause[0]).contains("silence pause after")) << "and what is a pause's own";
  EXPECT_TRUE(featuresOf(pause[0]).contains("silence after left MBP")) << "as at the line's end";
  EXPECT_TRUE(pause[1].features.empty()) << "rest";
  EXPECT_TRUE(featuresOf(pause[2]).contains("silence before right LNTD"));
  EXPECT_TRUE(pause[2].breath);
  EXPECT_NEAR(pause[2].span.duration(), 0.35, 1e-9);
  EXPECT_FALSE(featuresOf(all.front()).contains("silence pause before"));
  EXPECT_EQ(partsOfPause(0.3).size(), 2U) << "no time to rest";
  for (const Seconds short_one : {0.02, 0.1, 0.3}) {
    EXPECT_LE(partsOfPause(short_one).back().span.duration(), 0.6 * short_one + 0.1 + 1e-9) << short_one;
  }
  SilenceTiming of_old_files;
  of_old_files.pauses_settle = false;
  const std::vector<SpeechSegment> old = partsOfPause(1.0, of_old_files);
  ASSERT_EQ(old.size(), 1U) << "as the models of older files know pauses";
  EXPECT_TRUE(featuresOf(old[0]).contains("viseme Uh"));
  EXPECT_EQ(old[0].features[0].weight, 0.4) << "not half a vowel's way";
  EXPECT_TRUE(old[0].breath);
}

TEST(SpeechSegments, TheMouthOpensEarlierInALongerSilence) {
  const SilenceTiming timing{0.2, 0.5, 0.15, 0.6, true};
  EXPECT_NEAR(timing.breathIn(0.5), 0.2, 1e-12);
  EXPECT_NEAR(timing.breathIn(0.9), 0.4, 1e-12);
  EXPECT_EQ(timing.breathIn(0.05), 0.15);
  EXPECT_EQ(timing.breathIn(9), 0.6);
  const std::vector<SpeechSegment> segments = speechSegments(withPause(0.1), timing);
  EXPECT_TRUE(segments[0].features.empty());
  EXPECT_NEAR(segments[1].span.duration(), 0.25, 1e-12) << "of 0.6 s";
}

TEST(SegmentWeights, SumToOneAtEveryTime) {
  samples::Chance chance(5);
  for (int round = 0; round < 20; ++round) {
    const auto segments = speechSegments(tinyLabels(samples::randomWords(chance), 1 + chance.below(1000)));
    const Seconds constant = chance.between(0.005, 0.03), lead = chance.between(-0.02, 0.04);
    const Eigen::MatrixXd weights = segmentWeights(segments, constant, lead, 50, 80);
    EXPECT_LT((weights.rowwise().sum().array() - 1).abs().maxCoeff(), 1e-12);
    EXPECT_GT(weights(0, 0), 0.99) << "it begins in the first";
    const std::vector<Seconds> times{0.3, 0.1};
    EXPECT_TRUE(segmentWeights(segments, constant, lead, times).row(0).isApprox(weights.row(15)));
  }
}

TEST(SegmentResponse, IsTheWeightsTimesTheTargets) {
  samples::Chance chance(6);
  for (int round = 0; round < 50; ++round) {
    const auto segments = speechSegments(tinyLabels(samples::randomWords(chance), 1 + chance.below(1000)));
    const Seconds constant = chance.between(0.002, 0.05), lead = chance.between(-0.02, 0.04);
    const Eigen::MatrixXd targets = Eigen::MatrixXd::Random(static_cast<Eigen::Index>(segments.size()), 3);
    std::vector<Seconds> times{-1, 0, 100};
    for (int i = 0; i < 40; ++i) times.push_back(chance.between(-0.1, 3));
    const Eigen::MatrixXd expected = segmentWeights(segments, constant, lead, times) * targets;
    EXPECT_LT((segmentResponse(segments, constant, lead, times, targets) - expected).cwiseAbs().maxCoeff(), 1e-12);
  }
}

TEST(LinePrediction, IsTheSameWhetherItKeepsAnythingOrNot) {
  TrajectoryModel model = *samples::tinyModel(tinyCorpus());
  constexpr Eigen::Index kHidden = 5;
  const Eigen::Index components = model.componentCount();
  const auto features = static_cast<Eigen::Index>(contextFeatureNames().size());
  model.networks.push_back({ContextNetwork::Matrix::Random(features, kContextWindows * kHidden),
                            Eigen::RowVectorXf::Random(kHidden), ContextNetwork::Matrix::Random(kHidden, components)});
  model.network_share = Eigen::RowVectorXd::Constant(components, 0.7);
  samples::Chance chance(11);
  for (int round = 0; round < 30; ++round) {
    const SpeechLabels labels = tinyLabels(samples::randomWords(chance), 1 + chance.below(1000));
    const Seconds start = chance.between(-0.2, 1), end = start + chance.between(0, 0.4);
    const std::vector<Seconds> times{start, 0.5 * (start + end), end};
    EXPECT_EQ(LinePrediction(model, labels, LinePrediction::Keeps::kNothing).at(times),
              LinePrediction(model, labels).at(times))
        << round;
  }
}

TEST(LinePrediction, IsTheSumOfItsSegmentsTargets) {
  const Corpus corpus = tinyCorpus();
  const auto model = samples::tinyModel(corpus);
  samples::Chance chance(7);
  for (int round = 0; round < 20; ++round) {
    const SpeechLabels labels = tinyLabels(samples::randomWords(chance), 1 + chance.below(1000));
    const std::vector<Seconds> times{0.15, 0.31, 0.55};
    const auto segments = predictionSegments(labels);
    Eigen::MatrixXd expected = model->level.replicate(3, 1);
    for (Eigen::Index component = 0; component < 2; ++component) {
      const auto& [constant, lead] = model->dynamics[static_cast<std::size_t>(component)];
      const Eigen::MatrixXd weights = segmentWeights(segments, constant, lead, times);
      for (std::size_t i = 0; i < segments.size(); ++i) {
        for (const SegmentFeature& feature : segments[i].features) {
          const auto target = model->targets.find(feature.name);
          if (target == model->targets.end()) continue;
          expected.col(component) +=
              feature.weight * target->second(component) * weights.col(static_cast<Eigen::Index>(i));
        }
      }
    }
    EXPECT_TRUE(model->predict(labels, times).isApprox(expected, 1e-9));
  }
}

/// PhoneShapes of a take that moves as predicted are the prediction; each is looked at where the page says.
TEST(PhoneShapes, OfTheOwnPredictionAreThePrediction) {
  const Corpus corpus = tinyCorpus();
  const auto model = samples::tinyModel(corpus);
  const SpeechLabels labels = tinyLabels("M-AE-N IY-T", 3);
  MotionClip motion = corpus.takes[0].motion;
  motion.frame_rate_hz = 1000;
  const auto frames = static_cast<Eigen::Index>(labels.duration() * 1000) + 2;
  std::vector<Seconds> times;
  for (Eigen::Index frame = 0; frame < frames; ++frame) times.push_back(static_cast<double>(frame) / 1000);
  const Eigen::Map<const Eigen::RowVectorXd> neutral(corpus.neutral_pose_mm.data(), corpus.neutral_pose_mm.size());
  motion.positions_mm = (model->predict(labels, times) * model->shapes).rowwise() + neutral;
  const PhoneShapes shapes = phoneShapes(*model, labels, motion, corpus.neutral_pose_mm, LipGauge(corpus.layout));
  ASSERT_EQ(shapes.phoneCount(), labels.phones.size());
  ASSERT_EQ(shapes.componentCount(), 2);
  EXPECT_LT((shapes.captured - shapes.predicted).cwiseAbs().maxCoeff(), 0.01F);
  EXPECT_EQ(shapes.predicted, predictedShapes(*model, labels));
  // The least opening in a phone and 20 ms around it, by looking at every frame.
  for (std::size_t i = 0; i < labels.phones.size(); ++i) {
    double least = std::numeric_limits<double>::infinity();
    for (Eigen::Index frame = 0; frame < frames; ++frame) {
      const Seconds time = times[static_cast<std::size_t>(frame)];
      if (time < labels.phones[i].span.start - 0.021 || time > labels.phones[i].span.end + 0.021) continue;
      const auto row = motion.positions_mm.row(frame);
      least = std::min(least, (row.segment<3>(0) - row.segment<3>(3)).norm());
    }
    EXPECT_NEAR(shapes.tightest_mm[i], least, 0.05) << i;
  }
}

TEST(PhoneShapes, LookAtSilencesWhereTheyMeetSpeech) {
  SpeechLabels labels = tinyLabels("T", 0);
  for (LabelledPhone& phone : labels.phones) {  // a second of silence before
    if (phone.phone != Phone::kSil || phone.span.start > 0) phone.span.start += 1;
    phone.span.end += 1;
  }
  labels.phones.back().span.end += 1;
  const std::vector<Seconds> times = shapeTimes(labels);
  ASSERT_EQ(times.size(), 3U * static_cast<std::size_t>(PhoneShapes::kPoints));
  EXPECT_TRUE(std::is_sorted(times.begin(), times.end()));
  EXPECT_NEAR(times[0], labels.phones[0].span.end - 0.27, 1e-9) << "10 % into its last 300 ms";
  EXPECT_NEAR(times[14], labels.phones[2].span.start + 0.27, 1e-9);
  EXPECT_NEAR(times[7], labels.phones[1].span.middle(), 1e-9);
}

TEST(PhoneShapes, WhatWasNotSeenIsNaNUnlessNoComponentLooksAtIt) {
  Corpus corpus = tinyCorpus();
  const auto model = samples::tinyModel(corpus);
  MotionClip motion = corpus.takes[0].motion;
  motion.positions_mm.rightCols(3).setConstant(std::nan(""));  // the brow
  const SpeechLabels& labels = corpus.takes[0].labels;
  const PhoneShapes brow_missing = phoneShapes(*model, labels, motion, corpus.neutral_pose_mm, LipGauge(corpus.layout));
  EXPECT_TRUE(brow_missing.captured.allFinite());
  motion.positions_mm.col(7).setConstant(std::nan(""));  // the chin
  const PhoneShapes chin_missing = phoneShapes(*model, labels, motion, corpus.neutral_pose_mm, LipGauge(corpus.layout));
  EXPECT_TRUE(chin_missing.captured.array().isNaN().all()) << "a pose without its chin has no components";
  EXPECT_TRUE(chin_missing.predicted.allFinite());
}

}  // namespace
}  // namespace mouthpiece
