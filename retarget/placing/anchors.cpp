#include "retarget/placing/anchors.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>

#include "base/errors.h"
#include "base/json_fields.h"
#include "base/json_text.h"
#include "deform/mesh/face_mesh.h"
#include "deform/mesh/triangle_tree.h"

namespace mouthpiece {

Anchors parseAnchors(std::string_view json_text, const std::string& file) {
  const JsonField root = parseJson(json_text, file, "{\"markers\": {\"NAME\": vertex, ...}}");
  // Landmark lists call them by what they are.
  const bool is_landmarks = root["vertices"].exists() && !root["markers"].exists();
  constexpr std::array<std::string_view, 5> kKeys{"about", "markers", "metres_per_unit", "parts", "vertices"};
  for (const auto& [key, value] : root.members()) {
    if (std::find(kKeys.begin(), kKeys.end(), key) == kKeys.end())
      value.fail("is no key of an anchors file; expected markers, parts, metres_per_unit or about");
  }
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
  return jsonText(root, 1) + "\n";
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

namespace {

/// Clicks that took right for left, one lip for the other, or the nose for the chin. R is the head's own right.
void refuseSwapped(const FaceMesh& mesh, const Anchors& anchors, const std::string& file) {
  const auto at = [&](const std::string& name) { return placeOf(anchors, name, mesh, file); };
  const auto nose = at("NOSE_TIP"), right = at("LIP_CORNER_R"), left = at("LIP_CORNER_L"),
             eye_right = at("CANTHUS_OUT_R"), eye_left = at("CANTHUS_OUT_L"), upper = at("LIP_UP_MID"),
             lower = at("LIP_LO_MID"), chin = at("CHIN_LOW");
  if (!nose || !right || !left || !eye_right || !eye_left) return;
  const Eigen::Vector3d mouth = 0.5 * (*left + *right), eyes = 0.5 * (*eye_left + *eye_right), up = eyes - mouth;
  // A muzzle's nose is not above its mouth as its eyes are, but it is the upper lip's neighbour. This comes first:
  // which side is which is told by the nose.
  if (upper && lower && chin && (*upper - *lower).dot(up) > 0 && (*nose - *upper).norm() > (*nose - *lower).norm() &&
      (*chin - *lower).norm() > (*chin - *upper).norm())
    throw InputError(file, "markers.NOSE_TIP",
                     "lies below the lips, and CHIN_LOW above them; expected the two swapped");
  const Eigen::Vector3d to_left = up.cross(*nose - 0.5 * (mouth + eyes));
  std::string swapped;
  std::size_t count = 0, pairs = 0;
  for (const std::string pair : {"LIP_CORNER_", "CANTHUS_OUT_", "EYE_IN_"}) {
    const auto own_right = at(pair + "R"), own_left = at(pair + "L");
    if (!own_right || !own_left) continue;
    ++pairs;
    if ((*own_left - *own_right).dot(to_left) >= 0) continue;
    if (count++ == 0) swapped = pair;
  }
  if (count == pairs)
    throw InputError(file, "markers", "have right and left the wrong way round; expected R at the head's own right");
  if (count > 0) {
    throw InputError(file, "markers." + swapped + "R",
                     fmt::format("lies left of {}L; expected R at the head's own right", swapped));
  }
  if (upper && lower && (*upper - *lower).dot(up) < 0)
    throw InputError(file, "markers.LIP_UP_MID", "lies below LIP_LO_MID; expected the upper lip above the lower one");
}

/// Triangles that all face into the head: seen from outside there is none to lie on.
void refuseInsideOut(const FaceMesh& mesh, const Anchors& anchors, const TriangleTree& tree, const std::string& file) {
  const auto at = [&](const char* name) { return placeOf(anchors, name, mesh, file); };
  const auto nose = at("NOSE_TIP"), right = at("LIP_CORNER_R"), left = at("LIP_CORNER_L"),
             eye_right = at("CANTHUS_OUT_R"), eye_left = at("CANTHUS_OUT_L");
  if (!nose || !right || !left || !eye_right || !eye_left) return;
  const Eigen::Vector3d mouth = 0.5 * (*left + *right), eyes = 0.5 * (*eye_left + *eye_right);
  // What sticks out of the plane through eyes and mouth is the nose.
  Eigen::Vector3d forward = (*left - *right).cross(eyes - mouth);
  if (forward.dot(*nose - mouth) < 0) forward = -forward;
  int inwards = 0, looked_at = 0;
  for (const char* name :
       {"NOSE_TIP", "LIP_CORNER_R", "LIP_CORNER_L", "LIP_UP_MID", "CHIN_LOW", "CANTHUS_OUT_R", "CANTHUS_OUT_L"}) {
    const auto place = placeOf(anchors, name, mesh, file);
    const auto foot = place ? tree.closest(*place) : std::nullopt;
    if (!foot) continue;
    const Triangle& t = mesh.triangles[foot->triangle];
    const Eigen::Vector3d a = pointAt(mesh.vertices, t[0]);
    const Eigen::Vector3d normal =
        (pointAt(mesh.vertices, t[1]) - a).cross(pointAt(mesh.vertices, t[2]) - a).normalized();
    ++looked_at;
    inwards += normal.dot(forward.normalized()) < -0.2 ? 1 : 0;
  }
  if (looked_at >= 4 && 2 * inwards > looked_at) {
    throw InputError(
        file, "markers",
        "lie on triangles that face into the head: the mesh is inside out; flip its normals (Blender: Mesh, "
        "Normals, Recalculate Outside)");
  }
}

}  // namespace

std::map<std::string, PartKind> skinUnderAnchors(const FaceMesh& mesh, const Anchors& anchors,
                                                 const std::string& anchors_file) {
  constexpr std::array<std::string_view, 6> kOnSkin{"LIP_CORNER_R", "LIP_CORNER_L", "LIP_UP_MID",
                                                    "LIP_LO_MID",   "NOSE_TIP",     "CHIN_LOW"};
  constexpr double kFar = 0.25;  // of the spread of the anchors: farther than any face is from its mesh
  std::vector<Eigen::Vector3d> places;
  std::vector<std::string> names;
  for (const std::string_view name : kOnSkin) {
    const auto place = placeOf(anchors, std::string(name), mesh, anchors_file);
    if (!place) continue;
    places.push_back(*place);
    names.emplace_back(name);
  }
  if (places.size() < 3) return {};
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& place : places) box.extend(place);
  const TriangleTree tree(mesh.vertices, mesh.triangles);
  std::map<const MeshPart*, std::size_t> on;
  bool all_are_far = true;
  Eigen::AlignedBox3d face;  // where the anchors' nearest points lie: one anchor in the air does not widen it
  std::vector<double> away;
  for (const Eigen::Vector3d& place : places) {
    const auto foot = tree.closest(place);
    if (!foot) return {};
    away.push_back((foot->point - place).norm());
    face.extend(foot->point);
    all_are_far = all_are_far && away.back() > kFar * box.diagonal().norm();
    for (const MeshPart& part : mesh.parts) {
      if (foot->triangle >= part.first_triangle && foot->triangle < part.first_triangle + part.triangle_count)
        ++on[&part];
    }
  }
  if (all_are_far) {
    throw InputError(anchors_file, "markers",
                     "lie off the skin, all of them; expected places on this mesh, in its own unit and orientation");
  }
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (away[i] > kFar * face.diagonal().norm()) {
      throw InputError(anchors_file, "markers." + names[i],
                       fmt::format("lies {:.3g} off the mesh, {:.0f} % of the face's size; expected a place on it",
                                   away[i], 100 * away[i] / face.diagonal().norm()));
    }
  }
  refuseSwapped(mesh, anchors, anchors_file);
  refuseInsideOut(mesh, anchors, tree, anchors_file);
  std::size_t on_skin = 0;
  for (const auto& [part, count] : on) on_skin += isSkin(part->kind) ? count : 0;
  std::map<std::string, PartKind> kinds;
  if (2 * on_skin >= places.size()) return kinds;
  for (const auto& [part, count] : on) {
    if (count > 1 && !isSkin(part->kind)) kinds[part->name] = PartKind::kSkin;
  }
  return kinds;
}

}  // namespace mouthpiece
