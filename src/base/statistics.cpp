#include "base/statistics.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/errors.h"
#include "base/index.h"

namespace mouthpiece {
namespace {

/// Puts the value of that rank in its place, with none that is greater before it.
std::vector<double>::iterator select(std::vector<double>& values, double rank) {
  const auto place = values.begin() + static_cast<std::ptrdiff_t>(rank);
  std::nth_element(values.begin(), place, values.end());
  return place;
}

double rankOf(const std::vector<double>& values, double share) {
  MOUTHPIECE_EXPECT(share >= 0 && share <= 1);
  return share * static_cast<double>(values.size() - 1);
}

}  // namespace

double median(std::vector<double> values, double if_none) {
  return values.empty() ? if_none : *select(values, std::floor(static_cast<double>(values.size()) / 2));
}

double quantile(std::vector<double> values, double share, double if_none) {
  return values.empty() ? if_none : *select(values, rankOf(values, share));
}

double interpolatedQuantile(std::vector<double> values, double share, double if_none) {
  if (values.empty()) return if_none;
  const double rank = rankOf(values, share);
  const auto below = select(values, rank);
  const double above = below + 1 == values.end() ? *below : *std::min_element(below + 1, values.end());
  return std::lerp(*below, above, rank - std::floor(rank));
}

double leastMean(std::span<const double> values, std::size_t count) {
  count = std::min(count, values.size());
  double sum = std::accumulate(values.begin(), values.begin() + signedIndex(count), 0.0), least = sum;
  for (std::size_t i = count; i < values.size(); ++i) {
    sum += values[i] - values[i - count];
    least = std::min(least, sum);
  }
  return least / asReal(count);
}

}  // namespace mouthpiece
