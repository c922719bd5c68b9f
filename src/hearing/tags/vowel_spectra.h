#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <complex>
#include <unsupported/Eigen/FFT>
#include <vector>

#include "audio/audio_clip.h"

namespace mouthpiece {

/// What the vowel network hears of a sound (VOCAL 4.3): 100 frames a second of 25 ms, frame i centred at i * 10 ms.
inline constexpr int kVowelFeatureRateHz = 100;
inline constexpr int kMfccCount = 13;
inline constexpr int kMelBandCount = 26;
inline constexpr int kVowelFeatureCount = kMfccCount + 2 * kMelBandCount;

/// Frames x 65: 13 mel frequency cepstral coefficients, 26 log mel energies, 26 spectral subband centroids (-1 to 1
/// from edge to edge of the band). Energies are relative to the sound's loud frames, so gain does not matter; half of
/// the loud frames' mean is taken off each column, which takes off part of the voice and of the room
/// (docs/theory/hearing/vowel_network.md). Row-major, for the network reads frame after frame.
using VowelFeatures = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
VowelFeatures vowelFeatures(const AudioClip& clip);

/// The spectrum of a voice without its pitch, 100 frames a second as vowelFeatures has them: energies of the 26 mel
/// bands in nepers, after joining the tops of the harmonics, so that a high voice's harmonics do not pass for formants.
struct VowelEnvelopes {
  Eigen::MatrixXd levels;    ///< frames x 26, relative to the loud frames, at least -12, averaged over five frames
  Eigen::VectorXd pitch_hz;  ///< 0 where there is none
};
VowelEnvelopes vowelEnvelopes(const AudioClip& clip);

// tools/vowel_envelope.py has the same numbers; tests/unit/hearing compares the two.
inline constexpr int kVowelSoundRateHz = 16000;
inline constexpr Eigen::Index kVowelHop = kVowelSoundRateHz / kVowelFeatureRateHz;
inline constexpr Eigen::Index kVowelTransform = 512;
inline constexpr Eigen::Index kVowelBins = kVowelTransform / 2 + 1;
inline constexpr double kVowelFloor = 1e-7;  // -70 dB of the loud frames
inline constexpr double kVowelSilent = 1e-12;

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

  /// Calls `take` with the first frame and the spectra (a column each) of 64 frames at a time, the last ones fewer.
  template <typename Take>
  void forEachBlock(Take take) {
    constexpr Eigen::Index kBlock = 64;
    for (Eigen::Index first = 0; first < count_; first += kBlock)
      take(first, spectra(first, std::min(kBlock, count_ - first)));
  }

 private:
  Eigen::MatrixXd spectra(Eigen::Index first, Eigen::Index frames);

  Eigen::Index count_;
  Eigen::VectorXd padded_, window_, frame_;
  Eigen::VectorXcd spectrum_;
  Eigen::FFT<double> transform_;
};

/// The level that energies are measured against: 95 % of the frames are no louder.
double loudOf(const Eigen::VectorXd& levels);

/// Every column of `values` less half of the mean of its loud frames; `bands` (frames x mel bands, nepers) tells which
/// are loud.
Eigen::MatrixXd withoutLoudMean(Eigen::MatrixXd values, const Eigen::MatrixXd& bands);

}  // namespace mouthpiece
