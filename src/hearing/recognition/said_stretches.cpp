#include "hearing/recognition/said_stretches.h"

#include <algorithm>

#include "base/index.h"
#include "hearing/alignment/samples_to_hear.h"

namespace mouthpiece {
namespace {

constexpr Seconds kLongestHeard = 20;
/// What a network gets of the sound around a stretch: a word's beginning may lie below what is found as speech.
constexpr Seconds kMargin = 0.2;

/// Stretches of speech; those that lie no farther apart than `pause` are one, kLongestHeard at most.
std::vector<TimeSpan> toHear(const std::vector<SoundStretch>& stretches, Seconds pause) {
  std::vector<TimeSpan> spans;
  bool is_next = false;  // nothing else than a pause lies before it
  for (const SoundStretch& stretch : stretches) {
    const bool is_speech = stretch.kind == SoundKind::kSpeech;
    if (is_speech && is_next && stretch.span.start - spans.back().end < pause &&
        stretch.span.end - spans.back().start <= kLongestHeard) {
      spans.back().end = stretch.span.end;
    } else if (is_speech) {
      spans.push_back(stretch.span);
    }
    is_next = is_speech;
  }
  return spans;
}

}  // namespace

std::vector<Said> whatIsSaid(std::span<const std::int16_t> samples, const std::vector<SoundStretch>& stretches,
                             Seconds pause) {
  const auto samplesOf = [&](Seconds start, Seconds end) {
    const auto at = [&](Seconds time) {
      return std::min(samples.size(), static_cast<std::size_t>(std::max(0.0, time) * SamplesToHear::kRateHz));
    };
    return samples.subspan(at(start), std::max(at(start), at(end)) - at(start));
  };
  std::vector<Said> said;
  const std::vector<TimeSpan> spans = toHear(stretches, pause);
  for (std::size_t i = 0; i < spans.size(); ++i) {
    const TimeSpan& span = spans[i];
    if (samplesOf(span.start, span.end).empty()) continue;
    // What is said before and after is not heard twice.
    const Seconds before = i > 0 ? spans[i - 1].end : 0;
    const Seconds after = i + 1 < spans.size() ? spans[i + 1].start : asReal(samples.size()) / SamplesToHear::kRateHz;
    said.push_back({span.start, samplesOf(span.start, span.end),
                    samplesOf(std::max(before, span.start - kMargin), std::min(after, span.end + kMargin))});
  }
  return said;
}

}  // namespace mouthpiece
