#pragma once

#include <cmath>
#include <cstddef>
#include <random>
#include <vector>

#include "audio/audio_clip.h"

namespace mouthpiece::test {

/// 2.5 s of wind at 16 kHz that rises for half a second: words that networks hear in it are said by nobody.
inline AudioClip gust() {
  AudioClip sound{16000, std::vector<float>(40000)};
  std::mt19937 random(7);
  std::normal_distribution<float> normal(0, 0.002F);
  float wind = 0;
  for (std::size_t i = 0; i < sound.samples.size(); ++i) {
    const double beside = (static_cast<double>(i) - 20000) / 4000;
    wind = 0.995F * wind + normal(random);
    sound.samples[i] = static_cast<float>(1 + 4 * std::exp(-beside * beside)) * wind;
  }
  return sound;
}

}  // namespace mouthpiece::test
