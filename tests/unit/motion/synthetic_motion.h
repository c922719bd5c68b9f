#pragma once

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include "motion/formats/c3d_file.h"
#include "motion/motion_clip.h"

namespace mouthpiece {

inline std::filesystem::path realTakesFolder() { return MOUTHPIECE_SOURCE_DIR "/../shared/capture/grid_s1/takes"; }

/// The first `count` real takes by name; empty where the capture is absent.
inline std::vector<MotionClip> realTakes(std::size_t count) {
  std::vector<std::filesystem::path> paths;
  if (std::filesystem::is_directory(realTakesFolder())) {
    for (const auto& entry : std::filesystem::directory_iterator(realTakesFolder())) {
      if (entry.path().extension() == ".c3d") paths.push_back(entry.path());
    }
  }
  std::sort(paths.begin(), paths.end());
  std::vector<MotionClip> takes;
  for (const auto& path : paths) {
    if (takes.size() == count) break;
    takes.push_back(readC3d(path));
  }
  return takes;
}

/// Band-limited motion as smooth as speech: sums of sines of 0.3 to 6 Hz, about `amplitude_mm` each way, whose value is
/// known at any time.
class SyntheticMotion {
 public:
  SyntheticMotion(unsigned seed, std::size_t marker_count, double amplitude_mm = 4.0) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    for (std::size_t channel = 0; channel < 3 * marker_count; ++channel) {
      std::vector<Wave> waves;
      for (int i = 0; i < 6; ++i) {
        const double frequency_hz = 0.3 + 5.7 * unit(random);
        // Fast movements are small ones.
        waves.push_back(
            {amplitude_mm * (unit(random) - 0.5) / (1.0 + 0.5 * frequency_hz), frequency_hz, 6.2832 * unit(random)});
      }
      channels_.push_back({200.0 * (unit(random) - 0.5), waves});
    }
  }

  [[nodiscard]] PositionMatrix at(const std::vector<Seconds>& times) const {
    PositionMatrix positions(static_cast<Eigen::Index>(times.size()), static_cast<Eigen::Index>(channels_.size()));
    for (std::size_t i = 0; i < times.size(); ++i) {
      for (std::size_t c = 0; c < channels_.size(); ++c) {
        double value = channels_[c].offset;
        for (const Wave& wave : channels_[c].waves) {
          value += wave.amplitude * std::sin(2.0 * 3.14159265358979 * wave.frequency_hz * times[i] + wave.phase);
        }
        positions(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(c)) = value;
      }
    }
    return positions;
  }

  [[nodiscard]] MotionClip clip(double frame_rate_hz, std::size_t frame_count) const {
    MotionClip clip{frame_rate_hz, {}, {}};
    for (std::size_t i = 0; i < channels_.size() / 3; ++i) {
      // Put together in place: g++ 12 warns wrongly of "M" + std::to_string.
      clip.marker_names.push_back(std::to_string(i + 1));
      clip.marker_names.back().insert(0, 1, 'M');
    }
    std::vector<Seconds> times;
    for (std::size_t i = 0; i < frame_count; ++i) times.push_back(static_cast<double>(i) / frame_rate_hz);
    clip.positions_mm = at(times);
    return clip;
  }

 private:
  struct Wave {
    double amplitude, frequency_hz, phase;
  };
  struct Channel {
    double offset;
    std::vector<Wave> waves;
  };
  std::vector<Channel> channels_;
};

}  // namespace mouthpiece
