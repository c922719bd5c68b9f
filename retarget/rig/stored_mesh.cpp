#include "retarget/rig/stored_mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "base/json_text.h"
#include "deform/mesh/face_mesh.h"

namespace mouthpiece {
namespace {

constexpr float kLargest = 1e9F;

/// Rows of N numbers that are usable; `count` of them, or any where that is 0.
template <std::size_t N>
std::vector<std::array<float, N>> rowsOf(const JsonField& field, std::size_t count) {
  const std::vector<float> values = field.blob<float>();
  if (values.size() % N != 0 || (count != 0 && values.size() != N * count))
    field.fail(fmt::format("found {} numbers; expected {} rows of {}", values.size(), count, N));
  if (!std::all_of(values.begin(), values.end(), [](float value) { return std::abs(value) <= kLargest; }))
    field.fail("found a number that is not usable");
  std::vector<std::array<float, N>> rows(values.size() / N);
  if (!rows.empty()) std::memcpy(rows.data(), values.data(), values.size() * sizeof(float));
  return rows;
}

/// Base colour and roughness.
using Look = std::array<float, 5>;

}  // namespace

nlohmann::json meshToJson(const FaceMesh& mesh, bool looks) {
  nlohmann::json parts = nlohmann::json::array();
  for (const MeshPart& part : mesh.parts)
    parts.push_back({{"name", part.name},
                     {"kind", std::string(nameOf(part.kind))},
                     {"triangles", part.triangle_count},
                     {"stands_off", part.stands_off}});
  nlohmann::json stored{{"vertices", blobOf(mesh.vertices)},
                        {"triangles", blobOf(std::span(mesh.triangles.data()->data(), 3 * mesh.triangles.size()))},
                        {"parts", std::move(parts)},
                        {"metres_per_unit", mesh.metres_per_unit}};
  if (!looks) return stored;
  std::vector<Look> part_looks;
  std::vector<std::int32_t> materials;
  for (const MeshPart& part : mesh.parts) {
    const auto& [red, green, blue, alpha] = part.base_color;
    part_looks.push_back({red, green, blue, alpha, part.roughness});
    materials.push_back(part.material);
  }
  stored["looks"] = blobOf(part_looks);
  stored["materials"] = blobOf(materials);
  stored["vertex_colors"] = blobOf(mesh.vertex_colors);
  stored["texture_coordinates"] = blobOf(mesh.texture_coordinates);
  return stored;
}

std::shared_ptr<const FaceMesh> meshFrom(const JsonField& field) {
  auto made = std::make_shared<FaceMesh>();
  FaceMesh& mesh = *made;
  const auto vertices = rowsOf<3>(field["vertices"], 0);
  if (vertices.empty()) field["vertices"].fail("found no vertex");
  mesh.vertices = Eigen::Map<const VertexPositions>(vertices.data()->data(), signedIndex(vertices.size()), 3);
  const auto corners = field["triangles"].blob<std::uint32_t>();
  if (corners.size() % 3 != 0) field["triangles"].fail("expected three corners a triangle");
  if (std::any_of(corners.begin(), corners.end(), [&](std::uint32_t v) { return v >= vertices.size(); }))
    field["triangles"].fail("found a corner that is no vertex");
  mesh.triangles.resize(corners.size() / 3);
  if (!corners.empty()) std::memcpy(mesh.triangles.data(), corners.data(), corners.size() * sizeof(std::uint32_t));
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
  if (!field["looks"].exists()) return made;
  const auto looks = rowsOf<std::tuple_size_v<Look>>(field["looks"], mesh.parts.size());
  const auto materials = field["materials"].blob<std::int32_t>();
  if (materials.size() != mesh.parts.size()) field["materials"].fail("expected one a part");
  for (std::size_t i = 0; i < mesh.parts.size(); ++i) {
    std::copy_n(looks[i].begin(), mesh.parts[i].base_color.size(), mesh.parts[i].base_color.begin());
    mesh.parts[i].roughness = looks[i].back();
    mesh.parts[i].material = materials[i];
  }
  const auto ofVertices = [&](const char* name, auto& rows) {
    using Row = typename std::decay_t<decltype(rows)>::value_type;
    if (!field[name].bytes().empty()) rows = rowsOf<std::tuple_size_v<Row>>(field[name], vertices.size());
  };
  ofVertices("vertex_colors", mesh.vertex_colors);
  ofVertices("texture_coordinates", mesh.texture_coordinates);
  return made;
}

}  // namespace mouthpiece
