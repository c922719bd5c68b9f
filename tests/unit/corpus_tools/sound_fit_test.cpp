#include "corpus_tools/building/prediction_parts.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "base/index.h"

namespace mouthpiece {
namespace {

constexpr double kFrameRateHz = 30;
constexpr std::size_t kParts = 4;

SpeechLabels threePhones() {
  SpeechLabels labels;
  labels.phones = {{Phone::kSil, {0, 0.3}, {}, {}},
                   {Phone::kAA, {0.3, 0.7}, {}, {}},
                   {Phone::kS, {0.7, 1.1}, {}, {}},
                   {Phone::kIY, {1.1, 1.5}, {}, {}},
                   {Phone::kSil, {1.5, 1.8}, {}, {}}};
  return labels;
}

/// Noise whose level wanders by itself, `gain` times as loud.
AudioClip wanderingNoise(std::uint32_t seed, double gain = 1) {
  AudioClip clip{16000, std::vector<float>(std::size_t{28800})};
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, 1);
  const double phase = noise(random), fast = 6 + 2 * std::abs(noise(random));
  for (std::size_t i = 0; i < clip.samples.size(); ++i) {
    const double time = asReal(i) / clip.sample_rate_hz;
    const bool speaks = time > 0.3 && time < 1.5;
    const double level = std::exp(0.8 * std::sin(fast * time + phase));
    clip.samples[i] = asFloat(gain * (speaks ? 0.02 * level : 0.001) * noise(random));
  }
  return clip;
}

Corpus noisyCorpus(std::size_t takes) {
  Corpus corpus;
  for (std::size_t i = 0; i < takes; ++i) {
    CorpusTake& take = corpus.takes.emplace_back();
    take.labels = threePhones();
    take.audio = wanderingNoise(static_cast<std::uint32_t>(i));
  }
  return corpus;
}

/// Of two components the first follows the level as it departs, when `follows`; the rest is chance.
std::vector<SoundTake> takesOf(const Corpus& corpus, bool follows) {
  std::vector<SoundTake> takes;
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0, 1);
  const Eigen::MatrixXd nothing = Eigen::MatrixXd::Zero(kPhoneCount, kSoundMeasures);
  for (std::size_t i = 0; i < corpus.takes.size(); ++i) {
    SoundTake& take = takes.emplace_back();
    take.index = i;
    take.part = i % kParts;
    const SoundDeviations departs(soundMeasures(corpus.takes[i].audio), corpus.takes[i].labels, nothing);
    for (int frame = 0; frame < 54; ++frame) take.times.push_back(frame / kFrameRateHz);
    take.seen = Eigen::VectorXd::Ones(54);
    take.residual.resize(54, 2);
    for (Eigen::Index row = 0; row < 54; ++row) {
      const Eigen::Index at = std::lround(take.times[unsignedIndex(row)] / SoundMeasures::kStep);
      const double level = at < departs.rows().rows() ? departs.rows()(at, 0) : 0;
      take.residual(row, 0) = (follows ? 0.3 * level : 0) + 0.3 * noise(random);
      take.residual(row, 1) = 0.3 * noise(random);
    }
    take.residual.rowwise() -= take.residual.colwise().mean();
  }
  return takes;
}

double errorLeft(const SoundModel& model, const Corpus& corpus, const SoundTake& take, double gain = 1) {
  const HeardLine heard(model, wanderingNoise(static_cast<std::uint32_t>(take.index), gain),
                        corpus.takes[take.index].labels);
  Eigen::VectorXd made = heard.at(take.times).col(0);
  made.array() -= made.mean();
  return (take.residual.col(0) - made).norm() / take.residual.col(0).norm();
}

TEST(SoundFit, HearsWhatTheSoundTellsOnTakesItHasNotSeen) {
  const Corpus corpus = noisyCorpus(40);
  std::vector<SoundTake> takes = takesOf(corpus, true);
  const std::vector<SoundTake> known(takes.begin(), takes.begin() + 32);
  const SoundModel model = fitSound(corpus, known, kParts, 1).model;
  ASSERT_FALSE(model.isEmpty());
  for (std::size_t i = 32; i < 40; ++i) {
    EXPECT_LT(errorLeft(model, corpus, takes[i]), 0.75) << i;
    EXPECT_NEAR(errorLeft(model, corpus, takes[i], 0.3), errorLeft(model, corpus, takes[i]), 0.03)
        << "a recording is no louder or softer for it";
  }
  EXPECT_EQ(fitSound(corpus, known, kParts, 3).model.weights, model.weights) << "threads";
}

TEST(SoundFit, ChanceIsNotLearnt) {
  const Corpus corpus = noisyCorpus(32);
  const std::vector<SoundTake> takes = takesOf(corpus, false);
  const SoundModel model = fitSound(corpus, takes, kParts, 1).model;
  if (model.isEmpty()) return;
  const HeardLine heard(model, wanderingNoise(99), threePhones());
  EXPECT_LT(heard.at(takes[0].times).cwiseAbs().maxCoeff(), 0.06) << "mm, where chance is 0.3";
}

TEST(SoundFit, WithoutSoundThereIsNothing) {
  Corpus corpus = noisyCorpus(16);
  const std::vector<SoundTake> takes = takesOf(corpus, true);
  for (CorpusTake& take : corpus.takes) take.audio = {};
  EXPECT_TRUE(fitSound(corpus, takes, kParts, 1).model.isEmpty());
}

TEST(HeardLine, WhatFitsThePhonesBadlyIsNotBelieved) {
  const Corpus corpus = noisyCorpus(32);
  const SoundModel model = fitSound(corpus, takesOf(corpus, true), kParts, 1).model;
  ASSERT_FALSE(model.isEmpty());
  EXPECT_GT(HeardLine(model, wanderingNoise(77), threePhones()).believed(), 0.7);
  AudioClip other = wanderingNoise(77);  // a voice that leaps about: gated, and with tones of its own
  for (std::size_t i = 0; i < other.samples.size(); ++i) {
    const double time = asReal(i) / other.sample_rate_hz;
    other.samples[i] = asFloat(std::fmod(time, 0.4) < 0.2 ? 0.5 * std::sin(2 * M_PI * 900 * time) : 1e-4);
  }
  const HeardLine strange(model, other, threePhones());
  EXPECT_GT(strange.strangeness(), 3);
  EXPECT_EQ(strange.believed(), 0);
  const std::vector<Seconds> times{0.5, 0.9, 1.3};
  EXPECT_EQ(strange.at(times).cwiseAbs().maxCoeff(), 0);
}

}  // namespace
}  // namespace mouthpiece
