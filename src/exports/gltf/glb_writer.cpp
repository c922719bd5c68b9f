#include "exports/gltf/glb_writer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "base/errors.h"
#include "base/files.h"
#include "exports/gltf/glb_buffer.h"
#include "exports/gltf/shape_normals.h"

namespace mouthpiece {
namespace {

using Eigen::Index;
using nlohmann::json;

constexpr int kTriangles = 4;
constexpr std::uint32_t kUnused = 0xFFFFFFFFU;

/// The vertices that one part uses, renumbered from zero.
struct PartVertices {
  std::vector<std::uint32_t> vertices;  ///< of the mesh, rising
  std::vector<std::uint32_t> indices;   ///< three a triangle, into `vertices`
};

PartVertices verticesOf(const FaceMesh& mesh, const MeshPart& part) {
  PartVertices result;
  const auto first = mesh.triangles.begin() + static_cast<std::ptrdiff_t>(part.first_triangle);
  const auto last = first + static_cast<std::ptrdiff_t>(part.triangle_count);
  std::vector<std::uint32_t> renumbered(static_cast<std::size_t>(mesh.vertices.rows()), kUnused);
  for (auto triangle = first; triangle != last; ++triangle) {
    for (const std::uint32_t vertex : *triangle) renumbered[vertex] = 0;
  }
  for (std::uint32_t vertex = 0; vertex < renumbered.size(); ++vertex) {
    if (renumbered[vertex] == kUnused) continue;
    renumbered[vertex] = static_cast<std::uint32_t>(result.vertices.size());
    result.vertices.push_back(vertex);
  }
  result.indices.reserve(3 * part.triangle_count);
  for (auto triangle = first; triangle != last; ++triangle) {
    for (const std::uint32_t vertex : *triangle) result.indices.push_back(renumbered[vertex]);
  }
  return result;
}

/// The part's own values out of a row of 3 * vertices, times `scale`.
std::vector<float> gathered(const PartVertices& part, const float* row, float scale) {
  std::vector<float> values;
  values.reserve(3 * part.vertices.size());
  for (const std::uint32_t vertex : part.vertices) {
    for (std::size_t axis = 0; axis < 3; ++axis) values.push_back(scale * row[3 * std::size_t{vertex} + axis]);
  }
  return values;
}

/// A vertex of a part that has values in a row of some of the mesh's vertices.
struct ListedVertex {
  std::uint32_t number;  ///< within the part
  std::uint32_t column;  ///< of its x in the row
};

/// The part's vertices among `vertices` (rising), those of a row's columns.
std::vector<ListedVertex> listedOf(const PartVertices& part, const std::vector<std::uint32_t>& vertices) {
  std::vector<ListedVertex> listed;
  std::size_t at = 0;
  for (std::uint32_t i = 0; i < part.vertices.size(); ++i) {
    while (at < vertices.size() && vertices[at] < part.vertices[i]) ++at;
    if (at < vertices.size() && vertices[at] == part.vertices[i])
      listed.push_back({i, static_cast<std::uint32_t>(3 * at)});
  }
  return listed;
}

/// The part's values of one shape as an accessor; only `listed` ones may differ from zero.
std::size_t addTarget(const PartVertices& part, const std::vector<ListedVertex>& listed, const float* row, float scale,
                      bool with_bounds, GlbBuffer& buffer) {
  std::vector<std::uint32_t> indices(listed.size());
  std::vector<float> values(3 * listed.size());
  std::size_t count = 0;
  for (const auto& [number, column] : listed) {
    const float* value = row + column;
    indices[count] = number;
    for (std::size_t axis = 0; axis < 3; ++axis) values[3 * count + axis] = scale * value[axis];
    count += static_cast<std::size_t>(value[0] != 0 || value[1] != 0 || value[2] != 0);
  }
  return buffer.addMostlyZeroVec3(std::span(indices).first(count), std::span(values).first(3 * count),
                                  part.vertices.size(), with_bounds);
}

std::vector<std::uint16_t> gatheredColors(const PartVertices& part, const FaceMesh& mesh) {
  std::vector<std::uint16_t> colors;
  colors.reserve(4 * part.vertices.size());
  for (const std::uint32_t vertex : part.vertices) {
    for (const float channel : mesh.vertex_colors[vertex]) {
      colors.push_back(static_cast<std::uint16_t>(std::lround(65535.0F * std::clamp(channel, 0.0F, 1.0F))));
    }
    colors.push_back(65535);
  }
  return colors;
}

json materialOf(const MeshPart& part) {
  json material{{"name", part.name},
                {"pbrMetallicRoughness",
                 {{"baseColorFactor", part.base_color},
                  {"metallicFactor", 0.0},
                  {"roughnessFactor", std::clamp(part.roughness, 0.0F, 1.0F)}}}};
  // An open surface is seen from behind too when the camera goes round.
  if (part.kind != PartKind::kEye) material["doubleSided"] = true;
  if (part.base_color[3] < 1.0F) material["alphaMode"] = "BLEND";
  return material;
}

json primitiveOf(const FaceMesh& mesh, const MeshPart& part, const PrincipalShapes& shapes, const ShapeNormals& normals,
                 std::size_t material, GlbBuffer& buffer) {
  const PartVertices own = verticesOf(mesh, part);
  const auto metres = static_cast<float>(mesh.metres_per_unit);
  json attributes{{"POSITION", buffer.addVec3(gathered(own, shapes.rest.data(), metres), true)},
                  {"NORMAL", buffer.addVec3(gathered(own, normals.rest.data(), 1.0F), false)}};
  if (!mesh.vertex_colors.empty()) attributes["COLOR_0"] = buffer.addColors(gatheredColors(own, mesh));
  if (!mesh.texture_coordinates.empty()) {
    std::vector<float> coordinates;
    for (const std::uint32_t vertex : own.vertices) {
      const auto& [u, v] = mesh.texture_coordinates[vertex];
      coordinates.insert(coordinates.end(), {u, 1.0F - v});  // glTF counts v from the top
    }
    attributes["TEXCOORD_0"] = buffer.addVec2(coordinates);
  }
  const std::vector<ListedVertex> moving = listedOf(own, shapes.columnVertices());
  const std::vector<ListedVertex> turning = listedOf(own, normals.vertices);
  json targets = json::array();
  for (Index k = 0; k < shapes.shapeCount(); ++k) {
    targets.push_back({{"POSITION", addTarget(own, moving, shapes.shapes.row(k).data(), metres, true, buffer)},
                       {"NORMAL", addTarget(own, turning, normals.deltas.row(k).data(), 1.0F, false, buffer)}});
  }
  json primitive{{"attributes", std::move(attributes)},
                 {"indices", buffer.addIndices(own.indices, own.vertices.size())},
                 {"material", material},
                 {"mode", kTriangles}};
  if (!targets.empty()) primitive["targets"] = std::move(targets);
  return primitive;
}

/// About what the file takes when no shape has a zero. Memory that is never written to costs nothing.
std::size_t largestBytes(const FaceMesh& mesh, const PrincipalShapes& shapes, const ShapeNormals& normals) {
  constexpr std::size_t kBytesAVertex = 64, kBytesATriangle = 12, kBytesAShape = 4096;
  const auto numbers = static_cast<std::size_t>(shapes.shapes.size() + normals.deltas.size() + shapes.weights.size());
  return sizeof(float) * numbers + kBytesAVertex * static_cast<std::size_t>(mesh.vertices.rows()) +
         kBytesATriangle * mesh.triangles.size() + kBytesAShape * static_cast<std::size_t>(shapes.shapeCount());
}

json animationOf(const PrincipalShapes& shapes, GlbBuffer& buffer) {
  std::vector<float> times(static_cast<std::size_t>(shapes.frameCount()));
  for (std::size_t f = 0; f < times.size(); ++f) {
    times[f] = static_cast<float>(static_cast<double>(f) / shapes.frame_rate_hz);
  }
  const std::span<const float> weights(shapes.weights.data(), static_cast<std::size_t>(shapes.weights.size()));
  const json sampler{{"input", buffer.addScalars(times, true)},
                     {"output", buffer.addScalars(weights, false)},
                     {"interpolation", "LINEAR"}};
  const json channel{{"sampler", 0}, {"target", {{"node", 0}, {"path", "weights"}}}};
  return {{"name", "speech"}, {"samplers", json::array({sampler})}, {"channels", json::array({channel})}};
}

}  // namespace

std::string glbBytes(const FaceMesh& mesh, const PrincipalShapes& shapes, std::string_view name) {
  MOUTHPIECE_EXPECT(3 * mesh.vertices.rows() == shapes.rest.cols());
  MOUTHPIECE_EXPECT(!mesh.triangles.empty() && !mesh.parts.empty());
  ShapeNormals normals = shapeNormals(mesh.triangles, shapes);
  GlbBuffer buffer;
  buffer.reserve(largestBytes(mesh, shapes, normals));
  json primitives = json::array();
  json materials = json::array();
  for (const MeshPart& part : mesh.parts) {
    if (part.triangle_count == 0) continue;
    primitives.push_back(primitiveOf(mesh, part, shapes, normals, materials.size(), buffer));
    materials.push_back(materialOf(part));
  }
  normals = {};
  json root{{"asset", {{"version", "2.0"}, {"generator", "Mouthpiece"}}},
            {"scene", 0},
            {"scenes", json::array({{{"nodes", {0}}}})},
            {"nodes", json::array({{{"name", name}, {"mesh", 0}}})},
            {"materials", std::move(materials)}};
  json face{{"name", name}, {"primitives", std::move(primitives)}};
  if (shapes.shapeCount() > 0) {
    face["weights"] = std::vector<float>(static_cast<std::size_t>(shapes.shapeCount()), 0.0F);
    json names = json::array();
    for (Index k = 0; k < shapes.shapeCount(); ++k) names.push_back(fmt::format("shape_{:02}", k));
    face["extras"] = {{"targetNames", std::move(names)}};  // what Blender, three.js and others read them from
    root["animations"] = json::array({animationOf(shapes, buffer)});
  }
  root["meshes"] = json::array({std::move(face)});
  return std::move(buffer).toGlb(std::move(root));
}

void writeGlb(const std::filesystem::path& path, const FaceMesh& mesh, const PrincipalShapes& shapes,
              std::string_view name) {
  writeFileAtomically(path, glbBytes(mesh, shapes, name));
}

}  // namespace mouthpiece
