#include "vocal/vowel_network.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "base/byte_reader.h"
#include "base/errors.h"

namespace mouthpiece {

extern const std::string_view kVowelWeights;

namespace {

constexpr std::string_view kMagic = "MPVOWEL1";
constexpr int kContext = 12;
constexpr int kInputs = kVowelFeatureCount * (2 * kContext + 1);
constexpr std::uint32_t kLayers = 3;
constexpr std::uint32_t kMostUnits = 1024;
constexpr Eigen::Index kBlockFrames = 256;  // what is taken to the first layer in one product

/// Half precision: a sign, five bits of exponent, ten of fraction.
float floatFromHalf(std::uint16_t half) {
  const int exponent = (half >> 10U) & 0x1FU;
  const int fraction = half & 0x3FFU;
  if (exponent == 0x1F) return std::numeric_limits<float>::quiet_NaN();
  const float size = exponent == 0 ? std::ldexp(static_cast<float>(fraction), -24)
                                   : std::ldexp(static_cast<float>(fraction + 1024), exponent - 25);
  return (half & 0x8000U) != 0 ? -size : size;
}

