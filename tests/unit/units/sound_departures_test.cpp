// Laws of what a sound tells the prediction beside its labels, and how it departs from what these let expect.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/index.h"
#include "units/prediction/sound_model.h"

namespace mouthpiece {
namespace {

/// Twice as loud is 6 dB more of level, and the same spectrum.
TEST(SoundMeasures, TellLevelAndSpectrumApart) {
  AudioClip clip{16000, std::vector<float>(16000)};
  for (std::size_t i = 0; i < clip.samples.size(); ++i) {
    const double t = asReal(i) / 16000;
    clip.samples[i] = static_cast<float>(0.1 * std::sin(1200 * t) + 0.05 * std::sin(9000 * t + 20 * std::sin(11 * t)));
  }
  const SoundMeasures quiet = soundMeasures(clip);
  for (float& sample : clip.samples) sample *= 2;
  const SoundMeasures loud = soundMeasures(clip);
  ASSERT_EQ(quiet.rows.cols(), kSoundMeasures);
  EXPECT_NEAR(asReal(quiet.rows.rows()), 100, 2) << "a row for 10 ms";
  const Eigen::MatrixXd more = loud.rows - quiet.rows;
  EXPECT_LT((more.col(0).array() - 20 * std::log10(2.0)).abs().maxCoeff(), 0.02);
  EXPECT_LT(more.rightCols(kSoundMeasures - 1).cwiseAbs().maxCoeff(), 0.02);
  EXPECT_GT(quiet.rows.rightCols(kSoundMeasures - 1).colwise().norm().minCoeff(), 0.01) << "each tells something";
  EXPECT_EQ(soundMeasures({}).rows.rows(), 0);
}

/// Half a second of silence, speech, half a second of silence.
SpeechLabels spoken(Seconds speech) {
  SpeechLabels labels;
  labels.phones = {{Phone::kSil, {0, 0.5}, {}, {}},
                   {Phone::kAE, {0.5, 0.5 + speech}, {}, {}},
                   {Phone::kSil, {0.5 + speech, 1 + speech}, {}, {}}};
  return labels;
}

class Deviations : public ::testing::Test {
 protected:
  static constexpr Eigen::Index kRows = 300;  ///< 3 s, two of them spoken
  const SpeechLabels labels_ = spoken(2);
  const Eigen::MatrixXd expected_ = Eigen::MatrixXd::Random(kPhoneCount, kSoundMeasures);

  [[nodiscard]] SoundMeasures asExpected() const {
    SoundMeasures measures;
    for (Eigen::Index row = 0; row < kRows; ++row) {
      const Phone phone = row >= 50 && row < 250 ? Phone::kAE : Phone::kSil;
      measures.rows.conservativeResize(kRows, kSoundMeasures);
      measures.rows.row(row) = expected_.row(static_cast<Eigen::Index>(phone));
    }
    return measures;
  }
  [[nodiscard]] SoundDeviations of(const SoundMeasures& measures) const { return {measures, labels_, expected_}; }
  static constexpr double kRounding = 1e-9;
};

/// The speaker, the microphone and the room are no departure.
TEST_F(Deviations, ASoundAsItsPhonesAreExpectedDepartsInNothing) {
  SoundMeasures measures = asExpected();
  EXPECT_LT(of(measures).rows().cwiseAbs().maxCoeff(), kRounding);
  const Eigen::RowVectorXd speaker = Eigen::RowVectorXd::Random(kSoundMeasures), room = 3 * speaker;
  for (Eigen::Index row = 0; row < kRows; ++row) measures.rows.row(row) += row >= 50 && row < 250 ? speaker : room;
  EXPECT_LT(of(measures).rows().cwiseAbs().maxCoeff(), kRounding);
  EXPECT_LT(of(measures).spreadInSpeech().maxCoeff(), kRounding);
}

/// A departure of one moment is spread by a Gaussian of 35 ms, and nothing of it is lost.
TEST_F(Deviations, AreSmoothedByAGaussian) {
  SoundMeasures measures = asExpected();
  measures.rows(100, 2) += 5;  // and back, so that the mean stays
  measures.rows(200, 2) -= 5;
  const Eigen::MatrixXd rows = of(measures).rows();
  EXPECT_NEAR(rows.col(2).segment(80, 41).sum(), 5, kRounding);
  for (Eigen::Index away = 0; away <= 10; ++away) {
    const double share = std::exp(-0.5 * std::pow(10.0 * static_cast<double>(away) / 35, 2));
    EXPECT_NEAR(rows(100 + away, 2), share * rows(100, 2), kRounding) << away;
    EXPECT_NEAR(rows(100 - away, 2), share * rows(100, 2), kRounding) << away;
    EXPECT_NEAR(rows(200 - away, 2), -share * rows(100, 2), kRounding) << away;
  }
  EXPECT_LT(rows.leftCols(2).cwiseAbs().maxCoeff(), kRounding) << "each measure by itself";
  // Twice the departure is twice as wide; what silence does is no matter of speech.
  const Eigen::RowVectorXd spread = of(measures).spreadInSpeech();
  measures.rows(100, 2) += 5;
  measures.rows(200, 2) -= 5;
  measures.rows(10, 2) += 1000;
  measures.rows(290, 2) -= 1000;
  EXPECT_NEAR(of(measures).spreadInSpeech()(2), 2 * spread(2), kRounding);
  const double squares = rows.col(2).squaredNorm();
  EXPECT_NEAR(spread(2), std::sqrt(squares / 200), kRounding) << "the root of the mean square over two seconds";
}

TEST_F(Deviations, FeaturesAreThoseAroundAMomentAndInSilenceMore) {
  SoundMeasures measures = asExpected();
  measures.rows += Eigen::MatrixXd::Random(kRows, kSoundMeasures);
  const SoundDeviations deviations = of(measures);
  const auto rowAt = [&](Seconds time) -> Eigen::RowVectorXd {
    const double place = time / SoundMeasures::kStep;
    if (place < -1e-9 || place > kRows - 1 + 1e-9) return Eigen::RowVectorXd::Zero(kSoundMeasures);
    const auto before = static_cast<Eigen::Index>(std::clamp(std::floor(place + 1e-9), 0.0, double{kRows - 2}));
    return deviations.rows().row(before) +
           (place - asReal(before)) * (deviations.rows().row(before + 1) - deviations.rows().row(before));
  };
  const Eigen::RowVectorXd scale = Eigen::RowVectorXd::Random(kSoundMeasures);
  const std::vector<Seconds> times{0.03, 0.205, 1.5, 1.2037, 2.8, 2.96, 5};
  const Eigen::MatrixXd features = deviations.featuresAt(times, scale);
  const auto block = [&](std::size_t i, Eigen::Index number) -> Eigen::RowVectorXd {
    return features.row(signedIndex(i)).segment(number * kSoundMeasures, kSoundMeasures);
  };
  for (std::size_t i = 0; i < times.size(); ++i) {
    SCOPED_TRACE(times[i]);
    for (Eigen::Index lag = -1; lag <= 1; ++lag) {
      EXPECT_LT((block(i, lag + 1) - rowAt(times[i] + 0.06 * asReal(lag)).cwiseProduct(scale)).norm(), kRounding);
    }
    const bool is_speech = times[i] > 0.6 && times[i] < 2.4;
    for (Eigen::Index lag = -2; lag <= 2; ++lag) {
      const Eigen::RowVectorXd heard = rowAt(times[i] + 0.06 * asReal(lag)).cwiseProduct(scale);
      const double expected = is_speech ? 0 : 1;
      EXPECT_LT((block(i, lag + 5) - expected * heard).norm(), kRounding + 1e-3 * heard.norm()) << lag;
    }
  }
}

/// His own sound is believed and taken as it is; a wider one is scaled down, and one much wider not believed.
TEST_F(Deviations, AStrangersSoundIsScaledDownAndThenNotBelieved) {
  SoundMeasures measures = asExpected();
  measures.rows += Eigen::MatrixXd::Random(kRows, kSoundMeasures);
  const Eigen::RowVectorXd wide = of(measures).spreadInSpeech();
  const std::vector<Seconds> times{0.3, 1.1, 1.9};
  const auto heard = [&](double widest) {
    static SoundModel model;
    model.expected = expected_;
    model.spread = Eigen::RowVectorXd::Constant(kSoundMeasures, 0.4);
    model.widest_spread = wide / widest;
    model.weights = Eigen::MatrixXd::Ones(kSoundFeatures, 2);
    return HeardLine(model, measures, labels_);
  };
  const Eigen::MatrixXd plain = of(measures).featuresAt(times, Eigen::RowVectorXd::Constant(kSoundMeasures, 1 / 0.4)) *
                                Eigen::MatrixXd::Ones(kSoundFeatures, 2);
  for (const auto& [widest, believed] :
       {std::pair(0.5, 1.0), {1.0, 1.0}, {std::sqrt(2.0), 0.5}, {std::sqrt(2.5), 0.25}, {2.0, 0.0}}) {
    SCOPED_TRACE(widest);
    const HeardLine line = heard(widest);
    EXPECT_NEAR(line.strangeness(), widest * widest, kRounding);
    EXPECT_NEAR(line.believed(), believed, kRounding);
    EXPECT_LT((line.at(times) - believed / std::max(1.0, widest * widest) * plain).norm(), 1e-6 * plain.norm());
  }
}

}  // namespace
}  // namespace mouthpiece
