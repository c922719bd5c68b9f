#include "hearing/tags/vowel_network.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "base/byte_reader.h"
#include "base/errors.h"
#include "base/files.h"

namespace mouthpiece {

extern const std::string_view kVowelWeights;

namespace {

/// What tools/train_vowels.py --example wrote: a sound, its features in numpy, the answer of torch, and that adapted to
/// the voice in numpy.
struct Example {
  AudioClip sound{.sample_rate_hz = 16000, .samples = {}};
  VowelFeatures features;
  Eigen::MatrixXf shares;
  VowelEnvelopes envelopes;
  Eigen::MatrixXf adapted;
};

Example readExample() {
  const std::string bytes = readFile(MOUTHPIECE_SOURCE_DIR "/tests/unit/hearing/vowel_network.example");
  ByteReader reader(bytes, "vowel_network.example");
  const std::uint32_t samples = reader.readU32();
  const auto frames = static_cast<Eigen::Index>(reader.readU32());
  Example example;
  for (std::uint32_t i = 0; i < samples; ++i)
    example.sound.samples.push_back(static_cast<float>(reader.readI16()) / 32768);
  const auto fill = [&](auto& matrix, Eigen::Index columns) {
    matrix.resize(frames, columns);
    for (Eigen::Index row = 0; row < frames; ++row) {
      for (Eigen::Index column = 0; column < columns; ++column) matrix(row, column) = reader.readF32();
    }
  };
  fill(example.features, kVowelFeatureCount);
  fill(example.shares, kSungVowelCount);
  fill(example.envelopes.levels, kMelBandCount);
  example.envelopes.pitch_hz.resize(frames);
  for (double& pitch : example.envelopes.pitch_hz) pitch = reader.readF32();
  fill(example.adapted, kSungVowelCount);
  return example;
}

TEST(VowelFeatures, EqualTheTrainersOwn) {
  const Example example = readExample();
  const VowelFeatures features = vowelFeatures(example.sound);
  ASSERT_EQ(features.rows(), example.features.rows());
  // Both reckon in doubles; centroids of nearly silent bands are the least exact.
  EXPECT_LT((features - example.features).cwiseAbs().maxCoeff(), 2e-4);
  EXPECT_GT(example.features.cwiseAbs().maxCoeff(), 1);
}

TEST(VowelFeatures, DoNotDependOnGain) {
  Example example = readExample();
  const VowelFeatures before = vowelFeatures(example.sound);
  for (float& sample : example.sound.samples) sample *= 0.125F;
  EXPECT_LT((vowelFeatures(example.sound) - before).cwiseAbs().maxCoeff(), 1e-3);
}

TEST(VowelFeatures, StandSilenceAndShortSounds) {
  for (const std::size_t count : {1U, 159U, 16000U}) {
    const VowelFeatures features = vowelFeatures({.sample_rate_hz = 16000, .samples = std::vector<float>(count, 0.0F)});
    EXPECT_EQ(features.rows(), static_cast<Eigen::Index>(count / 160 + 1));
    EXPECT_TRUE(features.allFinite());
  }
}

TEST(VowelNetwork, EqualsTheTrainingFramework) {
  const Example example = readExample();
  const Eigen::MatrixXf shares = VowelNetwork::shipped().probabilities(example.features, example.envelopes);
  EXPECT_LT((shares - example.shares).cwiseAbs().maxCoeff(), 1e-4);
  EXPECT_LT((shares.rowwise().sum().array() - 1).abs().maxCoeff(), 1e-5);
  EXPECT_GT(example.shares.maxCoeff(), 0.7);  // the example is no toss-up
}

TEST(VowelEnvelopes, EqualTheTrainersOwn) {
  const Example example = readExample();
  const VowelEnvelopes envelopes = vowelEnvelopes(example.sound);
  ASSERT_EQ(envelopes.levels.rows(), example.envelopes.levels.rows());
  EXPECT_LT((envelopes.pitch_hz - example.envelopes.pitch_hz).cwiseAbs().maxCoeff(), 1e-3);
  EXPECT_LT((envelopes.levels - example.envelopes.levels).cwiseAbs().maxCoeff(), 2e-4);
  EXPECT_GT(envelopes.pitch_hz.maxCoeff(), 90);
}

/// Harmonics of equal strength under one resonance.
AudioClip hum(double pitch_hz, double seconds) {
  AudioClip clip{.sample_rate_hz = 16000, .samples = std::vector<float>(static_cast<std::size_t>(16000 * seconds))};
  for (std::size_t i = 0; i < clip.samples.size(); ++i) {
    for (double hz = pitch_hz; hz < 7500; hz += pitch_hz) {
      const double level = 0.1 / (1 + std::pow((hz - 1200) / 400, 2));
      clip.samples[i] += static_cast<float>(level * std::sin(2 * M_PI * hz * static_cast<double>(i) / 16000));
    }
  }
  return clip;
}

TEST(VowelEnvelopes, DoNotShowThePitch) {
  const AudioClip low = hum(110, 0.5), high = hum(300, 0.5);
  const VowelEnvelopes of_low = vowelEnvelopes(low), of_high = vowelEnvelopes(high);
  EXPECT_NEAR(of_low.pitch_hz(25), 110, 0.5);
  EXPECT_NEAR(of_high.pitch_hz(25), 300, 1);
  constexpr Eigen::Index kFirst = 4, kCount = 16;  // 500 to 4000 Hz: below is the first harmonic
  const auto most = [](const auto& change) { return (change.array() - change.mean()).abs().maxCoeff(); };
  const Eigen::RowVectorXd change = (of_high.levels.row(25) - of_low.levels.row(25)).segment(kFirst, kCount);
  const Eigen::RowVectorXf plain =
      (vowelFeatures(high).row(25) - vowelFeatures(low).row(25)).segment(kMfccCount + kFirst, kCount);
  EXPECT_LT(most(change), 0.8) << most(plain);
  EXPECT_GT(most(plain), 1.8 * most(change));  // what mel bands alone make of it
}

TEST(VowelAdaptation, EqualsTheTrainersOwn) {
  const Example example = readExample();
  const Eigen::MatrixXf adapted = VowelNetwork::shipped().adaptation().adapt(example.envelopes, example.shares);
  EXPECT_LT((adapted - example.adapted).cwiseAbs().maxCoeff(), 1e-4);
  EXPECT_LT((adapted.rowwise().sum().array() - 1).abs().maxCoeff(), 1e-5);
  EXPECT_GT((adapted - example.shares).cwiseAbs().maxCoeff(), 0.01);  // it does something
}

TEST(VowelAdaptation, LeavesSilenceAndUnvoicedSoundsAlone) {
  Example example = readExample();
  example.envelopes.pitch_hz.setZero();
  const VowelAdaptation& adaptation = VowelNetwork::shipped().adaptation();
  EXPECT_EQ(adaptation.adapt(example.envelopes, example.shares), example.shares);
  EXPECT_TRUE(vowelEnvelopes({.sample_rate_hz = 16000, .samples = {}}).levels.allFinite());
  const auto nothing = vowelEnvelopes({.sample_rate_hz = 16000, .samples = std::vector<float>(16000, 0.0F)});
  EXPECT_TRUE(nothing.levels.allFinite());
  EXPECT_EQ(nothing.pitch_hz.maxCoeff(), 0);
}

/// Where the perceptrons' header begins: after it come themselves and the voices.
std::size_t perceptronsAt(std::string_view weights, std::size_t count) {
  constexpr std::size_t kFirst = 128, kSecond = 64, kHeader = 20, kSizeOfPlaces = 40, kStarts = 16;
  const std::size_t halves =
      kFirst * (VowelPerceptron::kInputs + 1) + kSecond * (kFirst + 1) + kSungVowelCount * (kSecond + 1);
  const std::size_t voices = 8 + 4 * (kMelBandCount * 8 + kSizeOfPlaces * (1 + kSizeOfPlaces + kStarts));
  return weights.size() - voices - count * (8 * VowelPerceptron::kColumns + 2 * halves) - kHeader;
}

TEST(VowelPerceptron, HearsFiveFramesAndNoOther) {
  ByteReader header(kVowelWeights.substr(perceptronsAt(kVowelWeights, 8)), "w");
  ASSERT_EQ(header.readU32(), 8U);
  ASSERT_EQ(header.readU32(), static_cast<std::uint32_t>(VowelPerceptron::kInputs));
  const std::array<std::uint32_t, 2> hidden{header.readU32(), header.readU32()};
  EXPECT_NEAR(header.readF32(), 0.1, 1e-6) << "the recurrent networks' share";
  const VowelPerceptron perceptron = VowelPerceptron::read(header, hidden);
  const Example example = readExample();
  VowelFeatures columns = perceptronColumns(example.features, example.envelopes);
  const Eigen::MatrixXf before = perceptron.probabilities(columns);
  constexpr Eigen::Index kChanged = 60;
  columns.row(kChanged) = columns.row(5);
  const Eigen::MatrixXf after = perceptron.probabilities(columns);
  EXPECT_LT((after.rowwise().sum().array() - 1).abs().maxCoeff(), 1e-5);
  for (Eigen::Index row = 0; row < before.rows(); ++row) {
    const bool hears = std::any_of(VowelPerceptron::kOffsets.begin(), VowelPerceptron::kOffsets.end(),
                                   [&](int offset) { return row + offset == kChanged; });
    EXPECT_EQ(before.row(row) != after.row(row), hears) << row;
  }
}

TEST(VowelNetwork, RefusesDamagedPerceptrons) {
  const std::string good(kVowelWeights);
  const std::size_t at = perceptronsAt(good, 8);
  for (const std::size_t place : {0U, 4U, 8U, 12U, 19U}) {
    std::string bad = good;
    bad[at + place] = static_cast<char>(bad[at + place] ^ 0x55);
    EXPECT_THROW(VowelNetwork::parse(bad, "w"), InputError) << place;
  }
}

TEST(VowelNetwork, RefusesDamagedWeights) {
  const std::string good(kVowelWeights);
  EXPECT_NO_THROW(VowelNetwork::parse(good, "w"));
  EXPECT_THROW(VowelNetwork::parse("", "w"), InputError);
  EXPECT_THROW(VowelNetwork::parse(good.substr(0, good.size() - 1), "w"), InputError);
  EXPECT_THROW(VowelNetwork::parse(good + "x", "w"), InputError);
  for (const std::size_t at : {0U, 8U, 12U, 16U, 20U}) {
    std::string bad = good;
    bad[at] = static_cast<char>(bad[at] ^ 0x55);
    EXPECT_THROW(VowelNetwork::parse(bad, "w"), InputError) << at;
  }
  std::string infinite = good;
  infinite[good.size() - 1] = 0x7F;
  infinite[good.size() - 2] = static_cast<char>(0x80);
  EXPECT_THROW(VowelNetwork::parse(infinite, "w"), InputError);
}

TEST(HearVowels, TellsSilenceFromVoice) {
  const Example example = readExample();
  const auto vowels = hearVowels(example.sound);
  ASSERT_EQ(vowels.size(), static_cast<std::size_t>(example.features.rows()));
  EXPECT_GT(vowels[5].silence, 0.5);
  EXPECT_LT(vowels[100].silence, 0.5);
  EXPECT_DOUBLE_EQ(vowels[100].time, 1.0);
}

}  // namespace
}  // namespace mouthpiece
