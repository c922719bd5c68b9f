#include <algorithm>
#include <cmath>

#include "base/errors.h"
#include "base/index.h"
#include "deform/mesh/face_mesh.h"
#include "exports/gltf/glb.h"
#include "exports/gltf/glb_model.h"

namespace mouthpiece {
namespace {

using Eigen::Index;

constexpr std::uint32_t kUnused = 0xFFFFFFFFU;
constexpr std::size_t kLongestName = 1000;  ///< bytes

/// The vertices that one part uses, renumbered from zero.
struct PartVertices {
  std::vector<std::uint32_t> vertices;  ///< of the mesh, rising
  std::vector<std::uint32_t> indices;   ///< three a triangle, into `vertices`
};

PartVertices verticesOf(const FaceMesh& mesh, const MeshPart& part) {
  PartVertices result;
  const auto first = mesh.triangles.begin() + signedIndex(part.first_triangle);
  const auto last = first + signedIndex(part.triangle_count);
  std::vector<std::uint32_t> renumbered(unsignedIndex(mesh.vertices.rows()), kUnused);
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
int addTarget(const PartVertices& part, const std::vector<ListedVertex>& listed, const float* row, float scale,
              bool with_bounds, GlbModel& model) {
  std::vector<std::uint32_t> indices;
  std::vector<float> values;
  indices.reserve(listed.size());
  values.reserve(3 * listed.size());
  for (const auto& [number, column] : listed) {
    const float* value = row + column;
    if (value[0] == 0 && value[1] == 0 && value[2] == 0) continue;
    indices.push_back(number);
    values.insert(values.end(), {scale * value[0], scale * value[1], scale * value[2]});
  }
  return model.addMostlyZeroVec3(indices, values, part.vertices.size(), with_bounds);
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

tinygltf::Material materialOf(const MeshPart& part) {
  tinygltf::Material material;
  material.name = printable(part.name, kLongestName);
  material.pbrMetallicRoughness.baseColorFactor.assign(part.base_color.begin(), part.base_color.end());
  material.pbrMetallicRoughness.metallicFactor = 0;
  material.pbrMetallicRoughness.roughnessFactor = std::clamp(part.roughness, 0.0F, 1.0F);
  // An open surface is seen from behind too when the camera goes round.
  material.doubleSided = part.kind != PartKind::kEye;
  return material;
}

tinygltf::Primitive primitiveOf(const FaceMesh& mesh, const MeshPart& part, const PrincipalShapes& shapes,
                                const ShapeNormals& normals, GlbModel& model) {
  const PartVertices own = verticesOf(mesh, part);
  const float metres = asFloat(mesh.metres_per_unit);
  tinygltf::Primitive primitive;
  const auto attribute = [&](const char* name, const std::vector<float>& values, int type, bool with_bounds) {
    primitive.attributes[name] = model.addAttribute(values, type, with_bounds);
  };
  attribute("POSITION", gathered(own, shapes.rest.data(), metres), TINYGLTF_TYPE_VEC3, true);
  attribute("NORMAL", gathered(own, normals.rest.data(), 1.0F), TINYGLTF_TYPE_VEC3, false);
  if (!mesh.vertex_colors.empty()) primitive.attributes["COLOR_0"] = model.addColors(gatheredColors(own, mesh));
  if (!mesh.texture_coordinates.empty()) {
    std::vector<float> coordinates;
    for (const std::uint32_t vertex : own.vertices) {
      const auto& [u, v] = mesh.texture_coordinates[vertex];
      coordinates.insert(coordinates.end(), {u, 1.0F - v});  // glTF counts v from the top
    }
    attribute("TEXCOORD_0", coordinates, TINYGLTF_TYPE_VEC2, false);
  }
  const std::vector<ListedVertex> moving = listedOf(own, shapes.columnVertices());
  const std::vector<ListedVertex> turning = listedOf(own, normals.vertices);
  for (Index k = 0; k < shapes.shapeCount(); ++k) {
    const int position = addTarget(own, moving, shapes.shapes.row(k).data(), metres, true, model);
    const int normal = addTarget(own, turning, normals.deltas.row(k).data(), 1.0F, false, model);
    primitive.targets.push_back({{"POSITION", position}, {"NORMAL", normal}});
  }
  primitive.indices = model.addIndices(own.indices, own.vertices.size());
  primitive.mode = TINYGLTF_MODE_TRIANGLES;
  return primitive;
}

/// About what the file takes when no shape has a zero. Memory that is never written to costs nothing.
std::size_t largestBytes(const FaceMesh& mesh, const PrincipalShapes& shapes, const ShapeNormals& normals) {
  constexpr std::size_t kBytesAVertex = 64, kBytesATriangle = 12, kBytesAShape = 4096;
  const std::size_t numbers = unsignedIndex(shapes.shapes.size() + normals.deltas.size() + shapes.weights.size());
  return sizeof(float) * numbers + kBytesAVertex * unsignedIndex(mesh.vertices.rows()) +
         kBytesATriangle * mesh.triangles.size() + kBytesAShape * unsignedIndex(shapes.shapeCount());
}

}  // namespace

std::string glbBytes(const FaceMesh& mesh, const PrincipalShapes& shapes, std::string_view name) {
  MOUTHPIECE_EXPECT(3 * mesh.vertices.rows() == shapes.rest.cols());
  MOUTHPIECE_EXPECT(!mesh.triangles.empty() && !mesh.parts.empty());
  ShapeNormals normals = shapeNormals(mesh.triangles, shapes);
  GlbModel model;
  model.reserve(largestBytes(mesh, shapes, normals));
  tinygltf::Mesh face;
  face.name = printable(name, kLongestName);
  for (const MeshPart& part : mesh.parts) {
    if (part.triangle_count == 0) continue;
    face.primitives.push_back(primitiveOf(mesh, part, shapes, normals, model));
    face.primitives.back().material = static_cast<int>(model.gltf.materials.size());
    model.gltf.materials.push_back(materialOf(part));
  }
  normals = {};
  if (shapes.shapeCount() > 0) {
    GlbModel::nameTargets(face, unsignedIndex(shapes.shapeCount()));
    model.setSpeech(unsignedIndex(shapes.frameCount()), shapes.frame_rate_hz,
                    {{{shapes.weights.data(), unsignedIndex(shapes.weights.size())}, {0}}});
  }
  model.gltf.asset.version = "2.0";
  model.gltf.asset.generator = "Mouthpiece";
  model.gltf.nodes.emplace_back();
  model.gltf.nodes[0].name = face.name;
  model.gltf.nodes[0].mesh = 0;
  model.gltf.scenes.emplace_back();
  model.gltf.scenes[0].nodes = {0};
  model.gltf.defaultScene = 0;
  model.gltf.meshes.push_back(std::move(face));
  return std::move(model).toBytes();
}

}  // namespace mouthpiece
