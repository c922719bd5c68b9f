#include "hearing/alignment/phone_decoder.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace mouthpiece {
namespace {

constexpr int kRateHz = 16000;
constexpr std::size_t kCount = 13;

/// How strong a sound of `hz` leaves a mouth with resonances at 700 and 1200 Hz.
double resonanceAt(double hz) {
  const auto peak = [&](double middle, double width) { return 1 / (1 + std::pow((hz - middle) / width, 2)); };
  return (peak(700, 90) + 0.6 * peak(1200, 110) + 0.02) * 200 / (hz + 200);
}

std::vector<std::int16_t> vowelAt(double pitch_hz) {
  std::vector<double> sum(kRateHz, 0.0);
  for (int k = 1; k * pitch_hz < 7500; ++k) {
    for (std::size_t i = 0; i < sum.size(); ++i) {
      sum[i] += resonanceAt(k * pitch_hz) *
                std::sin(2 * std::numbers::pi * k * pitch_hz * static_cast<double>(i) / kRateHz + k * k);
    }
  }
  double square = 0;
  for (const double value : sum) square += value * value;
  const double gain = 3000 / std::sqrt(square / static_cast<double>(sum.size()));
  std::vector<std::int16_t> samples;
  for (const double value : sum) samples.push_back(static_cast<std::int16_t>(std::lrint(gain * value)));
  return samples;
}

using Cepstra = std::vector<std::vector<float>>;

Cepstra cepstraOf(const std::vector<std::int16_t>& samples) {
  Cepstra cepstra;
  for (std::size_t start = 0; start + 410 < samples.size(); start += 160)
    cepstra.push_back(frontEndCepstra(samples, start, kCount));
  return cepstra;
}

/// Of the middle frames, without the level.
double distance(const Cepstra& a, const Cepstra& b) {
  double sum = 0;
  for (std::size_t frame = 30; frame < 60; ++frame) {
    for (std::size_t k = 1; k < kCount; ++k) sum += std::pow(a[frame][k] - b[frame][k], 2);
  }
  return std::sqrt(sum / 30);
}

TEST(SpectralEnvelope, OneVowelAtTwoPitchesBecomesAlike) {
  const auto low = vowelAt(120);
  for (const double pitch_hz : {350.0, 520.0, 590.0}) {
    const auto high = vowelAt(pitch_hz);
    Cepstra low_cepstra = cepstraOf(low), high_cepstra = cepstraOf(high);
    const double before = distance(low_cepstra, high_cepstra);
    useSpectralEnvelope(low, low_cepstra);
    useSpectralEnvelope(high, high_cepstra);
    EXPECT_LT(distance(low_cepstra, high_cepstra), 0.75 * before) << pitch_hz << " Hz";
  }
}

TEST(SpectralEnvelope, LeavesWhatHasNoPitch) {
  std::vector<std::int16_t> samples(kRateHz, 0);
  std::uint32_t state = 1;
  for (std::int16_t& sample : samples)
    sample = static_cast<std::int16_t>(static_cast<int>((state = state * 1664525U + 1013904223U) >> 20U) - 2048);
  const Cepstra before = cepstraOf(samples);
  Cepstra after = before;
  useSpectralEnvelope(samples, after);
  std::size_t changed = 0;
  for (std::size_t i = 0; i < after.size(); ++i) changed += after[i] == before[i] ? 0U : 1U;
  EXPECT_LE(changed, after.size() / 20);
  Cepstra none;
  useSpectralEnvelope(samples, none);
  EXPECT_TRUE(none.empty());
}

}  // namespace
}  // namespace mouthpiece
