#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/errors.h"
#include "base/smooth_step.h"
#include "phonetics/language/phone.h"
#include "vocal/animation_curve.h"

namespace mouthpiece {
namespace {

/// The curve's key at a time, made by cutting it there: the curve itself does not change.
CurveKey cutAt(const AnimationCurve& curve, Seconds time) {
  const auto [in, out] = curve.slopesAt(time);
  return {time, curve.valueAt(time), in, out};
}

/// How far an edit is in force at a time of its span.
double forceAt(const CurveEdit& edit, Seconds time) {
  const Seconds fade = std::min(edit.fade, 0.5 * edit.span.duration());
  if (fade < kLeastKeyGap) return 1;
  return smoothStep((time - edit.span.start) / fade) * smoothStep((edit.span.end - time) / fade);
}

/// Keys inside the span: the curve's own, the fades' ends and points within the fades.
std::vector<Seconds> innerTimes(const AnimationCurve& curve, const CurveEdit& edit) {
  const Seconds fade = std::max(kLeastKeyGap, std::min(edit.fade, 0.5 * edit.span.duration()));
  std::vector<Seconds> times{edit.span.start + kLeastKeyGap, edit.span.end - kLeastKeyGap};
  for (const double share : {0.25, 0.5, 0.75, 1.0}) {
    times.push_back(edit.span.start + share * fade);
    times.push_back(edit.span.end - share * fade);
  }
  for (const CurveKey& key : curve.keys) times.push_back(key.time);
  std::erase_if(times, [&](Seconds time) {
    return time < edit.span.start + kLeastKeyGap || time > edit.span.end - kLeastKeyGap;
  });
  std::sort(times.begin(), times.end());
  times.erase(std::unique(times.begin(), times.end(), [](Seconds a, Seconds b) { return b - a < kLeastKeyGap; }),
              times.end());
  return times;
}

/// How fast the force grows, per second.
double forceSlopeAt(const CurveEdit& edit, Seconds time) {
  constexpr Seconds kStep = 1e-6;
  return (forceAt(edit, time + kStep) - forceAt(edit, time - kStep)) / (2 * kStep);
}

/// The edited curve's key at a time inside the span, with the slopes that the edit gives it.
CurveKey editedKey(const AnimationCurve& curve, const CurveEdit& edit, Seconds time) {
  const double force = forceAt(edit, time), force_slope = forceSlopeAt(edit, time);
  const double value = curve.valueAt(time);
  const auto [in, out] = curve.slopesAt(time);
  if (edit.kind == CurveEdit::Kind::kMute) {
    return {time, (1 - force) * value, (1 - force) * in - force_slope * value, (1 - force) * out - force_slope * value};
  }
  return {time, value + force * edit.value, in + force_slope * edit.value, out + force_slope * edit.value};
}

std::vector<CurveKey> editedKeys(const AnimationCurve& curve, const CurveEdit& edit) {
  std::vector<CurveKey> inner = edit.keys;
  if (edit.kind != CurveEdit::Kind::kReplace) {
    for (const Seconds time : innerTimes(curve, edit)) inner.push_back(editedKey(curve, edit, time));
  }
  std::erase_if(inner, [&](const CurveKey& key) {
    return key.time < edit.span.start + kLeastKeyGap || key.time > edit.span.end - kLeastKeyGap;
  });
  return inner;
}

AnimationCurve edited(AnimationCurve curve, const CurveEdit& edit) {
  const CurveKey first = cutAt(curve, edit.span.start), last = cutAt(curve, edit.span.end);
  std::vector<CurveKey> span_keys = editedKeys(curve, edit);
  span_keys.insert(span_keys.begin(), first);
  span_keys.push_back(last);
  if (edit.kind == CurveEdit::Kind::kReplace) span_keys = withMonotoneSlopes(std::move(span_keys));
  // The way in from before and out to after stays as it was, without a kink.
  span_keys.front() = first;
  span_keys.back() = last;
  const auto replaced = std::remove_if(curve.keys.begin(), curve.keys.end(), [&](const CurveKey& key) {
    return key.time >= edit.span.start - 0.5 * kLeastKeyGap && key.time <= edit.span.end + 0.5 * kLeastKeyGap;
  });
  curve.keys.erase(replaced, curve.keys.end());
  const auto place = std::partition_point(curve.keys.begin(), curve.keys.end(),
                                          [&](const CurveKey& key) { return key.time < edit.span.start; });
  curve.keys.insert(place, span_keys.begin(), span_keys.end());
  return curve;
}

/// How far beyond a viseme that is fully reached an edit may lead.
constexpr double kMostReached = 1.25;

bool isCurveName(std::string_view name) {
  if (name == "lipSpread" || name == "lipRound" || name == "larynx") return true;
  constexpr std::string_view kJaw = "_jaw";
  if (name.ends_with(kJaw)) name.remove_suffix(kJaw.size());
  for (std::size_t v = 1; v < kVisemeCount; ++v) {
    if (visemeName(static_cast<Viseme>(v)) == name) return true;
  }
  return false;
}

}  // namespace

CurveEdits usableEdits(const CurveEdits& edits, Seconds duration, std::vector<std::string>& warnings) {
  CurveEdits usable;
  std::string unknown;
  for (const CurveEdit& edit : edits) {
    if (!isCurveName(edit.curve)) {
      const std::string name = printable(edit.curve);
      if (unknown.find(name) == std::string::npos) unknown += (unknown.empty() ? "" : " ") + name;
      continue;
    }
    const bool is_whole = edit.kind == CurveEdit::Kind::kWhole;
    if (!is_whole && (edit.span.start >= duration || edit.span.end <= 0)) {
      warnings.push_back(
          fmt::format("an edit does not apply: {} from {:.2f} s to {:.2f} s lies beyond the line's end at "
                      "{:.2f} s",
                      edit.curve, edit.span.start, edit.span.end, duration));
      continue;
    }
    usable.push_back(edit);
  }
  if (!unknown.empty()) {
    std::string known = "lipSpread lipRound larynx";
    for (std::size_t v = 1; v < kVisemeCount; ++v) known += fmt::format(" {}", visemeName(static_cast<Viseme>(v)));
    warnings.push_back(fmt::format(
        "edits of curves that are none were left out: {} (there are: {}, and each with _jaw)", unknown, known));
  }
  return usable;
}

CurveSet withinLimits(CurveSet edited, const CurveSet& before, std::vector<std::string>& warnings) {
  for (AnimationCurve& curve : edited) {
    const AnimationCurve* was = findCurve(before, curve.name);
    if (was != nullptr && *was == curve) continue;
    const bool is_unit = curve.name == "lipSpread" || curve.name == "lipRound";
    double farthest = 0;
    for (CurveKey& key : curve.keys) {
      const double old = was == nullptr ? 0 : was->valueAt(key.time);
      const double value =
          std::clamp(key.value, std::min(is_unit ? -kMostReached : 0.0, old), std::max(kMostReached, old));
      if (value == key.value) continue;
      if (std::abs(key.value) > std::abs(farthest)) farthest = key.value;
      key = {key.time, value, 0, 0};
    }
    if (farthest != 0)
      warnings.push_back(fmt::format("an edit leads the curve {} to {:.2f}: held at what a face can do, {} to {}",
                                     curve.name, farthest, is_unit ? -kMostReached : 0.0, kMostReached));
  }
  return edited;
}

CurveSet withEdits(CurveSet curves, const CurveEdits& edits) {
  for (const CurveEdit& edit : edits) {
    auto found = std::find_if(curves.begin(), curves.end(),
                              [&](const AnimationCurve& curve) { return curve.name == edit.curve; });
    if (found == curves.end()) {
      if (edit.kind == CurveEdit::Kind::kMute) continue;
      found = curves.insert(found, AnimationCurve{edit.curve, {}});
    }
    *found =
        edit.kind == CurveEdit::Kind::kWhole ? AnimationCurve{edit.curve, edit.keys} : edited(std::move(*found), edit);
  }
  return sortedByName(std::move(curves));
}

}  // namespace mouthpiece
