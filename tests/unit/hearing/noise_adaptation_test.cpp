#include "hearing/alignment/noise_adaptation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "base/index.h"
#include "hearing/alignment/phone_decoder.h"

namespace mouthpiece {
namespace {

constexpr Eigen::Index kCepstra = 13, kMadeDensities = 4, kFrames = 200;

Eigen::VectorXd drawn(std::mt19937& random, double deviation) {
  std::normal_distribution<double> normal(0, deviation);
  return Eigen::VectorXd::NullaryExpr(kCepstra, [&] { return normal(random); });
}

/// Bands that lie some 9 dB (2 nats) above and below each other, as cepstra.
Eigen::VectorXd drawnSound(std::mt19937& random) {
  std::normal_distribution<double> normal(0, 2);
  const Eigen::MatrixXd cosines = frontEndCosines(unsignedIndex(kCepstra));
  return cosines * Eigen::VectorXd::NullaryExpr(cosines.cols(), [&] { return normal(random); });
}

/// One phone of a few sounds, about which speech moves.
struct MadeSpeech {
  TiedModel model;
  std::vector<Eigen::VectorXd> means;
};

MadeSpeech madeSpeech(std::mt19937& random) {
  MadeSpeech made;
  made.model.stream_sizes = {kCepstra, kCepstra, kCepstra};
  made.model.senone_count = 1;
  TiedModel::Codebook codebook{"AA", {0}, {}, {}};
  for (int stream = 0; stream < 3; ++stream) {
    Eigen::MatrixXf rows(kMadeDensities, 2 * kCepstra + 1);
    for (Eigen::Index i = 0; i < kMadeDensities; ++i) {
      const Eigen::VectorXd mean = stream == 0 ? drawnSound(random) : drawn(random, 1);
      if (stream == 0) made.means.push_back(mean);
      rows.row(i) = densityRow(mean, Eigen::VectorXd::Constant(kCepstra, 0.5));
    }
    codebook.gaussians.push_back(rows);
    codebook.weights.push_back(Eigen::MatrixXf::Constant(1, kMadeDensities, 1.0F / kMadeDensities));
  }
  made.model.codebooks.push_back(codebook);
  return made;
}

/// The speech with a steady noise added in the mel bands, `noise_level` above it in the first cepstrum; the first
/// quarter holds the noise alone.
Eigen::MatrixXd spoken(const MadeSpeech& made, const Eigen::VectorXd& room, double noise_level, std::mt19937& random) {
  const Eigen::MatrixXd cosines = frontEndCosines(unsignedIndex(kCepstra));
  const Eigen::MatrixXd bands = cosines.transpose() * cosines.rowwise().squaredNorm().cwiseInverse().asDiagonal();
  Eigen::VectorXd noise = room;
  noise(0) += noise_level;
  Eigen::MatrixXd cepstra(kCepstra, kFrames);
  for (Eigen::Index t = 0; t < kFrames; ++t) {
    const Eigen::VectorXd here = noise + drawn(random, 0.05);
    if (t < kFrames / 4) {
      cepstra.col(t) = here;
      continue;
    }
    const Eigen::VectorXd speech = made.means[unsignedIndex(t / 5 % kMadeDensities)] + room + drawn(random, 0.3);
    const Eigen::ArrayXd sum = (bands * speech).array().exp() + (bands * here).array().exp();
    cepstra.col(t) = speech + cosines * (sum.log().matrix() - bands * speech);
  }
  return cepstra;
}

/// Mean over the frames of speech of the likeliest density's logarithm in the first stream.
double likelihood(const TiedModel& model, const Eigen::MatrixXd& cepstra) {
  const Eigen::MatrixXd features = cepstra.colwise() - cepstra.rowwise().mean();
  double sum = 0, count = 0;
  for (Eigen::Index t = kFrames / 4; t < kFrames; ++t) {
    Eigen::VectorXf terms(2 * kCepstra + 1);
    terms << features.col(t).cwiseAbs2().cast<float>(), features.col(t).cast<float>(), 1.0F;
    sum += double{(model.codebooks[0].gaussians[0] * terms).maxCoeff()};
    count += 1;
  }
  return sum / count;
}

TEST(NoiseAdaptation, MakesSpeechInSteadyNoiseLikelier) {
  std::mt19937 random(5);
  const MadeSpeech made = madeSpeech(random);
  const Eigen::VectorXd room = drawn(random, 3);
  const Eigen::MatrixXd noisy = spoken(made, room, -5, random);
  EXPECT_TRUE(isSteady(noisy));
  const TiedModel adapted = adaptedToNoise(made.model, noisy, {true});
  EXPECT_GT(likelihood(adapted, noisy), likelihood(made.model, noisy) + 5) << "nats a frame";
}

TEST(NoiseAdaptation, HardlyChangesWhereTheBackgroundIsFarBelow) {
  std::mt19937 random(6);
  const MadeSpeech made = madeSpeech(random);
  const Eigen::MatrixXd clean = spoken(made, drawn(random, 3), -80, random);
  const TiedModel adapted = adaptedToNoise(made.model, clean, {true});
  for (int stream = 1; stream < 3; ++stream) {
    const auto& before = made.model.codebooks[0].gaussians[unsignedIndex(stream)];
    EXPECT_LT((adapted.codebooks[0].gaussians[unsignedIndex(stream)] - before).cwiseAbs().maxCoeff(), 0.02F);
  }
}

TEST(NoiseAdaptation, LeavesTheModelWhereTheBackgroundIsNotSteady) {
  std::mt19937 random(7);
  const MadeSpeech made = madeSpeech(random);
  Eigen::MatrixXd cepstra = spoken(made, drawn(random, 3), -5, random);
  for (Eigen::Index t = 0; t < kFrames / 4; ++t) cepstra(0, t) -= 20.0 * static_cast<double>(t / 5 % 2);
  EXPECT_FALSE(isSteady(cepstra));
  const TiedModel same = adaptedToNoise(made.model, cepstra, {true});
  EXPECT_EQ(same.codebooks[0].gaussians[0], made.model.codebooks[0].gaussians[0]);
}

TEST(NoiseAdaptation, LeavesAModelOfOtherFeatures) {
  std::mt19937 random(8);
  MadeSpeech made = madeSpeech(random);
  made.model.stream_sizes = {kCepstra, kCepstra};
  const TiedModel same = adaptedToNoise(made.model, Eigen::MatrixXd::Zero(kCepstra, kFrames), {true});
  EXPECT_EQ(same.codebooks[0].gaussians[0], made.model.codebooks[0].gaussians[0]);
}

}  // namespace
}  // namespace mouthpiece
