#include "page_engine/packed_mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "base/index.h"
#include "deform/mesh/face_mesh.h"

namespace mouthpiece {

RowMajorMatrixF floatsFrom(const JsonField& field, Eigen::Index columns, bool nan_allowed) {
  const std::vector<float> values = field.blob<float>();
  const auto size = signedIndex(values.size());
  if (columns == 0 || size % columns != 0)
    field.fail(fmt::format("found {} numbers; expected rows of {}", size, columns));
  for (const float value : values) {
    if (!(std::abs(value) <= kLargestPacked) && !(nan_allowed && std::isnan(value)))
      field.fail("found a number that is not usable");
  }
  return Eigen::Map<const RowMajorMatrixF>(values.data(), size / columns, columns);
}

nlohmann::json meshToJson(const FaceMesh& mesh) {
  nlohmann::json parts = nlohmann::json::array();
  for (const MeshPart& part : mesh.parts)
    parts.push_back({{"name", part.name},
                     {"kind", std::string(nameOf(part.kind))},
                     {"triangles", part.triangle_count},
                     {"stands_off", part.stands_off}});
  std::vector<std::uint32_t> corners;
  for (const Triangle& triangle : mesh.triangles)
    for (const auto corner : triangle) corners.push_back(static_cast<std::uint32_t>(corner));
  return {{"vertices", floatsOf(mesh.vertices)},
          {"triangles", blobOf(corners)},
          {"parts", std::move(parts)},
          {"metres_per_unit", mesh.metres_per_unit}};
}

std::shared_ptr<const FaceMesh> meshFrom(const JsonField& field) {
  auto made = std::make_shared<FaceMesh>();
  FaceMesh& mesh = *made;
  mesh.vertices = floatsFrom(field["vertices"], 3);
  if (mesh.vertices.rows() == 0) field["vertices"].fail("found no vertex");
  const auto corners = field["triangles"].blob<std::uint32_t>();
  if (corners.size() % 3 != 0) field["triangles"].fail("expected three corners a triangle");
  for (std::size_t i = 0; i < corners.size(); i += 3) {
    mesh.triangles.push_back({corners[i], corners[i + 1], corners[i + 2]});
    if (std::max({corners[i], corners[i + 1], corners[i + 2]}) >= mesh.vertexCount())
      field["triangles"].fail("found a corner that is no vertex");
  }
  for (const JsonField& entry : field["parts"].list()) {
    MeshPart& part = mesh.parts.emplace_back();
    part.name = entry["name"].text();
    const auto kind = partKindFromName(entry["kind"].text());
    if (!kind) entry["kind"].refuse("a kind of part");
    part.kind = *kind;
    if (mesh.parts.size() > 1) {
      const MeshPart& before = mesh.parts[mesh.parts.size() - 2];
      part.first_triangle = before.first_triangle + before.triangle_count;
    }
    const std::size_t left = mesh.triangles.size() - part.first_triangle;
    part.triangle_count = unsignedIndex(entry["triangles"].whole(0, signedIndex(left)));
    part.stands_off = entry["stands_off"].flag();
  }
  const bool is_whole = !mesh.parts.empty() &&
                        mesh.parts.back().first_triangle + mesh.parts.back().triangle_count == mesh.triangles.size();
  if (!is_whole) field["parts"].fail("found parts that do not hold all triangles");
  mesh.metres_per_unit = field["metres_per_unit"].number(1e-9, 1e9);
  return made;
}

std::size_t vertexCountOf(const FaceMesh& mesh) { return mesh.vertexCount(); }

}  // namespace mouthpiece
