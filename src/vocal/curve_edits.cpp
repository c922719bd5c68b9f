#include "vocal/curve_edits.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "base/errors.h"
#include "base/files.h"
#include "base/smooth_step.h"

namespace mouthpiece {
namespace {

using nlohmann::json;

constexpr std::uint64_t kMaxFileBytes = 1 << 24;
constexpr std::size_t kMostEdits = 10000;
constexpr double kLargestNumber = 1e5;
constexpr Seconds kLeastGap = 1e-4;  ///< two keys no closer than this

double numberOf(const json& entry, const char* name, const std::string& place, std::string_view file) {
  const auto found = entry.find(name);
  if (found == entry.end() || !found->is_number() || !(std::abs(found->get<double>()) < kLargestNumber))
    throw InputError(file, place, fmt::format("found no number {}; expected one", name));
  return found->get<double>();
}

/// "" where there is none.
std::string textOf(const json& entry, const char* name) {
  const auto found = entry.find(name);
  return found != entry.end() && found->is_string() ? found->get<std::string>() : std::string();
}

std::vector<CurveKey> keysFrom(const json& entry, const TimeSpan& span, const std::string& place,
                               std::string_view file) {
  const auto found = entry.find("keys");
  if (found == entry.end() || !found->is_array() || found->empty())
    throw InputError(file, place, "found no keys; expected a list of time_s and value");
  std::vector<CurveKey> keys;
  for (const json& key : *found) {
    if (!key.is_object()) throw InputError(file, place, "found a key that is no object");
    keys.push_back({numberOf(key, "time_s", place, file), numberOf(key, "value", place, file), 0, 0});
    const Seconds time = keys.back().time;
    if (time < span.start || time > span.end)
      throw InputError(file, place, fmt::format("found a key at {} s; expected it inside the span", time));
    if (keys.size() > 1 && time < keys[keys.size() - 2].time + kLeastGap)
      throw InputError(file, place, "found key times that do not rise; expected rising times");
  }
  return keys;
}

CurveEdit editFrom(const json& entry, const std::string& place, std::string_view file) {
  if (!entry.is_object()) throw InputError(file, place, "found no object; expected an edit");
  CurveEdit edit;
  const std::string kind = textOf(entry, "kind");
  edit.curve = textOf(entry, "curve");
  if (edit.curve.empty()) throw InputError(file, place, "found no curve; expected the name of one");
  edit.span = {numberOf(entry, "start_s", place, file), numberOf(entry, "end_s", place, file)};
  if (edit.span.duration() < 2 * kLeastGap)
    throw InputError(file, place, "found an empty span; expected end_s after start_s");
  if (kind == "offset") {
    edit.value = numberOf(entry, "value", place, file);
  } else if (kind == "replace") {
    edit.kind = CurveEdit::Kind::kReplace;
    edit.keys = keysFrom(entry, edit.span, place, file);
  } else if (kind == "mute") {
    edit.kind = CurveEdit::Kind::kMute;
  } else {
    throw InputError(file, place,
                     fmt::format("found the kind '{}'; expected offset, replace or mute", printable(kind)));
  }
  if (entry.contains("fade_s")) edit.fade = numberOf(entry, "fade_s", place, file);
  if (edit.fade < 0) throw InputError(file, place, "found a fade_s under 0; expected 0 or more");
  return edit;
}

/// The curve's key at a time, made by cutting it there: the curve itself does not change.
CurveKey cutAt(const AnimationCurve& curve, Seconds time) {
  const auto [in, out] = curve.slopesAt(time);
  return {time, curve.valueAt(time), in, out};
}

/// How far an edit is in force at a time of its span.
double forceAt(const CurveEdit& edit, Seconds time) {
  const Seconds fade = std::min(edit.fade, 0.5 * edit.span.duration());
  if (fade < kLeastGap) return 1;
  return smoothStep((time - edit.span.start) / fade) * smoothStep((edit.span.end - time) / fade);
}

/// Keys inside the span: the curve's own, the fades' ends and points within the fades.
std::vector<Seconds> innerTimes(const AnimationCurve& curve, const CurveEdit& edit) {
  const Seconds fade = std::max(kLeastGap, std::min(edit.fade, 0.5 * edit.span.duration()));
  std::vector<Seconds> times{edit.span.start + kLeastGap, edit.span.end - kLeastGap};
  for (const double share : {0.25, 0.5, 0.75, 1.0}) {
    times.push_back(edit.span.start + share * fade);
    times.push_back(edit.span.end - share * fade);
  }
  for (const CurveKey& key : curve.keys) times.push_back(key.time);
  std::erase_if(times,
                [&](Seconds time) { return time < edit.span.start + kLeastGap || time > edit.span.end - kLeastGap; });
  std::sort(times.begin(), times.end());
  times.erase(std::unique(times.begin(), times.end(), [](Seconds a, Seconds b) { return b - a < kLeastGap; }),
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
    return key.time < edit.span.start + kLeastGap || key.time > edit.span.end - kLeastGap;
  });
  return inner;
}

void applyEdit(AnimationCurve& curve, const CurveEdit& edit) {
  const CurveKey first = cutAt(curve, edit.span.start);
  const CurveKey last = cutAt(curve, edit.span.end);
  std::vector<CurveKey> span_keys{first};
  const std::vector<CurveKey> inner = editedKeys(curve, edit);
  span_keys.insert(span_keys.end(), inner.begin(), inner.end());
  span_keys.push_back(last);
  if (edit.kind == CurveEdit::Kind::kReplace) setMonotoneSlopes(span_keys);
  // The way in from before and out to after stays as it was, without a kink.
  span_keys.front() = first;
  span_keys.back() = last;
  std::vector<CurveKey> keys;
  for (const CurveKey& key : curve.keys) {
    if (key.time < edit.span.start - 0.5 * kLeastGap) keys.push_back(key);
  }
  keys.insert(keys.end(), span_keys.begin(), span_keys.end());
  for (const CurveKey& key : curve.keys) {
    if (key.time > edit.span.end + 0.5 * kLeastGap) keys.push_back(key);
  }
  curve.keys = std::move(keys);
}

}  // namespace

CurveEdits parseCurveEdits(std::string_view json_text, std::string_view file) {
  const json root = json::parse(json_text, nullptr, false);
  if (!root.is_array()) throw InputError(file, "", "found no JSON list; expected edits");
  if (root.size() > kMostEdits)
    throw InputError(file, "", fmt::format("found {} edits; expected at most {}", root.size(), kMostEdits));
  CurveEdits edits;
  for (const json& entry : root) edits.push_back(editFrom(entry, fmt::format("edit {}", edits.size()), file));
  return edits;
}

CurveEdits readCurveEdits(const std::filesystem::path& path) {
  return parseCurveEdits(readFile(path, kMaxFileBytes), path.string());
}

CurveSet withEdits(CurveSet curves, const CurveEdits& edits) {
  for (const CurveEdit& edit : edits) {
    auto found = std::find_if(curves.begin(), curves.end(),
                              [&](const AnimationCurve& curve) { return curve.name == edit.curve; });
    if (found == curves.end()) {
      if (edit.kind == CurveEdit::Kind::kMute) continue;
      found = curves.insert(found, AnimationCurve{edit.curve, {}});
    }
    applyEdit(*found, edit);
  }
  std::sort(curves.begin(), curves.end(),
            [](const AnimationCurve& a, const AnimationCurve& b) { return a.name < b.name; });
  return curves;
}

}  // namespace mouthpiece
