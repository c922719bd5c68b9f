#include "vocal/viseme_curves.h"

#include <algorithm>
#include <array>

#include "vocal/viseme_events.h"

namespace mouthpiece {
namespace {

/// One part of one viseme's curve under way, its last event still open at the end.
class GrowingCurve {
 public:
  explicit GrowingCurve(double vowel_coarticulation) : vowel_coarticulation_(vowel_coarticulation) {}

  /// `part`: how much the event brings of this part.
  void add(const VisemeEvent& event, double part) {
    if (!keys_.empty() && event.onset < end_) {
      joinOverlap(event.inner.front().time, part * event.inner.front().value);
    } else {
      if (!keys_.empty()) addKey(end_, 0);
      addKey(event.onset, 0);
    }
    for (const EventKey& key : event.inner) addKey(key.time, part * key.value);
    end_ = std::max(event.end, keys_.back().time + 1e-3);
  }

  std::vector<CurveKey> finish() {
    if (!keys_.empty()) addKey(end_, 0);
    return withMonotoneSlopes(std::move(keys_));
  }

 private:
  void addKey(Seconds time, double value) {
    constexpr Seconds kSameTime = 1e-6;
    if (!keys_.empty() && time < keys_.back().time + kSameTime) {
      keys_.back().value = std::max(keys_.back().value, value);
    } else {
      keys_.push_back({time, value, 0, 0});
    }
  }

  /// Replaces the overlapping boundary keys of two events (VOCAL figure 4).
  void joinOverlap(Seconds next, double next_value) {
    const CurveKey last = keys_.back();
    if (next <= last.time) return;
    const Seconds ahead = next - vocal_numbers::kOnset;
    const Seconds time = ahead > last.time ? ahead : 0.5 * (last.time + next);
    addKey(time, vowel_coarticulation_ * std::min(last.value, next_value));
  }

  double vowel_coarticulation_;
  std::vector<CurveKey> keys_;
  Seconds end_ = 0;
};

/// Lips that were shut part at once: from where a labial was held, its curve falls by its mean slope, not flatly. (With
/// a flat start the vowels after B P M stayed shut at their edge, which those of GRID s1 are not.)
std::vector<CurveKey> lettingGoAtOnce(std::vector<CurveKey> keys, const std::vector<const VisemeEvent*>& events) {
  for (const VisemeEvent* event : events) {
    if (!isLabial(event->viseme)) continue;
    const auto held = std::find_if(keys.begin(), keys.end(),
                                   [&](const CurveKey& key) { return key.time == event->inner.back().time; });
    if (held == keys.end() || held + 1 == keys.end() || (held + 1)->value >= held->value) continue;
    held->out = ((held + 1)->value - held->value) / ((held + 1)->time - held->time);
  }
  return keys;
}

AnimationCurve partCurve(const std::vector<const VisemeEvent*>& events, double VisemeEvent::*part, std::string name,
                         double vowel_coarticulation) {
  GrowingCurve curve(vowel_coarticulation);
  for (const VisemeEvent* event : events) {
    if (event->*part > 0) curve.add(*event, event->*part);
  }
  return {std::move(name), lettingGoAtOnce(curve.finish(), events)};
}

}  // namespace

std::string jawCurveName(Viseme viseme) { return std::string(visemeName(viseme)) + "_jaw"; }

CurveSet curvesFromEvents(const std::vector<VisemeEvent>& events, double vowel_coarticulation) {
  std::array<std::vector<const VisemeEvent*>, kVisemeCount> by_viseme;
  for (const VisemeEvent& event : events) by_viseme[static_cast<std::size_t>(event.viseme)].push_back(&event);
  CurveSet curves;
  for (std::size_t v = 0; v < kVisemeCount; ++v) {
    const auto viseme = static_cast<Viseme>(v);
    const auto& own = by_viseme[v];
    if (own.empty()) continue;
    curves.push_back(partCurve(own, &VisemeEvent::lips, std::string(visemeName(viseme)), vowel_coarticulation));
    const bool parts_differ =
        std::any_of(own.begin(), own.end(), [](const VisemeEvent* event) { return event->lips != event->jaw; });
    if (parts_differ) curves.push_back(partCurve(own, &VisemeEvent::jaw, jawCurveName(viseme), vowel_coarticulation));
  }
  return sortedByName(std::move(curves));
}

CurveSet visemeCurves(const SpeechLabels& labels, const AudioTags& tags, StyleExtreme extreme) {
  std::vector<VisemeEvent> events = fourKeyEvents(labels);
  if (extreme.pitch_sensitive) events = withSungInternalKeys(std::move(events), tags);
  events = coarticulated(std::move(events), labels);
  if (extreme.melodic) events = withSungBoundaryKeys(std::move(events));
  return curvesFromEvents(events, extreme.melodic ? kSongCoarticulation : kSpeechCoarticulation);
}

}  // namespace mouthpiece
