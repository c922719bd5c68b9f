#include <Eigen/Core>
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

float weightedSum(std::span<const float> samples, std::int64_t first, const std::vector<float>& weights) {
  const std::int64_t begin = std::max<std::int64_t>(0, -first);
  const std::int64_t end = std::min<std::int64_t>(std::ssize(weights), std::ssize(samples) - first);
  if (end <= begin) return 0;
  const Eigen::Map<const Eigen::VectorXf> heard(&samples[unsignedIndex(first + begin)], end - begin);
  const Eigen::Map<const Eigen::VectorXf> by(&weights[unsignedIndex(begin)], end - begin);
  return std::clamp(heard.dot(by), -1.0F, 1.0F);
}

/// From one rate to another: which input samples an output sample is made of, and how.
class RateChange {
 public:
  RateChange(int from_hz, int to_hz)
      : divisor_(std::gcd(from_hz, to_hz)),
        phases_(to_hz / divisor_),
        step_(from_hz / divisor_),
        kernel_(asReal(phases_) / asReal(step_)) {
    for (std::int64_t phase = 0; phase < phases_ && phases_ <= kMostTabulatedPhases; ++phase)
      table_.push_back(kernel_.weights(fractionOf(phase)));
  }

  /// Of so many input samples.
  [[nodiscard]] std::int64_t outputCount(std::int64_t inputs) const { return (inputs * phases_ + step_ - 1) / step_; }
  /// The first input sample that output sample `n` is made of, and one beyond the last.
  [[nodiscard]] std::int64_t firstInput(std::int64_t n) const { return n * step_ / phases_ + kernel_.firstTap(); }
  [[nodiscard]] std::int64_t endInput(std::int64_t n) const { return n * step_ / phases_ + 2 - kernel_.firstTap(); }
  /// `samples` begin with input sample `begin`.
  [[nodiscard]] float output(std::int64_t n, std::span<const float> samples, std::int64_t begin) const {
    const std::int64_t phase = n * step_ % phases_;
    return table_.empty() ? weightedSum(samples, firstInput(n) - begin, kernel_.weights(fractionOf(phase)))
                          : weightedSum(samples, firstInput(n) - begin, table_[unsignedIndex(phase)]);
  }

 private:
  [[nodiscard]] double fractionOf(std::int64_t phase) const { return asReal(phase) / asReal(phases_); }

  std::int64_t divisor_, phases_, step_;  ///< output sample n lies at n * step / phases
  SincKernel kernel_;
  std::vector<std::vector<float>> table_;
};

}  // namespace

AudioClip resampleAudio(const AudioClip& clip, int sample_rate_hz) {
  MOUTHPIECE_EXPECT(clip.sample_rate_hz > 0 && sample_rate_hz > 0);
  if (clip.sample_rate_hz == sample_rate_hz) return clip;
  const RateChange change(clip.sample_rate_hz, sample_rate_hz);
  AudioClip resampled{.sample_rate_hz = sample_rate_hz, .samples = {}};
  const std::int64_t size = change.outputCount(std::ssize(clip.samples));
  resampled.samples.reserve(unsignedIndex(size));
  for (std::int64_t n = 0; n < size; ++n) resampled.samples.push_back(change.output(n, clip.samples, 0));
  return resampled;
}

AudioClip stretchAudio(const AudioClip& clip, double factor) {
  MOUTHPIECE_EXPECT(factor > 0);
  const SincKernel kernel(factor);
  // The nearest of so many phases errs 70 dB below a tone at 0.4 of the rate, and less for lower ones.
  std::vector<std::vector<float>> table;
  for (std::int64_t phase = 0; phase < kMostTabulatedPhases; ++phase)
    table.push_back(kernel.weights(asReal(phase) / asReal(kMostTabulatedPhases)));
  AudioClip stretched{.sample_rate_hz = clip.sample_rate_hz, .samples = {}};
  const std::int64_t size = std::llround(asReal(clip.samples.size()) * factor);
  stretched.samples.reserve(unsignedIndex(size));
  for (std::int64_t n = 0; n < size; ++n) {
    const std::int64_t place = std::llround(asReal(n) / factor * asReal(kMostTabulatedPhases));
    stretched.samples.push_back(weightedSum(clip.samples, place / kMostTabulatedPhases + kernel.firstTap(),
                                            table[unsignedIndex(place % kMostTabulatedPhases)]));
  }
  return stretched;
}

struct LiveResampler::State {
  RateChange change;
  bool is_same;
  std::vector<float> samples = {};  ///< those that are still needed
  std::int64_t begin = 0;           ///< the first of them, counted from the sound's start
  std::int64_t next = 0;            ///< output sample
};

LiveResampler::LiveResampler(int from_hz, int to_hz) {
  MOUTHPIECE_EXPECT(from_hz > 0 && to_hz > 0);
  state_ = std::make_unique<State>(State{RateChange(from_hz, to_hz), from_hz == to_hz});
}
LiveResampler::~LiveResampler() = default;
LiveResampler::LiveResampler(LiveResampler&&) noexcept = default;
LiveResampler& LiveResampler::operator=(LiveResampler&&) noexcept = default;

void LiveResampler::push(std::span<const float> samples, std::vector<float>& out) {
  State& state = *state_;
  if (state.is_same) {
    out.insert(out.end(), samples.begin(), samples.end());
    return;
  }
  state.samples.insert(state.samples.end(), samples.begin(), samples.end());
  const std::int64_t end = state.begin + std::ssize(state.samples);
  for (; state.change.endInput(state.next) <= end; ++state.next)
    out.push_back(state.change.output(state.next, state.samples, state.begin));
  const std::int64_t done =
      std::clamp<std::int64_t>(state.change.firstInput(state.next) - state.begin, 0, std::ssize(state.samples));
  state.samples.erase(state.samples.begin(), state.samples.begin() + done);
  state.begin += done;
}

void LiveResampler::finish(std::vector<float>& out) {
  State& state = *state_;
  if (state.is_same) return;
  const std::int64_t size = state.change.outputCount(state.begin + std::ssize(state.samples));
  for (; state.next < size; ++state.next) out.push_back(state.change.output(state.next, state.samples, state.begin));
}

std::size_t LiveResampler::outputCount(std::size_t inputs) const {
  return state_->is_same ? inputs : unsignedIndex(state_->change.outputCount(signedIndex(inputs)));
}

}  // namespace mouthpiece
