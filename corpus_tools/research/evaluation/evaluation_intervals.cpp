#include "corpus_tools/research/evaluation/evaluation_intervals.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

namespace mouthpiece {

Interval bootstrapInterval(const EvaluationRow& row, const std::function<double(const LipMeasures&)>& measure) {
  constexpr std::size_t kDraws = 1000, kTail = 25;
  constexpr std::uint64_t kSeed = 1;
  std::mt19937_64 random(kSeed);
  std::vector<double> values;
  for (std::size_t draw = 0; draw < kDraws; ++draw) {
    LipMeasures drawn;
    for (std::size_t i = 0; i < row.takes.size(); ++i) drawn += row.takes[random() % row.takes.size()];
    const double value = measure(drawn);
    if (std::isfinite(value)) values.push_back(value);
  }
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  if (values.size() < kDraws / 2) return {kNone, kNone};
  std::sort(values.begin(), values.end());
  const std::size_t tail = kTail * values.size() / kDraws;
  return {values[tail], values[values.size() - 1 - tail]};
}

}  // namespace mouthpiece
