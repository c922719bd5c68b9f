#pragma once

#include <Eigen/Core>
#include <complex>
#include <unsupported/Eigen/FFT>
#include <vector>

#include "audio/audio_clip.h"
#include "hearing/tags/vowel_features.h"

namespace mouthpiece {

// tools/vowel_envelope.py has the same numbers; tests/unit/vocal compares the two.
inline constexpr int kVowelSoundRateHz = 16000;
inline constexpr std::size_t kVowelHop = kVowelSoundRateHz / kVowelFeatureRateHz;
inline constexpr std::size_t kVowelTransform = 512;
inline constexpr std::size_t kVowelBins = kVowelTransform / 2 + 1;
inline constexpr double kVowelFloor = 1e-7;  // -70 dB of the loud frames
inline constexpr double kVowelSilent = 1e-12;
inline constexpr double kVowelLoudQuantile = 0.95;  // the frame that energies are measured against

/// Triangles, evenly spaced in mel from 80 to 7600 Hz, each from the middle of the one before to the middle of the one
/// after.
struct MelBank {
  Eigen::MatrixXd weights{Eigen::MatrixXd::Zero(kMelBandCount, kVowelBins)};
  Eigen::MatrixXd weighted_hz{Eigen::MatrixXd::Zero(kMelBandCount, kVowelBins)};
  Eigen::VectorXd middle_hz{kMelBandCount};
  Eigen::VectorXd half_width_hz{kMelBandCount};

  MelBank();
  static const MelBank& shared();
};

/// Power spectra of a sound of 16 kHz, 25 ms around every 10 ms, pre-emphasised; zero beyond its ends.
class PowerFrames {
 public:
  explicit PowerFrames(const AudioClip& sound);
  [[nodiscard]] Eigen::Index count() const { return count_; }
  /// Writes the spectra of the frames from `first` on, one to a column, and returns how many there were.
  Eigen::Index read(Eigen::Index first, Eigen::MatrixXd& columns);

 private:
  Eigen::Index count_;
  std::vector<double> padded_, window_, frame_;
  std::vector<std::complex<double>> spectrum_;
  Eigen::FFT<double> transform_;
};

/// Straight between order statistics, as numpy.quantile.
double quantileOf(Eigen::VectorXd values, double share);

/// Takes half of the mean of the loud frames off every column; `bands` (frames x mel bands, nepers) tells which are
/// loud.
void takeOffLoudMean(Eigen::MatrixXd& values, const Eigen::MatrixXd& bands);

}  // namespace mouthpiece
