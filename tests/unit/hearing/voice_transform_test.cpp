#include "hearing/alignment/voice_transform.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "hearing/alignment/acoustic_model.h"
#include "hearing/alignment/phone_ear.h"
#include "voices/voice.h"

namespace mouthpiece {
namespace {

constexpr Eigen::Index kSize = 3, kStreams = 3, kDensities = 8;

/// Two phones of eight densities a stream.
TiedModel madeModel(std::mt19937& random) {
  std::normal_distribution<double> normal;
  TiedModel model;
  model.stream_sizes.assign(kStreams, kSize);
  for (const char* phone : {"AA", "IY"}) {
    TiedModel::Codebook codebook{phone, {0}, {}, {}};
    for (Eigen::Index stream = 0; stream < kStreams; ++stream) {
      Eigen::MatrixXf rows(kDensities, 2 * kSize + 1);
      for (Eigen::Index i = 0; i < kDensities; ++i) {
        const Eigen::VectorXd mean = Eigen::VectorXd::NullaryExpr(kSize, [&] { return 4 * normal(random); });
        rows.row(i) = densityRow(mean, Eigen::VectorXd::Constant(kSize, 0.05));
      }
      codebook.gaussians.push_back(rows);
      codebook.weights.emplace_back(Eigen::MatrixXf::Constant(1, kDensities, 1.0F / kDensities));
    }
    model.codebooks.push_back(codebook);
  }
  return model;
}

/// Frames that the model makes, as a voice says them whose features are `matrix` times them, and `shift` more.
HeardFrames saidBy(const TiedModel& model, const Eigen::MatrixXd& matrix, const Eigen::VectorXd& shift,
                   Eigen::Index frames, std::mt19937& random) {
  std::normal_distribution<double> normal;
  HeardFrames heard{Eigen::MatrixXf(kSize * kStreams, frames), Eigen::MatrixXf::Zero(kPhoneCount, frames)};
  for (Eigen::Index t = 0; t < frames; ++t) {
    const TiedModel::Codebook& codebook = model.codebooks[static_cast<std::size_t>(t % 2)];
    heard.posteriors(static_cast<Eigen::Index>(*phoneFromName(codebook.phone)), t) = 1;
    for (Eigen::Index stream = 0; stream < kStreams; ++stream) {
      const Densities densities = densitiesOf(codebook.gaussians[static_cast<std::size_t>(stream)]);
      const Eigen::Index density = static_cast<Eigen::Index>(random() % kDensities);
      Eigen::VectorXd own = densities.means.col(density);
      for (Eigen::Index i = 0; i < kSize; ++i) own(i) += std::sqrt(densities.variances(i, density)) * normal(random);
      own = matrix * own;
      if (stream == 0) own += shift;
      heard.features.col(t).segment(stream * kSize, kSize) = own.cast<float>();
    }
  }
  return heard;
}

TEST(VoiceTransform, UndoesWhatAVoiceDoesToTheModelsSounds) {
  std::mt19937 random(3);
  const TiedModel model = madeModel(random);
  Eigen::MatrixXd matrix(kSize, kSize);
  matrix << 1.05, 0.03, -0.02, -0.03, 0.95, 0.02, 0.02, 0.01, 1.04;
  const Eigen::Vector3d shift(0.1, -0.08, 0.05);
  const HeardFrames heard = saidBy(model, matrix, shift, 6000, random);
  const VoiceTransform found = fitVoice(model, std::span(&heard, 1));
  const Eigen::MatrixXd both = found.matrix * matrix;
  EXPECT_LT((both - Eigen::MatrixXd::Identity(kSize, kSize)).cwiseAbs().maxCoeff(), 0.01);
  EXPECT_LT((found.matrix * shift + found.shift).cwiseAbs().maxCoeff(), 0.02);
}

TEST(VoiceTransform, LittleSpeechMovesLittle) {
  std::mt19937 random(5);
  const TiedModel model = madeModel(random);
  const Eigen::MatrixXd matrix = 1.06 * Eigen::MatrixXd::Identity(kSize, kSize);
  const auto movedBy = [&](Eigen::Index frames) {
    const HeardFrames heard = saidBy(model, matrix, Eigen::VectorXd::Zero(kSize), frames, random);
    return (fitVoice(model, std::span(&heard, 1)).matrix - Eigen::MatrixXd::Identity(kSize, kSize)).norm();
  };
  EXPECT_LT(movedBy(10), 0.3 * movedBy(3000));
}

TEST(VoiceTransform, NoneWhereNothingIsSaid) {
  std::mt19937 random(7);
  const TiedModel model = madeModel(random);
  EXPECT_TRUE(fitVoice(model, {}).isNone());
  HeardFrames silent{Eigen::MatrixXf::Zero(kSize * kStreams, 50), Eigen::MatrixXf::Zero(kPhoneCount, 50)};
  silent.posteriors.row(0).setOnes();
  EXPECT_TRUE(fitVoice(model, std::span(&silent, 1)).isNone());
  EXPECT_TRUE(VoiceTransform{}(silent.features) == silent.features);
}

/// Formants of eSpeak's lie where no person's do: what is said is likelier once the voice is known.
TEST(VoiceTransform, AnEarThatKnowsTheVoiceHearsMore) {
  const SpokenLine line = makeVoice("espeak:en-us")->speak("The logs fell and tumbled into the clear stream.");
  const std::vector<std::int16_t> samples = samplesToHear(line.audio);
  PhoneEar ear;
  const auto said = [&] {
    const Eigen::MatrixXf posteriors = ear.posteriors(samples);
    double sum = 0;
    for (Eigen::Index t = 0; t < posteriors.cols(); ++t) {
      const double time = 0.01 * static_cast<double>(t) + 0.013;
      for (const LabelledPhone& phone : line.labels.phones) {
        if (phone.span.contains(time)) sum += double{posteriors(static_cast<Eigen::Index>(phone.phone), t)};
      }
    }
    return sum / static_cast<double>(posteriors.cols());
  };
  const double before = said();
  const std::span<const std::int16_t> whole(samples);
  ear.adaptTo(std::span(&whole, 1));
  EXPECT_GT(said(), before + 0.02);
  EXPECT_FALSE(ear.voice().isNone());
  ear.adaptTo({});
  EXPECT_EQ(said(), before);
}

/// Of a recording of two voices each is heard by what makes it likelier.
TEST(VoiceTransform, AnotherIsNotHeardByTheVoice) {
  const std::vector<std::int16_t> robot =
      samplesToHear(makeVoice("espeak:en-us")->speak("The logs fell and tumbled into the clear stream.").audio);
  const std::vector<std::int16_t> person =
      samplesToHear(makeVoice("flite:rms")->speak("The boy was there when the sun rose.").audio);
  PhoneEar ear;
  const Eigen::MatrixXf alone = ear.posteriors(person);
  const std::span<const std::int16_t> learnt(robot);
  ear.adaptTo(std::span(&learnt, 1));
  EXPECT_TRUE(ear.posteriors(person) == alone);
  EXPECT_TRUE(ear.voice().isNone());
  ear.posteriors(robot);
  EXPECT_FALSE(ear.voice().isNone());
}

}  // namespace
}  // namespace mouthpiece
