#include "hearing/tags/vowel_spectra.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/errors.h"
#include "base/index.h"
#include "base/statistics.h"

namespace mouthpiece {
namespace {

constexpr Eigen::Index kWindow = 400;  // 25 ms
constexpr double kPreEmphasis = 0.97;
constexpr double kLowestHz = 80;
constexpr double kHighestHz = 7600;

double melFromHz(double hz) { return 2595 * std::log10(1 + hz / 700); }
double hzFromMel(double mel) { return 700 * (std::pow(10, mel / 2595) - 1); }

Eigen::VectorXd paddedPreEmphasis(const std::vector<float>& samples, Eigen::Index frames) {
  Eigen::VectorXd padded = Eigen::VectorXd::Zero(kWindow / 2 + frames * kVowelHop + kWindow);
  const Eigen::VectorXd sound = Eigen::Map<const Eigen::VectorXf>(samples.data(), std::ssize(samples)).cast<double>();
  padded.segment(kWindow / 2, sound.size()) = sound;
  if (sound.size() > 1)
    padded.segment(kWindow / 2 + 1, sound.size() - 1) -= kPreEmphasis * sound.head(sound.size() - 1);
  return padded;
}

Eigen::VectorXd hammingWindow() {
  return Eigen::VectorXd::NullaryExpr(
      kWindow, [](Eigen::Index i) { return 0.54 - 0.46 * std::cos(2 * std::numbers::pi * asReal(i) / (kWindow - 1)); });
}

/// Energies and energy-weighted frequencies of every band, frames x bands.
struct BandSums {
  Eigen::MatrixXd energy;
  Eigen::MatrixXd weighted_hz;
};

BandSums bandSums(const AudioClip& sound, const MelBank& bank) {
  PowerFrames frames(sound);
  BandSums sums{Eigen::MatrixXd(frames.count(), kMelBandCount), Eigen::MatrixXd(frames.count(), kMelBandCount)};
  frames.forEachBlock([&](Eigen::Index first, const Eigen::MatrixXd& power) {
    sums.energy.middleRows(first, power.cols()).noalias() = (bank.weights * power).transpose();
    sums.weighted_hz.middleRows(first, power.cols()).noalias() = (bank.weighted_hz * power).transpose();
  });
  return sums;
}

/// The orthonormal cosine transform's first rows.
Eigen::MatrixXd cosineTransform() {
  Eigen::MatrixXd matrix(kMfccCount, kMelBandCount);
  for (int k = 0; k < kMfccCount; ++k) {
    for (int band = 0; band < kMelBandCount; ++band) {
      matrix(k, band) = std::sqrt(2.0 / kMelBandCount) * std::cos(std::numbers::pi * k * (band + 0.5) / kMelBandCount);
    }
  }
  return matrix;
}

}  // namespace

MelBank::MelBank() {
  const double low = melFromHz(kLowestHz);
  const double step = (melFromHz(kHighestHz) - low) / (kMelBandCount + 1);
  for (int band = 0; band < kMelBandCount; ++band) {
    const double left = hzFromMel(low + step * band);
    const double middle = hzFromMel(low + step * (band + 1));
    const double right = hzFromMel(low + step * (band + 2));
    for (Eigen::Index bin = 0; bin < kVowelBins; ++bin) {
      const double hz = asReal(bin) * kVowelSoundRateHz / kVowelTransform;
      const double weight = std::min((hz - left) / (middle - left), (right - hz) / (right - middle));
      weights(band, bin) = std::max(weight, 0.0);
      weighted_hz(band, bin) = std::max(weight, 0.0) * hz;
    }
    middle_hz(band) = middle;
    half_width_hz(band) = (right - left) / 2;
  }
}

const MelBank& MelBank::shared() {
  static const MelBank bank;
  return bank;
}

PowerFrames::PowerFrames(const AudioClip& sound)
    : count_(std::ssize(sound.samples) / kVowelHop + 1),
      padded_(paddedPreEmphasis(sound.samples, count_)),
      window_(hammingWindow()),
      frame_(Eigen::VectorXd::Zero(kVowelTransform)) {
  transform_.SetFlag(Eigen::FFT<double>::HalfSpectrum);
}

Eigen::MatrixXd PowerFrames::spectra(Eigen::Index first, Eigen::Index frames) {
  Eigen::MatrixXd columns(kVowelBins, frames);
  for (Eigen::Index k = 0; k < frames; ++k) {
    frame_.head(kWindow) = padded_.segment((first + k) * kVowelHop, kWindow).cwiseProduct(window_);
    transform_.fwd(spectrum_, frame_);
    columns.col(k) = spectrum_.cwiseAbs2();
  }
  return columns;
}

double loudOf(const Eigen::VectorXd& levels) { return interpolatedQuantile({levels.begin(), levels.end()}, 0.95); }

Eigen::MatrixXd withoutLoudMean(Eigen::MatrixXd values, const Eigen::MatrixXd& bands) {
  constexpr double kLoudRange = 5;       // nepers of energy under the loudest band's 95th percentile
  constexpr double kTakenOffMean = 0.5;  // chosen on singers left out
  const Eigen::VectorXd loudest_band = bands.rowwise().maxCoeff();
  const double threshold = loudOf(loudest_band) - kLoudRange;
  Eigen::RowVectorXd sum = Eigen::RowVectorXd::Zero(values.cols());
  double count = 0;
  for (Eigen::Index frame = 0; frame < values.rows(); ++frame) {
    if (loudest_band(frame) <= threshold) continue;
    sum += values.row(frame);
    ++count;
  }
  if (count > 0) values.rowwise() -= kTakenOffMean / count * sum;
  return values;
}

VowelFeatures vowelFeatures(const AudioClip& clip) {
  MOUTHPIECE_EXPECT(clip.sample_rate_hz > 0);
  static const Eigen::MatrixXd cosines = cosineTransform();
  const MelBank& bank = MelBank::shared();
  const BandSums sums = bandSums(resampleAudio(clip, kVowelSoundRateHz), bank);
  const double loud = loudOf(sums.energy.rowwise().sum()) + kVowelSilent;
  const Eigen::ArrayXXd relative = sums.energy.array() / loud;
  Eigen::MatrixXd features(relative.rows(), kVowelFeatureCount);
  features.middleCols(kMfccCount, kMelBandCount) = (relative + kVowelFloor).log();
  features.leftCols(kMfccCount).noalias() = features.middleCols(kMfccCount, kMelBandCount) * cosines.transpose();
  const Eigen::ArrayXXd moment =
      sums.weighted_hz.array() / loud - relative.rowwise() * bank.middle_hz.transpose().array();
  features.rightCols(kMelBandCount) =
      (moment / (relative + kVowelFloor)).rowwise() / bank.half_width_hz.transpose().array();
  return withoutLoudMean(features, features.middleCols(kMfccCount, kMelBandCount)).cast<float>();
}

}  // namespace mouthpiece
