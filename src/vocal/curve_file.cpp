#include <fmt/format.h>

#include <array>
#include <nlohmann/json.hpp>
#include <set>

#include "base/errors.h"
#include "base/files.h"
#include "base/index.h"
#include "base/json_fields.h"
#include "base/json_text.h"
#include "base/text_numbers.h"
#include "vocal/animation_curve.h"

namespace mouthpiece {
namespace {

constexpr std::uint64_t kMaxCurveBytes = std::uint64_t{1} << 28;
constexpr std::size_t kMostCurves = 1000;
constexpr double kLargestNumber = 1e6;

double numberOf(const JsonField& entry, std::string_view key) {
  return entry[key].number(-kLargestNumber, kLargestNumber);
}

AnimationCurve curveFrom(const JsonField& entry) {
  AnimationCurve curve{entry["name"].text(), {}};
  for (const JsonField& key : entry["keys"].list()) {
    const Seconds time = numberOf(key, "time_s");
    if (!curve.keys.empty() && time <= curve.keys.back().time)
      key.fail("found a time that is not after the key before; expected rising times");
    curve.keys.push_back({time, numberOf(key, "value"), numberOf(key, "in"), numberOf(key, "out")});
  }
  return curve;
}

std::vector<CurveKey> keysWithin(const TimeSpan& span, const JsonField& list) {
  std::vector<CurveKey> keys;
  for (const JsonField& key : list.list(1)) {
    const Seconds time = key["time_s"].number(span.start, span.end);
    if (!keys.empty() && time < keys.back().time + kLeastKeyGap)
      key.fail("found key times that do not rise; expected rising times");
    keys.push_back({time, numberOf(key, "value"), 0, 0});
  }
  return keys;
}

}  // namespace

std::string curvesToJson(const CurveSet& curves) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const AnimationCurve& curve : curves) {
    nlohmann::ordered_json keys = nlohmann::ordered_json::array();
    for (const CurveKey& key : curve.keys)
      keys.push_back({{"time_s", key.time}, {"value", key.value}, {"in", key.in}, {"out", key.out}});
    list.push_back({{"name", curve.name}, {"keys", std::move(keys)}});
  }
  return jsonText(list, 1) + "\n";
}

CurveSet parseCurves(std::string_view json_text, std::string_view file) {
  CurveSet curves;
  std::set<std::string> names;
  for (const JsonField& entry : parseJson(json_text, file, "curves").list(0, kMostCurves)) {
    curves.push_back(curveFrom(entry));
    if (!names.insert(curves.back().name).second)
      entry.fail(fmt::format("found the name {} a second time", printable(curves.back().name)));
  }
  return curves;
}

CurveSet readCurves(const std::filesystem::path& path) {
  return parseCurves(readFile(path, kMaxCurveBytes), path.string());
}

std::string curveKeysToCsv(const CurveSet& curves) {
  std::string text = "curve,time_s,value,in,out\n";
  for (const AnimationCurve& curve : curves) {
    for (const CurveKey& key : curve.keys)
      text += fmt::format("{},{},{},{},{}\n", curve.name, key.time, key.value, key.in, key.out);
  }
  return text;
}

std::string curveFramesToCsv(const CurveSet& curves, double frame_rate_hz, std::size_t frames) {
  constexpr int kTimeDecimals = 6, kValueDecimals = 5;
  std::vector<Seconds> times;
  for (std::size_t frame = 0; frame < frames; ++frame) times.push_back(asReal(frame) / frame_rate_hz);
  std::vector<std::vector<double>> columns;
  std::string text = "time_s";
  for (const AnimationCurve& curve : curves) {
    text += "," + curve.name;
    columns.push_back(sampleCurve(curve, times));
  }
  text += "\n";
  for (std::size_t frame = 0; frame < frames; ++frame) {
    appendFixed(text, times[frame], kTimeDecimals);
    for (const std::vector<double>& column : columns) {
      text += ',';
      appendFixed(text, column[frame], kValueDecimals);
    }
    text += '\n';
  }
  return text;
}

CurveEdit curveEditFrom(const JsonField& entry) {
  constexpr std::array<std::string_view, 3> kKinds{"offset", "replace", "mute"};  // in the order of CurveEdit::Kind
  CurveEdit edit;
  edit.curve = entry["curve"].name();
  edit.kind = std::array{CurveEdit::Kind::kOffset, CurveEdit::Kind::kReplace,
                         CurveEdit::Kind::kMute}[entry["kind"].choice(kKinds)];
  edit.span = {numberOf(entry, "start_s"), numberOf(entry, "end_s")};
  if (edit.span.duration() < 2 * kLeastKeyGap) entry.fail("found an empty span; expected end_s after start_s");
  if (edit.kind == CurveEdit::Kind::kOffset) edit.value = numberOf(entry, "value");
  if (edit.kind == CurveEdit::Kind::kReplace) edit.keys = keysWithin(edit.span, entry["keys"]);
  if (entry["fade_s"].exists()) edit.fade = entry["fade_s"].number(0, kLargestNumber);
  return edit;
}

CurveEdit wholeCurveFrom(const JsonField& entry) {
  AnimationCurve curve = curveFrom(entry);
  CurveEdit edit;
  edit.curve = std::move(curve.name);
  edit.kind = CurveEdit::Kind::kWhole;
  edit.keys = std::move(curve.keys);
  return edit;
}

}  // namespace mouthpiece
