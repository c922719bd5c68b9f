#include "hearing/alignment/phone_decoder.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/index.h"
#include "base/statistics.h"

namespace mouthpiece {
namespace {

/// The change at a frame: between the means of this many frames before and after it.
constexpr std::ptrdiff_t kReach = 3;
/// Frames beside a change are heard as it is.
constexpr std::ptrdiff_t kBeside = 3;
/// Loudness changes with the melody too: it counts less than the sound's colour.
constexpr double kEnergyWeight = 0.1;
/// What even the steadiest tenth of the frames changes by is noise.
constexpr double kNoiseShare = 0.1;
/// The least share of frames that are heard.
constexpr double kLeastShare = 0.03;
/// Frames of digital silence change by this: where there is nothing else, they are heard evenly.
constexpr double kLeastChange = 1e-4;

double changeAt(const std::vector<std::vector<float>>& cepstra, std::ptrdiff_t at) {
  const auto last = signedIndex(cepstra.size()) - 1;
  double squares = 0;
  for (std::size_t k = 0; k < cepstra.front().size(); ++k) {
    double difference = 0;
    for (std::ptrdiff_t step = 1; step <= kReach; ++step) {
      difference += cepstra[unsignedIndex(std::min(last, at + step))][k] -
                    cepstra[unsignedIndex(std::max<std::ptrdiff_t>(0, at - step))][k];
    }
    difference /= kReach;
    squares += (k == 0 ? kEnergyWeight : 1) * difference * difference;
  }
  return squares;
}

/// How fast the spectrum changes, squared, above what noise makes; spread over the frames beside.
std::vector<double> squaredChanges(const std::vector<std::vector<float>>& cepstra) {
  const auto count = signedIndex(cepstra.size());
  std::vector<double> changes;
  for (std::ptrdiff_t i = 0; i < count; ++i) changes.push_back(changeAt(cepstra, i));
  const double floor = quantile(changes, kNoiseShare);
  std::vector<double> spread;
  for (std::ptrdiff_t i = 0; i < count; ++i) {
    const auto first = changes.begin() + std::max<std::ptrdiff_t>(0, i - kBeside);
    const auto end = changes.begin() + std::min(count, i + kBeside + 1);
    spread.push_back(std::max(kLeastChange, *std::max_element(first, end) - floor));
  }
  return spread;
}

/// The share of a frame that is heard where the spectrum changes like this; all of it from `fast` on.
double shareOf(double squared_change, double fast) { return std::clamp(squared_change / fast, kLeastShare, 1.0); }

/// The change from which on every frame is heard, so that `wanted` are in all.
double fastChange(const std::vector<double>& squared_changes, double wanted) {
  double low = 1e-6, high = 1e8;
  for (int i = 0; i < 60; ++i) {
    const double fast = std::sqrt(low * high);
    const double heard = std::accumulate(squared_changes.begin(), squared_changes.end(), 0.0,
                                         [&](double sum, double change) { return sum + shareOf(change, fast); });
    (heard > wanted ? low : high) = fast;
  }
  return std::sqrt(low * high);
}

}  // namespace

std::vector<std::size_t> thinFrames(const std::vector<std::vector<float>>& cepstra, std::size_t wanted) {
  std::vector<std::size_t> kept(cepstra.size());
  std::iota(kept.begin(), kept.end(), std::size_t{0});
  if (cepstra.size() <= wanted) return kept;
  const std::vector<double> changes = squaredChanges(cepstra);
  const double fast = fastChange(changes, asReal(wanted));
  kept.clear();
  double progress = 1;  // the first frame is heard
  for (std::size_t i = 0; i < cepstra.size(); ++i) {
    progress += shareOf(changes[i], fast);
    if (progress < 1 && i + 1 < cepstra.size()) continue;
    kept.push_back(i);
    progress -= std::floor(progress);
  }
  return kept;
}

}  // namespace mouthpiece
