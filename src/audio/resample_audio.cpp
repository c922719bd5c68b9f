#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "audio/audio_clip.h"
#include "base/errors.h"
#include "base/index.h"

namespace mouthpiece {
namespace {

/// A Kaiser window of this many zero crossings a side stops 90 dB and passes up to 94 % of the band.
constexpr double kZeroCrossings = 48;
constexpr double kKaiserBeta = 8.96;   // 0.1102 (90 - 8.7)
constexpr double kPassedShare = 0.94;  // 1 - (90 - 7.95) / (14.36 * 2 * 48) * 2, halved at each side of the edge
/// Kernels of all phases are tabulated when there are at most this many; odd ratios compute them as they go.
constexpr std::int64_t kMostTabulatedPhases = 4096;

/// The band-limiting kernel at `offset` input samples from the output sample.
class SincKernel {
 public:
  /// `rate_ratio` = output rate / input rate.
  explicit SincKernel(double rate_ratio)
      : bandwidth_(std::min(1.0, rate_ratio) * kPassedShare), half_width_(kZeroCrossings / std::min(1.0, rate_ratio)) {}

  [[nodiscard]] double at(double offset) const {
    const double position = offset / half_width_;
    if (std::abs(position) >= 1) return 0;
    const double window = std::cyl_bessel_i(0.0, kKaiserBeta * std::sqrt(1 - position * position));
    const double angle = std::numbers::pi * bandwidth_ * offset;
    return window * (std::abs(angle) < 1e-9 ? 1.0 : std::sin(angle) / angle);
  }

  /// Weights of the input samples from `first_tap` (relative to the one at or before the output time), which sum to
  /// one.
  [[nodiscard]] std::vector<float> weights(double fraction) const {
    std::vector<double> taps;
    for (auto tap = firstTap(); tap <= 1 - firstTap(); ++tap) taps.push_back(at(asReal(tap) - fraction));
    const double sum = std::accumulate(taps.begin(), taps.end(), 0.0);
    std::vector<float> weights;
    for (const double tap : taps) weights.push_back(asFloat(tap / sum));
    return weights;
  }

  [[nodiscard]] std::int64_t firstTap() const { return -std::lround(std::ceil(half_width_)); }

 private:
  double bandwidth_;
  double half_width_;
};

float weightedSum(const std::vector<float>& samples, std::int64_t first, const std::vector<float>& weights) {
  const std::int64_t begin = std::max<std::int64_t>(0, -first);
  const std::int64_t end = std::min<std::int64_t>(std::ssize(weights), std::ssize(samples) - first);
  double sum = 0;
  for (std::int64_t i = begin; i < end; ++i) {
    sum += double{samples[unsignedIndex(first + i)]} * weights[unsignedIndex(i)];
  }
  return asFloat(std::clamp(sum, -1.0, 1.0));
}

}  // namespace

AudioClip resampleAudio(const AudioClip& clip, int sample_rate_hz) {
  MOUTHPIECE_EXPECT(clip.sample_rate_hz > 0 && sample_rate_hz > 0);
  if (clip.sample_rate_hz == sample_rate_hz) return clip;
  const std::int64_t divisor = std::gcd(clip.sample_rate_hz, sample_rate_hz);
  const std::int64_t phases = sample_rate_hz / divisor;  // output sample n lies at n * step / phases
  const std::int64_t step = clip.sample_rate_hz / divisor;
  const SincKernel kernel(asReal(phases) / asReal(step));
  const auto fractionOf = [&](std::int64_t phase) { return asReal(phase) / asReal(phases); };
  std::vector<std::vector<float>> table;
  if (phases <= kMostTabulatedPhases) {
    for (std::int64_t phase = 0; phase < phases; ++phase) table.push_back(kernel.weights(fractionOf(phase)));
  }
  AudioClip resampled{.sample_rate_hz = sample_rate_hz, .samples = {}};
  const std::int64_t size = (std::ssize(clip.samples) * phases + step - 1) / step;
  resampled.samples.reserve(unsignedIndex(size));
  for (std::int64_t n = 0; n < size; ++n) {
    const std::int64_t first = n * step / phases + kernel.firstTap();
    const std::int64_t phase = n * step % phases;
    const float sample = table.empty() ? weightedSum(clip.samples, first, kernel.weights(fractionOf(phase)))
                                       : weightedSum(clip.samples, first, table[unsignedIndex(phase)]);
    resampled.samples.push_back(sample);
  }
  return resampled;
}

}  // namespace mouthpiece
