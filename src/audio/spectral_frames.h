#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "audio/audio_clip.h"

namespace mouthpiece {

/// What a sound is like every `step`: row i is centred on i * step.
struct SpectralFrames {
  static constexpr Eigen::Index kCoefficients = 13;
  Seconds step = 0.005;
  Eigen::Matrix<float, Eigen::Dynamic, kCoefficients, Eigen::RowMajor> mfcc;  ///< the first follows the level
  Eigen::VectorXf level_db;                                                   ///< RMS re full scale

  [[nodiscard]] Eigen::Index rowAt(Seconds time) const;
};

/// Mel-frequency cepstral coefficients (Slaney's 40 bands, aubio) over 32 ms of the sound at 16 kHz.
SpectralFrames spectralFrames(const AudioClip& clip, Seconds step = 0.005);

/// Mean square of the part of `clip` within `span` that lies between the two frequencies; 0 where the span holds
/// nothing or the sampling rate does not reach the band.
double bandEnergy(const AudioClip& clip, const TimeSpan& span, double low_hz, double high_hz);

/// The level of that band at every multiple of `step` up to the clip's end: dB re a mean square of 1, at least -120,
/// under Hann windows of 20 to 40 ms.
std::vector<double> bandLevelsDb(const AudioClip& clip, double low_hz, double high_hz, Seconds step);

/// The level of each whole hundredth of a second of `samples` (16 kHz), in dB re one step of 16 bits, at least -10: of
/// the sound's first difference, since rumble lies below speech.
std::vector<double> speechLevelsDb(std::span<const std::int16_t> samples);

}  // namespace mouthpiece
