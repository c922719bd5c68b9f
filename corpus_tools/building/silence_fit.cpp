#include "corpus_tools/building/prediction_parts.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "base/statistics.h"

namespace mouthpiece {
namespace {

/// A silence before speech, and how long before its end the mouth was half open.
struct Breath {
  Seconds silence = 0, opened = 0;
};

/// None where the silence is short, hidden or the mouth does not open in it.
std::optional<Breath> breathOf(const FitTake& take, const SpeechLabels& labels) {
  constexpr Seconds kShortest = 0.25, kAtRest = 0.10;
  constexpr double kLeastOpening = 0.25;  // of what the take's opening spans
  if (labels.phones.size() < 3 || labels.phones.front().phone != Phone::kSil) return std::nullopt;
  const Seconds speech = labels.phones.front().span.end;
  if (speech < kShortest) return std::nullopt;
  std::vector<double> at_rest, all;
  double widest = 0;
  for (std::size_t row = 0; row < take.times.size(); ++row) {
    const bool is_silent = take.times[row] < speech;
    if (!(take.seen(signedIndex(row)) > 0)) {
      if (is_silent) return std::nullopt;
      continue;
    }
    const double opening = take.openings(signedIndex(row));
    all.push_back(opening);
    if (take.times[row] <= kAtRest) at_rest.push_back(opening);
    if (is_silent) widest = std::max(widest, opening);
  }
  if (at_rest.empty()) return std::nullopt;
  const auto [least, most] = std::minmax_element(all.begin(), all.end());
  const double rest = median(std::move(at_rest), 0.0);
  if (widest - rest < kLeastOpening * (*most - *least)) return std::nullopt;
  const double half = 0.5 * (rest + widest);
  for (std::size_t row = 1; row < take.times.size(); ++row) {
    const double before = take.openings(signedIndex(row) - 1), after = take.openings(signedIndex(row));
    if (after < half || before >= half) continue;
    const Seconds moment = std::lerp(take.times[row - 1], take.times[row], (half - before) / (after - before));
    return moment < speech ? std::optional(Breath{speech, speech - moment}) : std::nullopt;
  }
  return std::nullopt;  // it is open from the beginning
}

}  // namespace

SilenceTiming fitSilenceTiming(const std::vector<FitTake>& takes, const Corpus& corpus) {
  constexpr std::size_t kLeastTakes = 8;
  constexpr double kUsualCounts = 20, kMostShare = 0.8, kOutermost = 0.05;
  constexpr Seconds kHalfSecond = 0.5, kLeast = 0.1, kLongest = 1;
  std::vector<double> silences;
  double count = 0, x = 0, y = 0, xx = 0, xy = 0;
  for (const FitTake& take : takes) {
    const std::optional<Breath> breath = breathOf(take, corpus.takes[take.index].labels);
    if (!breath) continue;
    const double beyond = breath->silence - kHalfSecond;
    silences.push_back(breath->silence);
    count += 1;
    x += beyond;
    y += breath->opened;
    xx += beyond * beyond;
    xy += beyond * breath->opened;
  }
  SilenceTiming timing;
  if (silences.size() < kLeastTakes) return timing;
  const double spread = xx - x * x / count;
  const double slope = spread > 1e-6 ? std::clamp((xy - x * y / count) / spread, 0.0, kMostShare) : 0.0;
  const double believed = count / (count + kUsualCounts);
  timing.breath_share = believed * slope;
  timing.breath_at_half_second =
      std::lerp(timing.breath_at_half_second, std::max(0.0, (y - slope * x) / count), believed);
  timing.least_breath = 0;
  timing.most_breath = kLongest;
  const Seconds shortest = timing.breathIn(quantile(silences, kOutermost));
  const Seconds longest = timing.breathIn(quantile(silences, 1 - kOutermost));
  timing.least_breath = std::max(kLeast, shortest);
  timing.most_breath = std::max(timing.least_breath, longest);
  return timing;
}

}  // namespace mouthpiece
