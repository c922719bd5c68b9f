#include <algorithm>
#include <bit>
#include <cmath>
#include <complex>
#include <numbers>
#include <span>
#include <unsupported/Eigen/FFT>
#include <vector>

#include "audio/spectral_frames.h"
#include "base/errors.h"
#include "base/index.h"

namespace mouthpiece {
namespace {

constexpr std::size_t kWindow = 512;

/// Mean squares of a band under a Hann window.
class BandMeter {
 public:
  BandMeter(std::size_t size, int rate_hz, double low_hz, double high_hz) : window_(size), frame_(size) {
    transform_.SetFlag(Eigen::FFT<double>::HalfSpectrum);
    for (std::size_t i = 0; i < size; ++i) {
      window_[i] = 0.5 - 0.5 * std::cos(2 * std::numbers::pi * asReal(i) / asReal(size));
    }
    for (std::size_t bin = 1; bin < size / 2; ++bin) {
      const double hz = asReal(bin) * rate_hz / asReal(size);
      if (hz >= low_hz && hz < high_hz) bins_.push_back(bin);
    }
  }

  /// Of the window's length from samples[start] on; what lies beyond the end is silent.
  double at(std::span<const float> samples, std::size_t start) {
    const std::size_t size = window_.size();
    for (std::size_t i = 0; i < size; ++i) {
      frame_[i] = start + i < samples.size() ? window_[i] * samples[start + i] : 0.0;
    }
    transform_.fwd(spectrum_, frame_);
    double sum = 0;
    for (const std::size_t bin : bins_) sum += 2 * std::norm(spectrum_[bin]);
    // Parseval: the mean of |x w|^2 over the window is the sum of |X|^2 over the window's length squared; a Hann
    // window's energies sum to its length times 3/8.
    return sum / (asReal(size) * asReal(size) * 3.0 / 8.0);
  }

 private:
  Eigen::FFT<double> transform_;
  std::vector<double> window_, frame_;
  std::vector<std::size_t> bins_;
  std::vector<std::complex<double>> spectrum_;
};

}  // namespace

double bandEnergy(const AudioClip& clip, const TimeSpan& span, double low_hz, double high_hz) {
  MOUTHPIECE_EXPECT(clip.sample_rate_hz > 0);
  const double size = asReal(clip.samples.size());
  const auto first = static_cast<std::size_t>(std::clamp(span.start * clip.sample_rate_hz, 0.0, size));
  const auto last = static_cast<std::size_t>(std::clamp(span.end * clip.sample_rate_hz, 0.0, size));
  const std::span<const float> samples = std::span(clip.samples).first(last);
  BandMeter meter(kWindow, clip.sample_rate_hz, low_hz, high_hz);
  double sum = 0;
  std::size_t frames = 0;
  for (std::size_t start = first; start < last; start += kWindow / 2, ++frames) sum += meter.at(samples, start);
  return frames > 0 ? sum / asReal(frames) : 0.0;
}

std::vector<double> bandLevelsDb(const AudioClip& clip, double low_hz, double high_hz, Seconds step) {
  MOUTHPIECE_EXPECT(clip.sample_rate_hz > 0 && step > 0);
  constexpr Seconds kShortest = 0.02;
  constexpr double kLeast = 1e-12;
  const std::size_t size = std::bit_ceil(static_cast<std::size_t>(kShortest * clip.sample_rate_hz));
  std::vector<float> samples(size / 2, 0.0F);  // the first window's middle lies at 0
  samples.insert(samples.end(), clip.samples.begin(), clip.samples.end());
  BandMeter meter(size, clip.sample_rate_hz, low_hz, high_hz);
  std::vector<double> levels;
  for (std::size_t i = 0; asReal(i) * step <= clip.duration(); ++i) {
    const auto start = static_cast<std::size_t>(asReal(i) * step * clip.sample_rate_hz);
    levels.push_back(10 * std::log10(std::max(kLeast, meter.at(samples, start))));
  }
  return levels;
}

std::vector<double> speechLevelsDb(std::span<const std::int16_t> samples) {
  constexpr std::size_t kFrame = 160;
  constexpr double kFirstDifference = 0.97, kLeastDb = -10;
  std::vector<double> db;
  for (std::size_t at = 0; at + kFrame <= samples.size(); at += kFrame) {
    double energy = 0;
    for (std::size_t i = at; i < at + kFrame; ++i) {
      const double value = samples[i] - kFirstDifference * (i > 0 ? samples[i - 1] : 0);
      energy += value * value;
    }
    db.push_back(std::max(kLeastDb, 10 * std::log10(energy / kFrame + 1e-9)));
  }
  return db;
}

}  // namespace mouthpiece
