#include "audio/vowel_features.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <unsupported/Eigen/FFT>
#include <vector>

#include "base/errors.h"

namespace mouthpiece {
namespace {

// tools/train_vowels.py has the same numbers; tests/unit/audio compares the two.
constexpr int kRateHz = 16000;
constexpr std::size_t kHop = kRateHz / kVowelFeatureRateHz;
constexpr std::size_t kWindow = 400;  // 25 ms
constexpr std::size_t kTransform = 512;
constexpr std::size_t kBins = kTransform / 2 + 1;
constexpr double kPreEmphasis = 0.97;
constexpr double kLowestHz = 80;
constexpr double kHighestHz = 7600;
constexpr double kLoudQuantile = 0.95;  // the frame that energies are measured against
constexpr double kFloor = 1e-7;         // -70 dB of it
constexpr double kSilent = 1e-12;
constexpr double kLoudRange = 5;       // nepers of energy under the loudest band's 95th percentile
constexpr double kTakenOffMean = 0.5;  // of the loud frames' mean; chosen on singers left out

double melFromHz(double hz) { return 2595 * std::log10(1 + hz / 700); }
double hzFromMel(double mel) { return 700 * (std::pow(10, mel / 2595) - 1); }

/// Triangles, evenly spaced in mel, each from the middle of the one before to the middle of the one after.
struct MelBank {
  Eigen::MatrixXd weights{Eigen::MatrixXd::Zero(kMelBandCount, kBins)};
  Eigen::MatrixXd weighted_hz{Eigen::MatrixXd::Zero(kMelBandCount, kBins)};
  Eigen::VectorXd middle_hz{kMelBandCount};
  Eigen::VectorXd half_width_hz{kMelBandCount};

  MelBank() {
    const double low = melFromHz(kLowestHz);
    const double step = (melFromHz(kHighestHz) - low) / (kMelBandCount + 1);
    for (int band = 0; band < kMelBandCount; ++band) {
      const double left = hzFromMel(low + step * band);
      const double middle = hzFromMel(low + step * (band + 1));
      const double right = hzFromMel(low + step * (band + 2));
      for (std::size_t bin = 0; bin < kBins; ++bin) {
        const double hz = static_cast<double>(bin) * kRateHz / kTransform;
        const double weight = std::min((hz - left) / (middle - left), (right - hz) / (right - middle));
        weights(band, static_cast<Eigen::Index>(bin)) = std::max(weight, 0.0);
        weighted_hz(band, static_cast<Eigen::Index>(bin)) = std::max(weight, 0.0) * hz;
      }
      middle_hz(band) = middle;
      half_width_hz(band) = (right - left) / 2;
    }
  }
};

/// Energies and energy-weighted frequencies of every band, frames x bands.
struct BandSums {
  Eigen::MatrixXd energy;
  Eigen::MatrixXd weighted_hz;
};

std::vector<double> paddedPreEmphasis(const std::vector<float>& samples, std::size_t frames) {
  std::vector<double> padded(kWindow / 2 + frames * kHop + kWindow, 0.0);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double before = i > 0 ? kPreEmphasis * samples[i - 1] : 0.0;
    padded[kWindow / 2 + i] = samples[i] - before;
  }
  return padded;
}

BandSums bandSums(const AudioClip& sound, const MelBank& bank) {
  const std::size_t frames = sound.samples.size() / kHop + 1;
  const std::vector<double> padded = paddedPreEmphasis(sound.samples, frames);
  std::vector<double> window(kWindow);
  for (std::size_t i = 0; i < kWindow; ++i) {
    window[i] = 0.54 - 0.46 * std::cos(2 * std::numbers::pi * static_cast<double>(i) / (kWindow - 1));
  }
  constexpr std::size_t kBlock = 64;  // power spectra that are taken to the bands in one product
  Eigen::FFT<double> transform;
  transform.SetFlag(Eigen::FFT<double>::HalfSpectrum);
  std::vector<double> frame(kTransform, 0.0);
  std::vector<std::complex<double>> spectrum;
  Eigen::MatrixXd power(kBins, kBlock);
  const auto rows = static_cast<Eigen::Index>(frames);
  BandSums sums{Eigen::MatrixXd(rows, kMelBandCount), Eigen::MatrixXd(rows, kMelBandCount)};
  for (std::size_t first = 0; first < frames; first += kBlock) {
    const std::size_t count = std::min(kBlock, frames - first);
    for (std::size_t k = 0; k < count; ++k) {
      const double* start = &padded[(first + k) * kHop];
      for (std::size_t i = 0; i < kWindow; ++i) frame[i] = start[i] * window[i];
      transform.fwd(spectrum, frame);
      for (std::size_t bin = 0; bin < kBins; ++bin) {
        power(static_cast<Eigen::Index>(bin), static_cast<Eigen::Index>(k)) = std::norm(spectrum[bin]);
      }
    }
    const auto at = static_cast<Eigen::Index>(first);
    const auto n = static_cast<Eigen::Index>(count);
    sums.energy.middleRows(at, n).noalias() = (bank.weights * power.leftCols(n)).transpose();
    sums.weighted_hz.middleRows(at, n).noalias() = (bank.weighted_hz * power.leftCols(n)).transpose();
  }
  return sums;
}

/// Straight between order statistics, as numpy.quantile.
double quantile(Eigen::VectorXd values, double share) {
  std::sort(values.begin(), values.end());
  const double place = share * static_cast<double>(values.size() - 1);
  const auto below = static_cast<Eigen::Index>(place);
  const Eigen::Index above = std::min(below + 1, values.size() - 1);
  return std::lerp(values(below), values(above), place - static_cast<double>(below));
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

void takeOffLoudMean(Eigen::MatrixXd& features) {
  const Eigen::VectorXd loudest_band = features.middleCols(kMfccCount, kMelBandCount).rowwise().maxCoeff();
  const double threshold = quantile(loudest_band, kLoudQuantile) - kLoudRange;
  Eigen::RowVectorXd sum = Eigen::RowVectorXd::Zero(features.cols());
  double count = 0;
  for (Eigen::Index frame = 0; frame < features.rows(); ++frame) {
    if (loudest_band(frame) <= threshold) continue;
    sum += features.row(frame);
    ++count;
  }
  if (count > 0) features.rowwise() -= kTakenOffMean / count * sum;
}

}  // namespace

VowelFeatures vowelFeatures(const AudioClip& clip) {
  MOUTHPIECE_EXPECT(clip.sample_rate_hz > 0);
  static const MelBank bank;
  static const Eigen::MatrixXd cosines = cosineTransform();
  const BandSums sums =
      clip.sample_rate_hz == kRateHz ? bandSums(clip, bank) : bandSums(resampleAudio(clip, kRateHz), bank);
  const double loud = quantile(sums.energy.rowwise().sum(), kLoudQuantile) + kSilent;
  const Eigen::ArrayXXd relative = sums.energy.array() / loud;
  Eigen::MatrixXd features(relative.rows(), kVowelFeatureCount);
  features.middleCols(kMfccCount, kMelBandCount) = (relative + kFloor).log();
  features.leftCols(kMfccCount).noalias() = features.middleCols(kMfccCount, kMelBandCount) * cosines.transpose();
  const Eigen::ArrayXXd moment =
      sums.weighted_hz.array() / loud - relative.rowwise() * bank.middle_hz.transpose().array();
  features.rightCols(kMelBandCount) = (moment / (relative + kFloor)).rowwise() / bank.half_width_hz.transpose().array();
  takeOffLoudMean(features);
  return features.cast<float>();
}

}  // namespace mouthpiece
