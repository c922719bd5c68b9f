#include "hearing/recognition/said_stretches.h"

#include <algorithm>

#include "base/index.h"
#include "hearing/alignment/phone_ear.h"
#include "hearing/alignment/samples_to_hear.h"
#include "hearing/network/network_phones.h"

namespace mouthpiece {
namespace {

/// What a network gets of the sound around a stretch: a word's beginning may lie below what is found as speech.
constexpr Seconds kMargin = 0.2;
/// So much on either side tells what noise a stretch is said in: a short word alone has no pause.
constexpr Seconds kToJudge = 2.0;

/// Where a network hears phones, with pauses up to findSpeech()'s; of kLongestStretch at most each.
std::vector<TimeSpan> heardSpans(const HeardPhones& heard) {
  constexpr Seconds kPause = 0.35;
  std::vector<TimeSpan> spans;
  for (Eigen::Index frame = 0; frame < heard.cols(); ++frame) {
    if (!isPhone(heard.col(frame))) continue;
    const Seconds start = asReal(frame) * kEarStep + kEarShift, end = start + kEarStep;
    if (!spans.empty() && start - spans.back().end < kPause && end - spans.back().start <= kLongestStretch)
      spans.back().end = end;
    else
      spans.push_back({start, end});
  }
  return spans;
}

/// Stretches of speech; those that lie no farther apart than `pause` are one, kLongestStretch at most.
std::vector<TimeSpan> toHear(const std::vector<SoundStretch>& stretches, Seconds pause) {
  std::vector<TimeSpan> spans;
  bool is_next = false;  // nothing else than a pause lies before it
  for (const SoundStretch& stretch : stretches) {
    const bool is_speech = stretch.kind == SoundKind::kSpeech;
    if (is_speech && is_next && stretch.span.start - spans.back().end < pause &&
        stretch.span.end - spans.back().start <= kLongestStretch) {
      spans.back().end = stretch.span.end;
    } else if (is_speech) {
      spans.push_back(stretch.span);
    }
    is_next = is_speech;
  }
  return spans;
}

}  // namespace

Seconds heardAsPhones(const HeardPhones& heard) {
  Seconds time = 0;
  for (Eigen::Index frame = 0; frame < heard.cols(); ++frame) time += isPhone(heard.col(frame)) ? kEarStep : 0;
  return time;
}

std::vector<SoundStretch> withHeardSpeech(std::vector<SoundStretch> stretches, const HeardPhones& heard) {
  constexpr Seconds kShortest = 0.1, kTouches = 1e-6;
  std::vector<SoundStretch> all;
  auto next = stretches.begin();
  const auto add = [&](const SoundStretch& stretch) {
    const bool goes_on = !all.empty() && all.back().kind == SoundKind::kSpeech && stretch.kind == SoundKind::kSpeech &&
                         stretch.span.start - all.back().span.end < kTouches &&
                         stretch.span.end - all.back().span.start <= kLongestStretch;
    if (goes_on)
      all.back() = {{all.back().span.start, stretch.span.end}, SoundKind::kSpeech, false};
    else
      all.push_back(stretch);
  };
  for (TimeSpan span : heardSpans(heard)) {
    if (span.duration() < kShortest) continue;
    for (; next != stretches.end() && next->span.start < span.end; ++next) {
      if (next->span.start > span.start) add({{span.start, next->span.start}});
      add(*next);
      span.start = std::max(span.start, next->span.end);
    }
    if (!all.empty()) span.start = std::max(span.start, all.back().span.end);
    if (span.duration() > 0) add({span});
  }
  std::for_each(next, stretches.end(), add);
  return all;
}

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
                    samplesOf(std::max(before, span.start - kMargin), std::min(after, span.end + kMargin)),
                    samplesOf(span.start - kToJudge, span.end + kToJudge)});
  }
  return said;
}

}  // namespace mouthpiece
