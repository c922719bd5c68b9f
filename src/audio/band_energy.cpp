#include <algorithm>
#include <cmath>
#include <numbers>
#include <unsupported/Eigen/FFT>
#include <vector>

#include "audio/spectral_frames.h"
#include "base/errors.h"
#include "base/index.h"

namespace mouthpiece {
namespace {

constexpr std::size_t kWindow = 512;

/// A Hann window's energies sum to its length times 3/8.
std::vector<double> hannWindow() {
  std::vector<double> window(kWindow);
  for (std::size_t i = 0; i < kWindow; ++i) {
    window[i] = 0.5 - 0.5 * std::cos(2 * std::numbers::pi * asReal(i) / kWindow);
  }
  return window;
}

}  // namespace

double bandEnergy(const AudioClip& clip, const TimeSpan& span, double low_hz, double high_hz) {
  MOUTHPIECE_EXPECT(clip.sample_rate_hz > 0);
  static const std::vector<double> window = hannWindow();
  const double size = asReal(clip.samples.size());
  const auto first = static_cast<std::size_t>(std::clamp(span.start * clip.sample_rate_hz, 0.0, size));
  const auto last = static_cast<std::size_t>(std::clamp(span.end * clip.sample_rate_hz, 0.0, size));
  Eigen::FFT<double> transform;
  transform.SetFlag(Eigen::FFT<double>::HalfSpectrum);
  std::vector<double> frame(kWindow);
  std::vector<std::complex<double>> spectrum;
  double sum = 0;
  std::size_t frames = 0;
  for (std::size_t start = first; start < last; start += kWindow / 2, ++frames) {
    for (std::size_t i = 0; i < kWindow; ++i) {
      frame[i] = start + i < last ? window[i] * clip.samples[start + i] : 0.0;
    }
    transform.fwd(spectrum, frame);
    for (std::size_t bin = 1; bin < kWindow / 2; ++bin) {
      const double hz = asReal(bin) * clip.sample_rate_hz / kWindow;
      if (hz >= low_hz && hz < high_hz) sum += 2 * std::norm(spectrum[bin]);
    }
  }
  // Parseval: the mean of |x w|^2 over the window is the sum of |X|^2 over the window's length squared.
  return frames > 0 ? sum / asReal(frames) / (kWindow * kWindow * 3.0 / 8.0) : 0.0;
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
