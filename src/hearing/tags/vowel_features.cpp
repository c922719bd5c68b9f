#include "hearing/tags/vowel_features.h"

#include <cmath>
#include <numbers>

#include "hearing/tags/vowel_spectra.h"
#include "base/errors.h"

namespace mouthpiece {
namespace {

/// Energies and energy-weighted frequencies of every band, frames x bands.
struct BandSums {
  Eigen::MatrixXd energy;
  Eigen::MatrixXd weighted_hz;
};

BandSums bandSums(const AudioClip& sound, const MelBank& bank) {
  constexpr Eigen::Index kBlock = 64;  // power spectra that are taken to the bands in one product
  PowerFrames frames(sound);
  Eigen::MatrixXd power(kVowelBins, kBlock);
  BandSums sums{Eigen::MatrixXd(frames.count(), kMelBandCount), Eigen::MatrixXd(frames.count(), kMelBandCount)};
  for (Eigen::Index first = 0; first < frames.count(); first += kBlock) {
    const Eigen::Index count = frames.read(first, power);
    sums.energy.middleRows(first, count).noalias() = (bank.weights * power.leftCols(count)).transpose();
    sums.weighted_hz.middleRows(first, count).noalias() = (bank.weighted_hz * power.leftCols(count)).transpose();
  }
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

VowelFeatures vowelFeatures(const AudioClip& clip) {
  MOUTHPIECE_EXPECT(clip.sample_rate_hz > 0);
  static const Eigen::MatrixXd cosines = cosineTransform();
  const MelBank& bank = MelBank::shared();
  const BandSums sums = clip.sample_rate_hz == kVowelSoundRateHz
                            ? bandSums(clip, bank)
                            : bandSums(resampleAudio(clip, kVowelSoundRateHz), bank);
  const double loud = quantileOf(sums.energy.rowwise().sum(), kVowelLoudQuantile) + kVowelSilent;
  const Eigen::ArrayXXd relative = sums.energy.array() / loud;
  Eigen::MatrixXd features(relative.rows(), kVowelFeatureCount);
  features.middleCols(kMfccCount, kMelBandCount) = (relative + kVowelFloor).log();
  features.leftCols(kMfccCount).noalias() = features.middleCols(kMfccCount, kMelBandCount) * cosines.transpose();
  const Eigen::ArrayXXd moment =
      sums.weighted_hz.array() / loud - relative.rowwise() * bank.middle_hz.transpose().array();
  features.rightCols(kMelBandCount) =
      (moment / (relative + kVowelFloor)).rowwise() / bank.half_width_hz.transpose().array();
  takeOffLoudMean(features, features.middleCols(kMfccCount, kMelBandCount));
  return features.cast<float>();
}

}  // namespace mouthpiece
