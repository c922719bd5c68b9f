#include "vocal/curve_file.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "base/errors.h"
#include "base/files.h"
#include "base/text_numbers.h"

namespace mouthpiece {
namespace {

using nlohmann::json;

constexpr std::uint64_t kMaxFileBytes = std::uint64_t{1} << 28;
constexpr std::size_t kMostCurves = 1000;
constexpr double kLargestNumber = 1e6;

double numberOf(const json& key, const char* name, const std::string& place, std::string_view file) {
  const auto found = key.is_object() ? key.find(name) : key.end();
  if (!key.is_object() || found == key.end() || !found->is_number())
    throw InputError(file, place, fmt::format("found no number {}; expected time_s, value, in and out", name));
  const double value = found->get<double>();
  if (!(std::abs(value) < kLargestNumber))
    throw InputError(file, place, fmt::format("found {} = {}; expected less than {}", name, value, kLargestNumber));
  return value;
}

AnimationCurve curveFrom(const json& entry, const std::string& place, std::string_view file) {
  const bool usable = entry.is_object() && entry.contains("name") && entry["name"].is_string() &&
                      entry.contains("keys") && entry["keys"].is_array();
  if (!usable) throw InputError(file, place, "found no curve; expected an object with name and keys");
  AnimationCurve curve{entry["name"].get<std::string>(), {}};
  for (const json& key : entry["keys"]) {
    const std::string where = fmt::format("{}, key {}", place, curve.keys.size());
    curve.keys.push_back({numberOf(key, "time_s", where, file), numberOf(key, "value", where, file),
                          numberOf(key, "in", where, file), numberOf(key, "out", where, file)});
    const std::size_t count = curve.keys.size();
    if (count > 1 && curve.keys[count - 1].time <= curve.keys[count - 2].time)
      throw InputError(file, where, "found a time that is not after the key before; expected rising times");
  }
  return curve;
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
  return list.dump(1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

CurveSet parseCurves(std::string_view json_text, std::string_view file) {
  const json root = json::parse(json_text, nullptr, false);
  if (!root.is_array()) throw InputError(file, "", "found no JSON list; expected curves");
  if (root.size() > kMostCurves)
    throw InputError(file, "", fmt::format("found {} curves; expected at most {}", root.size(), kMostCurves));
  CurveSet curves;
  std::set<std::string> names;
  for (std::size_t i = 0; i < root.size(); ++i) {
    const std::string place = fmt::format("curve {}", i);
    curves.push_back(curveFrom(root[i], place, file));
    if (!names.insert(curves.back().name).second)
      throw InputError(file, place, fmt::format("found the name {} a second time", printable(curves.back().name)));
  }
  return curves;
}

CurveSet readCurves(const std::filesystem::path& path) {
  return parseCurves(readFile(path, kMaxFileBytes), path.string());
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
  for (std::size_t frame = 0; frame < frames; ++frame) times.push_back(static_cast<double>(frame) / frame_rate_hz);
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

}  // namespace mouthpiece
