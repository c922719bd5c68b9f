#include "motion/marker_layout.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <unordered_map>

#include "base/errors.h"

namespace mouthpiece {

extern const std::string_view kFace66LayoutJson;

namespace {

using nlohmann::json;

constexpr std::size_t kMaxMarkers = 10000;
constexpr std::size_t kMaxNameLength = 127;  // what a C3D label holds

std::string markerPlace(std::size_t index) { return fmt::format("markers[{}]", index); }

/// The member `key` of `object`, which must be of the JSON type that `Value` reads from.
template <typename Value>
Value requiredMember(const json& object, const char* key, std::string_view file, std::string_view place) {
  const auto member = object.find(key);
  if (member == object.end()) throw InputError(file, place, fmt::format("found no \"{}\"; expected one", key));
  try {
    return member->get<Value>();
  } catch (const json::exception&) {
    throw InputError(file, place, fmt::format("found \"{}\" of the wrong type ({})", key, member->type_name()));
  }
}

std::string readName(const json& object, const char* key, std::string_view file, std::string_view place) {
  auto name = requiredMember<std::string>(object, key, file, place);
  const bool has_control = std::any_of(name.begin(), name.end(), [](unsigned char c) { return c < 0x20 || c == 0x7F; });
  if (name.empty() || name.size() > kMaxNameLength || has_control) {
    throw InputError(
        file, place,
        fmt::format("found \"{}\" = \"{}\"; expected 1 to {} printable bytes", key, printable(name), kMaxNameLength));
  }
  return name;
}

Side sideFromLetter(const std::string& letter, std::string_view file, std::string_view place) {
  if (letter == "R") return Side::kRight;
  if (letter == "M") return Side::kMiddle;
  if (letter == "L") return Side::kLeft;
  throw InputError(file, place, fmt::format("found side \"{}\"; expected R, M or L", printable(letter)));
}

const char* letterOf(Side side) { return side == Side::kRight ? "R" : side == Side::kLeft ? "L" : "M"; }

Side oppositeOf(Side side) {
  return side == Side::kRight ? Side::kLeft : side == Side::kLeft ? Side::kRight : Side::kMiddle;
}

constexpr std::size_t kMaxTriangles = 20000;

LipSide lipFromWord(const std::string& word, std::string_view file, std::string_view place) {
  if (word == "upper") return LipSide::kUpper;
  if (word == "lower") return LipSide::kLower;
  if (word == "none") return LipSide::kNone;
  throw InputError(file, place, fmt::format("found lip \"{}\"; expected upper, lower or none", printable(word)));
}

struct RoleName {
  std::string_view word, marker;
};
constexpr std::array<RoleName, kMarkerRoles.size()> kRoleNames{{{"upper lip", "LIP_UP_MID"},
                                                                {"lower lip", "LIP_LO_MID"},
                                                                {"right lip corner", "LIP_CORNER_R"},
                                                                {"left lip corner", "LIP_CORNER_L"},
                                                                {"chin", "CHIN_MID"}}};

MarkerRole roleFromWord(const std::string& word, std::string_view file, std::string_view place) {
  for (const MarkerRole role : kMarkerRoles) {
    if (wordOf(role) == word) return role;
  }
  throw InputError(file, place,
                   fmt::format("found role \"{}\"; expected upper lip, lower lip, right lip corner, left lip corner or "
                               "chin",
                               printable(word)));
}

/// A role has one marker.
void refuseSharedRoles(const MarkerLayout& layout, std::string_view file) {
  for (std::size_t i = 0; i < layout.markers.size(); ++i) {
    const LayoutMarker& marker = layout.markers[i];
    if (marker.role && layout.findRole(*marker.role) != MarkerIndex(i))
      throw InputError(file, markerPlace(i), fmt::format("found role \"{}\" twice; expected it once", wordOf(*marker.role)));
  }
}

const char* wordOf(LipSide lip) { return lip == LipSide::kUpper ? "upper" : lip == LipSide::kLower ? "lower" : "none"; }

LayoutMarker readMarker(const json& object, std::string_view file, std::string_view place) {
  if (!object.is_object()) throw InputError(file, place, "found no object; expected a marker");
  LayoutMarker marker;
  marker.name = readName(object, "name", file, place);
  marker.region = readName(object, "region", file, place);
  marker.side = sideFromLetter(requiredMember<std::string>(object, "side", file, place), file, place);
  marker.lip = object.contains("lip")
                   ? lipFromWord(requiredMember<std::string>(object, "lip", file, place), file, place)
                   : lipSideOf(marker.name);
  if (object.contains("role"))
    marker.role = roleFromWord(requiredMember<std::string>(object, "role", file, place), file, place);
  if (object.contains("stable")) marker.stable = requiredMember<bool>(object, "stable", file, place);
  if (object.contains("mediapipe_landmark")) {
    const auto landmark = requiredMember<std::int64_t>(object, "mediapipe_landmark", file, place);
    if (landmark < -1 || landmark > 477) {
      throw InputError(file, place, fmt::format("found mediapipe_landmark {}; expected -1 to 477", landmark));
    }
    marker.mediapipe_landmark = static_cast<int>(landmark);
  }
  return marker;
}

using NameIndex = std::unordered_map<std::string, std::size_t>;

/// Mirror partners name each other, and sit on opposite sides.
void resolveMirrors(MarkerLayout& layout, const json& markers, const NameIndex& index_of, std::string_view file) {
  for (std::size_t i = 0; i < layout.markers.size(); ++i) {
    LayoutMarker& marker = layout.markers[i];
    const std::string mirror = readName(markers[i], "mirror", file, markerPlace(i));
    const auto partner = index_of.find(mirror);
    if (partner == index_of.end()) {
      throw InputError(file, markerPlace(i),
                       fmt::format("found mirror \"{}\" of {}; expected a marker of the layout", printable(mirror),
                                   printable(marker.name)));
    }
    marker.mirror = MarkerIndex(partner->second);
  }
  for (std::size_t i = 0; i < layout.markers.size(); ++i) {
    const LayoutMarker& marker = layout.markers[i];
    const LayoutMarker& partner = layout.markers[marker.mirror.value];
    const bool on_midline = marker.side == Side::kMiddle;
    if (partner.mirror.value != i || partner.side != oppositeOf(marker.side) ||
        on_midline != (marker.mirror.value == i)) {
      throw InputError(file, markerPlace(i),
                       fmt::format("found {} mirrored by {}; expected partners that name each other, on opposite "
                                   "sides, and midline markers that name themselves",
                                   printable(marker.name), printable(partner.name)));
    }
  }
}

/// Names are looked up when a surface is built: virtual points are among them.
std::vector<std::array<std::string, 3>> readTriangles(const json& root, std::string_view file) {
  const json triangles = root.value("triangles", json::array());
  if (!triangles.is_array() || triangles.size() > kMaxTriangles)
    throw InputError(file, "triangles", fmt::format("expected a list of at most {} triangles", kMaxTriangles));
  std::vector<std::array<std::string, 3>> read;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const json& corners = triangles[i];
    const bool are_names = corners.is_array() && corners.size() == 3 &&
                           std::all_of(corners.begin(), corners.end(), [](const json& c) { return c.is_string(); });
    if (!are_names || corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0])
      throw InputError(file, fmt::format("triangles[{}]", i), "expected three different names");
    read.push_back(corners.get<std::array<std::string, 3>>());
  }
  return read;
}

json parseJson(std::string_view text, std::string_view file) {
  try {
    return json::parse(text);
  } catch (const json::parse_error& error) {
    throw InputError(file, fmt::format("byte {}", error.byte), "is no valid JSON; expected a marker layout");
  } catch (const json::exception&) {  // a number too large for any type
    throw InputError(file, "", "holds a number out of range; expected a marker layout");
  }
}

}  // namespace

LipSide lipSideOf(std::string_view marker_name) {
  if (marker_name.starts_with("LIP_UP_")) return LipSide::kUpper;
  return marker_name.starts_with("LIP_LO_") ? LipSide::kLower : LipSide::kNone;
}

std::string_view wordOf(MarkerRole role) { return kRoleNames[static_cast<std::size_t>(role)].word; }
std::string_view usualName(MarkerRole role) { return kRoleNames[static_cast<std::size_t>(role)].marker; }

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
  const auto given = std::find_if(markers.begin(), markers.end(),
                                  [&](const LayoutMarker& marker) { return marker.role == role; });
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
  return MarkerIndex(static_cast<std::size_t>(found - markers.begin()));
}

const MarkerLayout& defaultLayout() {
  static const MarkerLayout layout = parseLayout(kFace66LayoutJson, "face66.json");
  return layout;
}

MarkerLayout parseLayout(std::string_view json_text, std::string_view file) {
  const json root = parseJson(json_text, file);
  if (!root.is_object()) throw InputError(file, "", "found no object; expected a marker layout");
  MarkerLayout layout;
  layout.name = readName(root, "name", file, "");
  const json markers = root.value("markers", json::array());
  if (!markers.is_array() || markers.empty() || markers.size() > kMaxMarkers) {
    throw InputError(file, "markers", fmt::format("expected a list of 1 to {} markers", kMaxMarkers));
  }
  NameIndex index_of;
  const auto refuseDuplicate = [&](const std::string& marker_name, std::size_t index, std::string_view place) {
    if (!index_of.emplace(marker_name, index).second) {
      throw InputError(file, place, fmt::format("found {} twice; expected each name once", printable(marker_name)));
    }
  };
  for (std::size_t i = 0; i < markers.size(); ++i) {
    layout.markers.push_back(readMarker(markers[i], file, markerPlace(i)));
    refuseDuplicate(layout.markers.back().name, i, markerPlace(i));
  }
  resolveMirrors(layout, markers, index_of, file);
  refuseSharedRoles(layout, file);
  if (root.contains("jig")) layout.jig_names = requiredMember<std::vector<std::string>>(root, "jig", file, "");
  for (const std::string& jig_name : layout.jig_names) refuseDuplicate(jig_name, 0, "jig");
  layout.triangles = readTriangles(root, file);
  return layout;
}

std::string layoutToJson(const MarkerLayout& layout) {
  nlohmann::ordered_json root;
  root["name"] = layout.name;
  root["markers"] = nlohmann::ordered_json::array();
  for (const LayoutMarker& marker : layout.markers) {
    root["markers"].push_back({{"name", marker.name},
                               {"region", marker.region},
                               {"side", letterOf(marker.side)},
                               {"mirror", layout.markers.at(marker.mirror.value).name},
                               {"mediapipe_landmark", marker.mediapipe_landmark},
                               {"stable", marker.stable}});
    if (marker.lip != lipSideOf(marker.name)) root["markers"].back()["lip"] = wordOf(marker.lip);
    if (marker.role) root["markers"].back()["role"] = wordOf(*marker.role);
  }
  root["jig"] = layout.jig_names;
  if (!layout.triangles.empty()) root["triangles"] = layout.triangles;
  return root.dump(1) + "\n";
}

}  // namespace mouthpiece
