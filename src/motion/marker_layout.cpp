#include "motion/marker_layout.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <optional>
#include <unordered_map>

#include "base/errors.h"
#include "base/json_fields.h"

namespace mouthpiece {

extern const std::string_view kFace66LayoutJson;

namespace {

constexpr std::size_t kMaxMarkers = 10000;
constexpr std::size_t kMaxTriangles = 20000;
constexpr std::size_t kMaxNameLength = 127;  // what a C3D label holds
constexpr std::array<std::string_view, 3> kSides{"R", "M", "L"};
constexpr std::array<std::string_view, 3> kLips{"none", "upper", "lower"};

Side oppositeOf(Side side) {
  return side == Side::kRight ? Side::kLeft : side == Side::kLeft ? Side::kRight : Side::kMiddle;
}

struct RoleNames {
  std::array<std::string_view, kMarkerRoles.size()> words, markers;
};
constexpr RoleNames kRoles{{"upper lip", "lower lip", "right lip corner", "left lip corner", "chin"},
                           {"LIP_UP_MID", "LIP_LO_MID", "LIP_CORNER_R", "LIP_CORNER_L", "CHIN_MID"}};

LayoutMarker readMarker(const JsonField& field) {
  LayoutMarker marker;
  marker.name = field["name"].name(kMaxNameLength);
  marker.region = field["region"].name(kMaxNameLength);
  marker.side = static_cast<Side>(field["side"].choice(kSides));
  marker.lip = field["lip"].exists() ? static_cast<LipSide>(field["lip"].choice(kLips)) : lipSideOf(marker.name);
  if (field["role"].exists()) marker.role = kMarkerRoles[field["role"].choice(kRoles.words)];
  if (field["stable"].exists()) marker.stable = field["stable"].flag();
  if (field["mediapipe_landmark"].exists())
    marker.mediapipe_landmark = static_cast<int>(field["mediapipe_landmark"].whole(-1, 477));
  return marker;
}

/// Where each name stands; throws InputError for one that comes twice.
class NameIndex {
 public:
  void add(const std::string& name, const JsonField& field) {
    if (!places_.emplace(name, places_.size()).second)
      field.fail(fmt::format("found {} twice; expected each name once", printable(name)));
  }
  [[nodiscard]] std::optional<std::size_t> find(const std::string& name) const {
    const auto found = places_.find(name);
    return found == places_.end() ? std::nullopt : std::optional(found->second);
  }

 private:
  std::unordered_map<std::string, std::size_t> places_;
};

/// Mirror partners name each other, and sit on opposite sides.
void resolveMirrors(MarkerLayout& layout, const std::vector<JsonField>& fields, const NameIndex& index) {
  for (std::size_t i = 0; i < layout.markers.size(); ++i) {
    const std::string mirror = fields[i]["mirror"].name(kMaxNameLength);
    const std::optional<std::size_t> partner = index.find(mirror);
    if (!partner)
      fields[i].fail(fmt::format("found mirror \"{}\" of {}; expected a marker of the layout", printable(mirror),
                                 printable(layout.markers[i].name)));
    layout.markers[i].mirror = MarkerIndex(*partner);
  }
  for (std::size_t i = 0; i < layout.markers.size(); ++i) {
    const LayoutMarker& marker = layout.markers[i];
    const LayoutMarker& partner = layout.markers[marker.mirror.value];
    const bool on_midline = marker.side == Side::kMiddle;
    if (partner.mirror.value != i || partner.side != oppositeOf(marker.side) ||
        on_midline != (marker.mirror.value == i)) {
      fields[i].fail(
          fmt::format("found {} mirrored by {}; expected partners that name each other, on opposite sides, "
                      "and midline markers that name themselves",
                      printable(marker.name), printable(partner.name)));
    }
  }
}

/// Names are looked up when a surface is built: virtual points are among them.
std::array<std::string, 3> readTriangle(const JsonField& field) {
  const std::vector<std::string> corners = field.names(3, 3);
  if (corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0])
    field.refuse("three different names");
  return {corners[0], corners[1], corners[2]};
}

}  // namespace

LipSide lipSideOf(std::string_view marker_name) {
  if (marker_name.starts_with("LIP_UP_")) return LipSide::kUpper;
  return marker_name.starts_with("LIP_LO_") ? LipSide::kLower : LipSide::kNone;
}

std::string_view wordOf(MarkerRole role) { return kRoles.words[static_cast<std::size_t>(role)]; }
std::string_view usualName(MarkerRole role) { return kRoles.markers[static_cast<std::size_t>(role)]; }

std::optional<MarkerIndex> findRole(MarkerRole role, const std::vector<std::string>& marker_names) {
  auto found = std::find(marker_names.begin(), marker_names.end(), usualName(role));
  if (found == marker_names.end() && role == MarkerRole::kChin) {
    found = std::find_if(marker_names.begin(), marker_names.end(),
                         [](const std::string& name) { return name.starts_with("CHIN"); });
  }
  if (found == marker_names.end()) return std::nullopt;
  return MarkerIndex(unsignedIndex(found - marker_names.begin()));
}

std::optional<MarkerIndex> MarkerLayout::findRole(MarkerRole role) const {
  const auto given =
      std::find_if(markers.begin(), markers.end(), [&](const LayoutMarker& marker) { return marker.role == role; });
  if (given != markers.end()) return MarkerIndex(unsignedIndex(given - markers.begin()));
  return mouthpiece::findRole(role, markerNames());
}

std::vector<std::string> MarkerLayout::markerNames() const {
  std::vector<std::string> names;
  names.reserve(markers.size());
  for (const LayoutMarker& marker : markers) names.push_back(marker.name);
  return names;
}

MarkerIndex MarkerLayout::indexOf(std::string_view marker_name) const {
  const auto found = std::find_if(markers.begin(), markers.end(),
                                  [&](const LayoutMarker& marker) { return marker.name == marker_name; });
  if (found == markers.end()) {
    throw InputError(fmt::format("found marker name \"{}\"; expected one of the {} markers of layout {}",
                                 printable(marker_name), markers.size(), printable(name)));
  }
  return MarkerIndex(unsignedIndex(found - markers.begin()));
}

std::vector<bool> upperFaceColumns(const MarkerLayout& layout) {
  std::vector<bool> upper;
  for (const LayoutMarker& marker : layout.markers) {
    const bool is_upper = marker.region == "forehead" || marker.region == "temple" || marker.region == "brow" ||
                          marker.region == "lid" || marker.region == "canthus";
    upper.insert(upper.end(), 3, is_upper);
  }
  return upper;
}

const MarkerLayout& defaultLayout() {
  static const MarkerLayout layout = parseLayout(kFace66LayoutJson, "face66.json");
  return layout;
}

MarkerLayout parseLayout(std::string_view json_text, std::string_view file) {
  const JsonField root = parseJson(json_text, file, "a marker layout");
  MarkerLayout layout;
  layout.name = root["name"].name(kMaxNameLength);
  const std::vector<JsonField> markers = root["markers"].list(1, kMaxMarkers);
  NameIndex index;
  for (const JsonField& field : markers) {
    layout.markers.push_back(readMarker(field));
    index.add(layout.markers.back().name, field);
  }
  resolveMirrors(layout, markers, index);
  for (std::size_t i = 0; i < markers.size(); ++i) {
    const auto& role = layout.markers[i].role;
    if (role && layout.findRole(*role) != MarkerIndex(i))
      markers[i].fail(fmt::format("found role \"{}\" twice; expected it once", wordOf(*role)));
  }
  if (root["jig"].exists()) layout.jig_names = root["jig"].names();
  for (const std::string& name : layout.jig_names) index.add(name, root["jig"]);
  if (root["triangles"].exists()) {
    for (const JsonField& field : root["triangles"].list(0, kMaxTriangles))
      layout.triangles.push_back(readTriangle(field));
  }
  return layout;
}

std::string layoutToJson(const MarkerLayout& layout) {
  nlohmann::ordered_json root;
  root["name"] = layout.name;
  root["markers"] = nlohmann::ordered_json::array();
  for (const LayoutMarker& marker : layout.markers) {
    root["markers"].push_back({{"name", marker.name},
                               {"region", marker.region},
                               {"side", kSides[static_cast<std::size_t>(marker.side)]},
                               {"mirror", layout.markers.at(marker.mirror.value).name},
                               {"mediapipe_landmark", marker.mediapipe_landmark},
                               {"stable", marker.stable}});
    if (marker.lip != lipSideOf(marker.name))
      root["markers"].back()["lip"] = kLips[static_cast<std::size_t>(marker.lip)];
    if (marker.role) root["markers"].back()["role"] = wordOf(*marker.role);
  }
  root["jig"] = layout.jig_names;
  if (!layout.triangles.empty()) root["triangles"] = layout.triangles;
  return root.dump(1) + "\n";
}

}  // namespace mouthpiece
