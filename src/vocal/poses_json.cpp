#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "base/index.h"
#include "base/json_fields.h"
#include "base/json_text.h"
#include "vocal/viseme_poses.h"

namespace mouthpiece {

extern const std::string_view kGenericPosesJson;

namespace {

using nlohmann::ordered_json;

constexpr std::size_t kMostMarkers = 1000;
constexpr double kLargestPlaceMm = 1e6;

/// Micrometres are enough for a face.
double rounded(double value) { return std::round(value * 1e3) / 1e3; }

ordered_json numbers(const Eigen::Ref<const Eigen::RowVectorXd>& row) {
  ordered_json list = ordered_json::array();
  for (const double value : row) list.push_back(rounded(value));
  return list;
}

/// The single numbers of the file, in its order.
constexpr std::array<std::pair<const char*, double VisemePoses::*>, 8> kNumbers{
    {{"bilabial_mm", &VisemePoses::bilabial_mm},
     {"labiodental_mm", &VisemePoses::labiodental_mm},
     {"contact_mm", &VisemePoses::contact_mm},
     {"face_width_mm", &VisemePoses::face_width_mm},
     {"variance_mm2", &VisemePoses::variance_mm2},
     {"explained_mm2", &VisemePoses::explained_mm2},
     {"lip_variance_mm2", &VisemePoses::lip_variance_mm2},
     {"lip_explained_mm2", &VisemePoses::lip_explained_mm2}}};

double numberOf(const JsonField& field) { return field.number(-kLargestPlaceMm, kLargestPlaceMm); }

}  // namespace

std::string posesToJson(const VisemePoses& poses, std::string_view credit) {
  ordered_json root;
  if (!credit.empty()) root["credit"] = credit;
  root["markers"] = poses.marker_names;
  root["jaw_direction_mm"] = numbers(poses.jaw_direction);
  root["opening_direction_mm"] = numbers(poses.opening_direction);
  for (const auto& [name, member] : kNumbers) root[name] = rounded(poses.*member);
  for (std::size_t v = 1; v < kVisemeCount; ++v) {
    root["visemes"].push_back({{"name", visemeName(static_cast<Viseme>(v))},
                               {"frames_seen", std::round(poses.frames_seen[v])},
                               {"jaw_drop_mm", rounded(poses.jaw_drop[v])},
                               {"lips_mm", numbers(poses.lips.row(signedIndex(v)))}});
  }
  return jsonText(root) + "\n";
}

VisemePoses parsePoses(std::string_view json_text, std::string_view file) {
  const JsonField root = parseJson(json_text, file, "viseme poses");
  VisemePoses poses;
  poses.marker_names = root["markers"].names(1, kMostMarkers);
  poses.mouth = LipGauge(poses.marker_names);
  const Eigen::Index columns = signedIndex(3 * poses.marker_names.size());
  poses.jaw_direction = root["jaw_direction_mm"].numbers(columns, kLargestPlaceMm);
  poses.opening_direction = root["opening_direction_mm"].numbers(columns, kLargestPlaceMm);
  for (const auto& [name, member] : kNumbers) poses.*member = numberOf(root[name]);
  poses.lips = PositionMatrix::Zero(signedIndex(kVisemeCount), columns);
  std::size_t v = 0;
  for (const JsonField& entry : root["visemes"].list(kVisemeCount - 1, kVisemeCount - 1)) {
    const std::string_view name = visemeName(static_cast<Viseme>(++v));
    if (entry["name"].text() != name) entry["name"].refuse(name);
    poses.frames_seen[v] = numberOf(entry["frames_seen"]);
    poses.jaw_drop[v] = numberOf(entry["jaw_drop_mm"]);
    poses.lips.row(signedIndex(v)) = entry["lips_mm"].numbers(columns, kLargestPlaceMm);
  }
  return poses;
}

const VisemePoses& genericPoses() {
  static const VisemePoses poses = parsePoses(kGenericPosesJson, "sample_data/visemes/generic_poses.json");
  return poses;
}

}  // namespace mouthpiece
