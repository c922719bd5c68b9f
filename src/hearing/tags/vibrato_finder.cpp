#include "hearing/tags/pitch_contour.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "base/index.h"

namespace mouthpiece {
namespace {

/// A peak lies within this share of a period from the middle of its neighbours: "a similar distance apart".
constexpr double kLeastHalf = 0.25, kMostHalf = 0.75;
/// Neighbouring periods differ by no more than this.
constexpr double kMostPeriodRatio = 1.35;
/// People's periods scatter: the paper's bounds hold the mean of a run, and each period within this factor.
constexpr double kPeriodScatter = 1.15;
/// Of a period, before the first peak and after the last one: there the pitch swings already, and still.
constexpr double kBeyondPeaks = 0.25;

/// Semitones, smoothed over 50 ms (binomial): single wrong samples make no peak.
std::vector<double> smoothSemitones(std::span<const double> pitch_hz) {
  constexpr std::array<double, 5> kWeights{1. / 16, 4. / 16, 6. / 16, 4. / 16, 1. / 16};
  const std::ptrdiff_t count = std::ssize(pitch_hz);
  std::vector<double> smooth;
  for (std::ptrdiff_t i = 0; i < count; ++i) {
    double sum = 0;
    for (std::ptrdiff_t k = -2; k <= 2; ++k) {
      const std::size_t at = unsignedIndex(std::clamp<std::ptrdiff_t>(i + k, 0, count - 1));
      sum += kWeights[unsignedIndex(k + 2)] * 12 * std::log2(pitch_hz[at]);
    }
    smooth.push_back(sum);
  }
  return smooth;
}

/// Zero crossings of the finite differences, in samples.
std::vector<double> peaksOf(const std::vector<double>& values) {
  std::vector<double> peaks;
  double before = 0;
  double before_at = 0;
  for (std::size_t i = 0; i + 1 < values.size(); ++i) {
    const double slope = values[i + 1] - values[i];
    const double at = asReal(i) + 0.5;
    if (slope == 0) continue;
    if (before * slope < 0) peaks.push_back(before_at + (at - before_at) * before / (before - slope));
    before = slope;
    before_at = at;
  }
  return peaks;
}

class RunFinder {
 public:
  RunFinder(std::span<const double> pitch_hz, const VibratoOptions& options)
      : options_(options), pitch_hz_(pitch_hz), semitones_(smoothSemitones(pitch_hz)), peaks_(peaksOf(semitones_)) {}

  std::vector<VibratoRun> find() {
    for (std::size_t i = 0; i + 2 < peaks_.size();) {
      std::size_t last = i;
      if (isPeriod(i)) {
        last = i + 2;
        while (last + 1 < peaks_.size() && isPeriod(last - 1) && isSimilar(last - 1)) ++last;
      }
      if (last > i + 2) {
        add(i, last);
        i = last;
      } else {
        ++i;
      }
    }
    return std::move(runs_);
  }

 private:
  [[nodiscard]] double period(std::size_t peak) const { return (peaks_[peak + 2] - peaks_[peak]) / options_.rate_hz; }

  /// Semitones from peak to peak.
  [[nodiscard]] double swing(std::size_t peak) const {
    return std::abs(semitonesAt(peaks_[peak + 1]) - semitonesAt(peaks_[peak]));
  }
  [[nodiscard]] double semitonesAt(double place) const {
    return semitones_[std::min(unsignedIndex(std::lround(place)), semitones_.size() - 1)];
  }

  /// Peaks i, i + 1, i + 2 are one period of the right length, up as far as down.
  [[nodiscard]] bool isPeriod(std::size_t i) const {
    const double share = (peaks_[i + 1] - peaks_[i]) / options_.rate_hz / period(i);
    return period(i) >= 1 / options_.fastest_hz / kPeriodScatter &&
           period(i) <= 1 / options_.slowest_hz * kPeriodScatter && share > kLeastHalf && share < kMostHalf &&
           std::max(swing(i), swing(i + 1)) < options_.most_swing_ratio * std::min(swing(i), swing(i + 1));
  }

  [[nodiscard]] bool isSimilar(std::size_t i) const {
    return std::max(period(i), period(i - 1)) < kMostPeriodRatio * std::min(period(i), period(i - 1));
  }

  void add(std::size_t first_peak, std::size_t last_peak) {
    const double half_periods = asReal(last_peak - first_peak);
    const double seconds = (peaks_[last_peak] - peaks_[first_peak]) / options_.rate_hz;
    VibratoRun run{.first = unsignedIndex(std::lround(std::ceil(peaks_[first_peak]))),
                   .last = unsignedIndex(std::lround(std::floor(peaks_[last_peak]))),
                   .rate_hz = half_periods / 2 / seconds};
    double depth = 0;
    for (std::size_t peak = first_peak; peak < last_peak; ++peak) {
      depth += std::abs(rawAt(peaks_[peak + 1]) - rawAt(peaks_[peak])) / 2;
    }
    run.depth_semitones = depth / half_periods;
    const bool is_in_range = run.rate_hz >= options_.slowest_hz && run.rate_hz <= options_.fastest_hz;
    if (half_periods / 2 > options_.least_periods && is_in_range &&
        deviation(run) < options_.most_deviation_semitones && run.depth_semitones >= options_.least_depth_semitones) {
      // Nothing lies beyond a peak that is half a swing: there the vibrato only begins.
      const double reach = kBeyondPeaks * options_.rate_hz / run.rate_hz;
      const auto reachBeyond = [&](std::size_t peak) { return swing(peak) >= run.depth_semitones ? reach : 0; };
      const double first = peaks_[first_peak] - reachBeyond(first_peak);
      const double last = peaks_[last_peak] + reachBeyond(last_peak - 1);
      const double earliest = runs_.empty() ? 0 : asReal(runs_.back().last);
      run.first = unsignedIndex(std::lround(std::ceil(std::max(earliest, first))));
      run.last = std::min(semitones_.size() - 1, unsignedIndex(std::lround(std::floor(last))));
      runs_.push_back(run);
    }
  }

  /// The pitch itself near a peak: smoothing takes a tenth of a 7 Hz vibrato off.
  [[nodiscard]] double rawAt(double place) const {
    const std::size_t at = unsignedIndex(std::lround(place));
    return 12 * std::log2(pitch_hz_[std::min(at, pitch_hz_.size() - 1)]);
  }

  [[nodiscard]] double deviation(const VibratoRun& run) const {
    const auto begin = semitones_.begin() + signedIndex(run.first);
    const auto end = semitones_.begin() + signedIndex(run.last) + 1;
    const double n = asReal(end - begin);
    const double mean = std::accumulate(begin, end, 0.0) / n;
    const double squares =
        std::accumulate(begin, end, 0.0, [&](double sum, double v) { return sum + (v - mean) * (v - mean); });
    return std::sqrt(squares / n);
  }

  const VibratoOptions& options_;
  std::span<const double> pitch_hz_;
  std::vector<double> semitones_;
  std::vector<double> peaks_;
  std::vector<VibratoRun> runs_;
};

}  // namespace

std::vector<VibratoRun> findVibrato(std::span<const double> pitch_hz, const VibratoOptions& options) {
  if (pitch_hz.size() < 3) return {};
  return RunFinder(pitch_hz, options).find();
}

}  // namespace mouthpiece
