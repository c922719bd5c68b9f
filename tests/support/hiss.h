#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <span>

#include "audio/audio_clip.h"

namespace mouthpiece::test {

/// Samples of 16 kHz in white noise.
inline AudioClip inHiss(std::span<const std::int16_t> samples, double snr_db) {
  AudioClip clip{16000, {}};
  double power = 0;
  for (const std::int16_t sample : samples) {
    clip.samples.push_back(static_cast<float>(sample) / 32768.0F);
    power += double{clip.samples.back()} * double{clip.samples.back()} / static_cast<double>(samples.size());
  }
  std::mt19937 random(7);
  std::normal_distribution<float> hiss(0, static_cast<float>(std::sqrt(power) * std::pow(10, -snr_db / 20)));
  for (float& sample : clip.samples) sample = std::clamp(sample + hiss(random), -1.0F, 1.0F);
  return clip;
}

}  // namespace mouthpiece::test
