#include "retarget/placing/anchors.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "base/errors.h"
#include "base/json_fields.h"

namespace mouthpiece {

Anchors parseAnchors(std::string_view json_text, const std::string& file) {
  const JsonField root = parseJson(json_text, file, "{\"markers\": {\"NAME\": vertex, ...}}");
  // Landmark lists call them by what they are.
  const bool is_landmarks = root["vertices"].exists() && !root["markers"].exists();
  Anchors anchors;
  for (const auto& [name, place] : root[is_landmarks ? "vertices" : "markers"].members()) {
    if (place.isWhole())
      anchors.markers.emplace(name, static_cast<std::uint32_t>(place.whole(0, 4294967294)));
    else if (place.isList())
      anchors.markers.emplace(name, Eigen::Vector3d(place.numbers(3, 1e7)));
    else
      place.refuse("a vertex number or [x, y, z]");
  }
  if (const JsonField unit = root["metres_per_unit"]; unit.exists()) anchors.metres_per_unit = unit.number(1e-9, 1e3);
  if (const JsonField parts = root["parts"]; parts.exists()) {
    for (const auto& [name, kind_name] : parts.members()) {
      const auto kind = kind_name.isText() ? partKindFromName(kind_name.text()) : std::nullopt;
      if (!kind) kind_name.refuse("skin, lips, upper_teeth, lower_teeth, tongue, mouth_inside, eye, hair or other");
      anchors.part_kinds[name] = *kind;
    }
  }
  return anchors;
}

std::string anchorsBytes(const Anchors& anchors) {
  nlohmann::ordered_json root;
  if (anchors.metres_per_unit) root["metres_per_unit"] = *anchors.metres_per_unit;
  for (const auto& [name, kind] : anchors.part_kinds) root["parts"][name] = nameOf(kind);
  nlohmann::ordered_json& markers = root["markers"] = nlohmann::ordered_json::object();
  for (const auto& [name, place] : anchors.markers) {
    if (const auto* point = std::get_if<Eigen::Vector3d>(&place))
      markers[name] = {point->x(), point->y(), point->z()};
    else
      markers[name] = std::get<std::uint32_t>(place);
  }
  return root.dump(1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

std::optional<Eigen::Vector3d> placeOf(const Anchors& anchors, const std::string& name, const FaceMesh& mesh,
                                       const std::string& file) {
  const auto anchor = anchors.markers.find(name);
  if (anchor == anchors.markers.end()) return std::nullopt;
  if (const auto* point = std::get_if<Eigen::Vector3d>(&anchor->second)) return *point;
  const std::uint32_t vertex = std::get<std::uint32_t>(anchor->second);
  if (vertex >= unsignedIndex(mesh.vertices.rows())) {
    throw InputError(file, "markers." + name,
                     fmt::format("found vertex {}; expected 0 to {}", vertex, mesh.vertices.rows() - 1));
  }
  return mesh.vertices.row(vertex).cast<double>().transpose();
}

}  // namespace mouthpiece
