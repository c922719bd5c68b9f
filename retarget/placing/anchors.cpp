#include "retarget/placing/anchors.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "base/errors.h"

namespace mouthpiece {
namespace {

using nlohmann::json;

AnchorPlace readPlace(const json& value, const std::string& name, const std::string& file) {
  const std::string key = "markers." + printable(name, 60);
  if (value.is_number_integer()) {
    const double id = value.get<double>();
    if (!(id >= 0 && id < 4294967295.0))
      throw InputError(file, key, fmt::format("found vertex {}; expected 0 or more", id));
    return value.get<std::uint32_t>();
  }
  if (!value.is_array() || value.size() != 3) throw InputError(file, key, "expected a vertex number or [x, y, z]");
  Eigen::Vector3d point;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (!value[axis].is_number() || !(std::abs(value[axis].get<double>()) <= 1e7)) {
      throw InputError(file, key, "found a coordinate that is no number between -1e7 and 1e7");
    }
    point[static_cast<Eigen::Index>(axis)] = value[axis].get<double>();
  }
  return point;
}

}  // namespace

Anchors parseAnchors(std::string_view json_text, const std::string& file) {
  json tree;
  try {
    tree = json::parse(json_text.begin(), json_text.end());
  } catch (const json::parse_error& error) {
    throw InputError(file, fmt::format("byte {}", error.byte),
                     "is no JSON; expected {\"markers\": {\"NAME\": vertex, ...}}");
  } catch (const json::exception&) {  // a number too large for any type
    throw InputError(file, "", "holds a number out of range; expected vertex numbers or [x, y, z]");
  }
  // Landmark lists call them by what they are.
  const char* key = tree.is_object() && tree.contains("vertices") && !tree.contains("markers") ? "vertices" : "markers";
  if (!tree.is_object() || !tree.contains(key) || !tree[key].is_object()) {
    throw InputError(file, "markers", "is missing; expected a map of marker names to vertex numbers or [x, y, z]");
  }
  Anchors anchors;
  for (const auto& [name, value] : tree[key].items()) anchors.markers.emplace(name, readPlace(value, name, file));
  if (const auto unit = tree.find("metres_per_unit"); unit != tree.end()) {
    if (!unit->is_number() || !(unit->get<double>() >= 1e-9 && unit->get<double>() <= 1e3)) {
      throw InputError(file, "metres_per_unit", "expected a number between 1e-9 and 1000");
    }
    anchors.metres_per_unit = unit->get<double>();
  }
  if (const auto parts = tree.find("parts"); parts != tree.end()) {
    if (!parts->is_object()) throw InputError(file, "parts", "expected a map of part names to kinds");
    for (const auto& [name, kind_name] : parts->items()) {
      const auto kind = kind_name.is_string() ? partKindFromName(kind_name.get<std::string>()) : std::nullopt;
      if (!kind) {
        throw InputError(file, "parts." + printable(name, 60),
                         "expected skin, lips, upper_teeth, lower_teeth, tongue, mouth_inside, eye, hair or other");
      }
      anchors.part_kinds[name] = *kind;
    }
  }
  return anchors;
}

std::optional<Eigen::Vector3d> placeOf(const Anchors& anchors, const std::string& name, const FaceMesh& mesh,
                                       const std::string& file) {
  const auto anchor = anchors.markers.find(name);
  if (anchor == anchors.markers.end()) return std::nullopt;
  if (const auto* point = std::get_if<Eigen::Vector3d>(&anchor->second)) return *point;
  const std::uint32_t vertex = std::get<std::uint32_t>(anchor->second);
  if (vertex >= static_cast<std::size_t>(mesh.vertices.rows())) {
    throw InputError(file, "markers." + name,
                     fmt::format("found vertex {}; expected 0 to {}", vertex, mesh.vertices.rows() - 1));
  }
  return mesh.vertices.row(vertex).cast<double>().transpose();
}

}  // namespace mouthpiece
