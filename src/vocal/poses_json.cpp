#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "base/errors.h"
#include "vocal/viseme_poses.h"

namespace mouthpiece {

extern const std::string_view kGenericPosesJson;

namespace {

using nlohmann::json;
using nlohmann::ordered_json;

constexpr std::size_t kMostMarkers = 1000;
constexpr double kLargestNumber = 1e6;

/// Micrometres are enough for a face.
double rounded(double value) { return std::round(value * 1e3) / 1e3; }

ordered_json numbers(const Eigen::Ref<const Eigen::RowVectorXd>& row) {
  ordered_json list = ordered_json::array();
  for (const double value : row) list.push_back(rounded(value));
  return list;
}

[[noreturn]] void fail(std::string_view file, std::string_view key, std::string_view what) {
  throw InputError(file, key, what);
}

double numberOf(const json& parent, const char* key, std::string_view file) {
  const auto found = parent.find(key);
  if (found == parent.end() || !found->is_number() || !(std::abs(found->get<double>()) < kLargestNumber))
    fail(file, key, "found no number; expected one");
  return found->get<double>();
}

Eigen::RowVectorXd rowOf(const json& parent, const char* key, Eigen::Index size, std::string_view file) {
  const auto found = parent.find(key);
  if (found == parent.end() || !found->is_array() || found->size() != static_cast<std::size_t>(size))
    fail(file, key, fmt::format("expected a list of {} numbers", size));
  Eigen::RowVectorXd row(size);
  for (Eigen::Index i = 0; i < size; ++i) {
    const json& value = (*found)[static_cast<std::size_t>(i)];
    if (!value.is_number() || !(std::abs(value.get<double>()) < kLargestNumber)) fail(file, key, "expected numbers");
    row(i) = value.get<double>();
  }
  return row;
}

}  // namespace

std::string posesToJson(const VisemePoses& poses, std::string_view credit) {
  ordered_json root;
  if (!credit.empty()) root["credit"] = credit;
  root["markers"] = poses.marker_names;
  root["jaw_direction_mm"] = numbers(poses.jaw_direction);
  root["opening_direction_mm"] = numbers(poses.opening_direction);
  root["bilabial_mm"] = rounded(poses.bilabial_mm);
  root["labiodental_mm"] = rounded(poses.labiodental_mm);
  root["contact_mm"] = rounded(poses.contact_mm);
  root["face_width_mm"] = rounded(poses.face_width_mm);
  root["variance_mm2"] = rounded(poses.variance_mm2);
  root["explained_mm2"] = rounded(poses.explained_mm2);
  root["lip_variance_mm2"] = rounded(poses.lip_variance_mm2);
  root["lip_explained_mm2"] = rounded(poses.lip_explained_mm2);
  for (std::size_t v = 1; v < kVisemeCount; ++v) {
    root["visemes"].push_back({{"name", visemeName(static_cast<Viseme>(v))},
                               {"frames_seen", std::round(poses.frames_seen[v])},
                               {"jaw_drop_mm", rounded(poses.jaw_drop[v])},
                               {"lips_mm", numbers(poses.lips.row(static_cast<Eigen::Index>(v)))}});
  }
  return root.dump(-1, ' ', false, ordered_json::error_handler_t::replace) + "\n";
}

VisemePoses parsePoses(std::string_view json_text, std::string_view file) {
  const json root = json::parse(json_text, nullptr, false);
  if (!root.is_object()) fail(file, "", "found no JSON object; expected viseme poses");
  const auto markers = root.find("markers");
  if (markers == root.end() || !markers->is_array() || markers->empty() || markers->size() > kMostMarkers)
    fail(file, "markers", "expected a list of marker names");
  VisemePoses poses;
  for (const json& name : *markers) {
    if (!name.is_string()) fail(file, "markers", "expected names");
    poses.marker_names.push_back(name.get<std::string>());
  }
  poses.mouth = LipGauge(poses.marker_names);
  const auto columns = static_cast<Eigen::Index>(3 * poses.marker_names.size());
  poses.jaw_direction = rowOf(root, "jaw_direction_mm", columns, file);
  poses.opening_direction = rowOf(root, "opening_direction_mm", columns, file);
  poses.bilabial_mm = numberOf(root, "bilabial_mm", file);
  poses.labiodental_mm = numberOf(root, "labiodental_mm", file);
  poses.contact_mm = numberOf(root, "contact_mm", file);
  poses.face_width_mm = numberOf(root, "face_width_mm", file);
  poses.variance_mm2 = numberOf(root, "variance_mm2", file);
  poses.explained_mm2 = numberOf(root, "explained_mm2", file);
  poses.lip_variance_mm2 = numberOf(root, "lip_variance_mm2", file);
  poses.lip_explained_mm2 = numberOf(root, "lip_explained_mm2", file);
  poses.lips = PositionMatrix::Zero(static_cast<Eigen::Index>(kVisemeCount), columns);
  const auto visemes = root.find("visemes");
  if (visemes == root.end() || !visemes->is_array() || visemes->size() != kVisemeCount - 1)
    fail(file, "visemes", fmt::format("expected a list of {} visemes", kVisemeCount - 1));
  for (std::size_t v = 1; v < kVisemeCount; ++v) {
    const json& entry = (*visemes)[v - 1];
    if (!entry.is_object() || entry.value("name", json()) != visemeName(static_cast<Viseme>(v)))
      fail(file, "visemes", fmt::format("expected {} in place {}", visemeName(static_cast<Viseme>(v)), v));
    poses.frames_seen[v] = numberOf(entry, "frames_seen", file);
    poses.jaw_drop[v] = numberOf(entry, "jaw_drop_mm", file);
    poses.lips.row(static_cast<Eigen::Index>(v)) = rowOf(entry, "lips_mm", columns, file);
  }
  return poses;
}

const VisemePoses& genericPoses() {
  static const VisemePoses poses = parsePoses(kGenericPosesJson, "sample_data/visemes/generic_poses.json");
  return poses;
}

}  // namespace mouthpiece
