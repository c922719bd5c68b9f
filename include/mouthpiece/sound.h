#pragma once

#include <vector>

namespace mouthpiece {

/// Mono sound.
struct Sound {
  int sample_rate_hz = 0;
  std::vector<float> samples;  ///< in [-1, 1]

  [[nodiscard]] double duration() const {
    return sample_rate_hz > 0 ? static_cast<double>(samples.size()) / sample_rate_hz : 0.0;
  }
};

}  // namespace mouthpiece
