#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

namespace mouthpiece {

/// Random numbers that are the same with every standard library (its distributions are not): SplitMix64 (Steele, Lea,
/// Flood 2014). Streams of one seed are independent, so that adding a number to one changes no other.
class SampleRandom {
 public:
  SampleRandom(std::uint64_t seed, std::uint64_t stream)
      : state_(mixed(mixed(seed) ^ (stream * 0xD1B54A32D192ED03u))) {}

  [[nodiscard]] double uniform() { return asReal(next() >> 11) * 0x1.0p-53; }  ///< [0, 1)
  [[nodiscard]] double uniform(double low, double high) { return low + (high - low) * uniform(); }
  /// Mean 0, deviation 1; Box and Muller 1958.
  [[nodiscard]] double normal() {
    const double radius = std::sqrt(-2 * std::log(1 - uniform()));
    return radius * std::cos(2 * std::numbers::pi * uniform());
  }
  [[nodiscard]] std::size_t index(std::size_t count) { return static_cast<std::size_t>(uniform() * asReal(count)); }
  /// Time to the next event of a Poisson process.
  [[nodiscard]] double waiting(double mean) { return -mean * std::log(1 - uniform()); }

 private:
  static std::uint64_t mixed(std::uint64_t z) {
    z += 0x9E3779B97F4A7C15u;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return z ^ (z >> 31);
  }
  std::uint64_t next() {
    const std::uint64_t value = mixed(state_);
    state_ += 0x9E3779B97F4A7C15u;
    return value;
  }

  std::uint64_t state_;
};

}  // namespace mouthpiece
