#pragma once

#include <Eigen/Core>

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
/// (docs/theory/vowel_network.md). Row-major, for the network reads frame after frame.
using VowelFeatures = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
VowelFeatures vowelFeatures(const AudioClip& clip);

}  // namespace mouthpiece
