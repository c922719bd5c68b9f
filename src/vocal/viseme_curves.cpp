#include "vocal/viseme_curves.h"

#include <algorithm>
#include <array>

#include "vocal/singing_events.h"

namespace mouthpiece {
namespace {

/// One viseme's keys under way, its last event still open at the end.
struct GrowingCurve {
  std::vector<CurveKey> keys;
  Seconds last_inner = 0;
  bool open = false;
};

void addKey(GrowingCurve& curve, Seconds time, double value) {
  constexpr Seconds kSameTime = 1e-6;
  if (!curve.keys.empty() && time < curve.keys.back().time + kSameTime) {
    curve.keys.back().value = std::max(curve.keys.back().value, value);
    return;
  }
  curve.keys.push_back({time, value, 0, 0});
}

/// Replaces the overlapping boundary keys of two events (VOCAL figure 4).
void joinOverlap(GrowingCurve& curve, const VisemeEvent& event, double first_value, double vowel_coarticulation) {
  const CurveKey last = curve.keys.back();
  const Seconds next = event.inner.front().time;
  if (next <= last.time) return;
  const Seconds ahead = next - vocal_numbers::kOnset;
  const Seconds time = ahead > last.time ? ahead : 0.5 * (last.time + next);
  addKey(curve, time, vowel_coarticulation * std::min(last.value, first_value));
}

void addEvent(GrowingCurve& curve, const VisemeEvent& event, double part, double vowel_coarticulation, Seconds& end) {
  if (curve.open && event.onset < end) {
    joinOverlap(curve, event, part * event.inner.front().value, vowel_coarticulation);
  } else {
    if (curve.open) addKey(curve, end, 0);
    addKey(curve, event.onset, 0);
  }
  for (const EventKey& key : event.inner) addKey(curve, key.time, part * key.value);
  end = std::max(event.end, curve.keys.back().time + 1e-3);
  curve.open = true;
}

/// Lips that were shut part at once: from where a labial was held, its curve falls by its mean slope, not flatly. (With
/// a flat start the vowels after B P M stayed shut at their edge, which those of GRID s1 are not.)
void letGoAtOnce(const std::vector<const VisemeEvent*>& events, std::vector<CurveKey>& keys) {
  for (const VisemeEvent* event : events) {
    if (!isLabial(event->viseme)) continue;
    const auto held = std::find_if(keys.begin(), keys.end(),
                                   [&](const CurveKey& key) { return key.time == event->inner.back().time; });
    if (held == keys.end() || held + 1 == keys.end() || (held + 1)->value >= held->value) continue;
    held->out = ((held + 1)->value - held->value) / ((held + 1)->time - held->time);
  }
}

AnimationCurve partCurve(const std::vector<const VisemeEvent*>& events, double VisemeEvent::*part, std::string name,
                         double vowel_coarticulation) {
  GrowingCurve curve;
  Seconds end = 0;
  for (const VisemeEvent* event : events) {
    if (event->*part > 0) addEvent(curve, *event, event->*part, vowel_coarticulation, end);
  }
  if (curve.open) addKey(curve, end, 0);
  setMonotoneSlopes(curve.keys);
  letGoAtOnce(events, curve.keys);
  return {std::move(name), std::move(curve.keys)};
}

}  // namespace

const AnimationCurve* findCurve(const CurveSet& curves, std::string_view name) {
  const auto found =
      std::find_if(curves.begin(), curves.end(), [&](const AnimationCurve& curve) { return curve.name == name; });
  return found == curves.end() ? nullptr : &*found;
}

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
  std::sort(curves.begin(), curves.end(),
            [](const AnimationCurve& a, const AnimationCurve& b) { return a.name < b.name; });
  return curves;
}

CurveSet visemeCurves(const SpeechLabels& labels, const AudioTags& tags, StyleExtreme extreme) {
  std::vector<VisemeEvent> events = fourKeyEvents(labels);
  if (extreme.pitch_sensitive) singInternalKeys(events, tags);
  events = coarticulated(std::move(events), labels);
  if (extreme.melodic) singBoundaryKeys(events);
  return curvesFromEvents(events, extreme.melodic ? kSongCoarticulation : kSpeechCoarticulation);
}

}  // namespace mouthpiece
