#include <fmt/format.h>
#include <meshoptimizer.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

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
  std::vector<std::uint32_t> vertices;  ///< of the mesh: rising, or as the triangles use them first
  std::vector<std::uint32_t> indices;   ///< three a triangle, into `vertices`
};

void orderAsUsed(PartVertices& part) {
  std::vector<std::uint32_t> triangles(part.indices.size());
  meshopt_optimizeVertexCacheFifo(triangles.data(), part.indices.data(), part.indices.size(), part.vertices.size(), 16);
  std::vector<std::uint32_t> renumbered(part.vertices.size(), kUnused), vertices;
  for (std::uint32_t& vertex : triangles) {
    if (renumbered[vertex] == kUnused) {
      renumbered[vertex] = static_cast<std::uint32_t>(vertices.size());
      vertices.push_back(part.vertices[vertex]);
    }
    vertex = renumbered[vertex];
  }
  part = {std::move(vertices), std::move(triangles)};
}

/// `as_used`: triangles and vertices in the order in which they pack best.
PartVertices verticesOf(const FaceMesh& mesh, const MeshPart& part, bool as_used) {
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
  if (as_used) orderAsUsed(result);
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

/// Where the shapes' rows have each vertex of the mesh; -1 for those that no shape moves.
std::vector<Index> columnsOf(const PrincipalShapes& shapes) {
  std::vector<Index> columns(unsignedIndex(shapes.rest.cols() / 3), -1);
  Index column = -3;
  for (const std::uint32_t vertex : shapes.columnVertices()) columns[vertex] = column += 3;
  return columns;
}

/// Adds a part's values of one shape after another as accessors.
class TargetWriter {
 public:
  /// Both must outlive the writer. `columns`: columnsOf() the shapes.
  TargetWriter(const PartVertices& part, const std::vector<Index>& columns, GlbModel& model)
      : part_(part), model_(model) {
    const auto [least, most] = std::minmax_element(part.vertices.begin(), part.vertices.end());
    first_ = *least;
    numbers_.resize(*most - first_ + 1, kUnused);
    for (std::uint32_t i = 0; i < part.vertices.size(); ++i) {
      numbers_[part.vertices[i] - first_] = i;
      if (columns[part.vertices[i]] >= 0) movers_.push_back({i, columns[part.vertices[i]]});
    }
    indices_.resize(part.vertices.size());
    values_.resize(3 * part.vertices.size());
  }

  /// `row`: of the shapes.
  std::size_t addMoves(const float* row, float scale) {
    count_ = 0;
    for (const auto& [number, column] : movers_) {
      const float* value = row + column;
      if (value[0] != 0 || value[1] != 0 || value[2] != 0) put(number, value, scale);
    }
    return add(GlbUse::kMove);
  }

  std::size_t addTurns(const ShapeNormals::Turns& turns) {
    count_ = 0;
    const auto& vertices = turns.vertices;
    auto at = unsignedIndex(std::lower_bound(vertices.begin(), vertices.end(), first_) - vertices.begin());
    for (; at < vertices.size() && vertices[at] - first_ < numbers_.size(); ++at) {
      if (const std::uint32_t number = numbers_[vertices[at] - first_]; number != kUnused)
        put(number, &turns.values[3 * at], 1);
    }
    return add(GlbUse::kTurn);
  }

 private:
  /// A vertex within the part, and where the shapes have it.
  struct Mover {
    std::uint32_t number;
    Index column;
  };

  void put(std::uint32_t number, const float* value, float scale) {
    indices_[count_] = number;
    for (std::size_t axis = 0; axis < 3; ++axis) values_[3 * count_ + axis] = scale * value[axis];
    ++count_;
  }

  std::size_t add(GlbUse use) {
    return model_.addMostlyZeroVec3(std::span(indices_).first(count_), std::span(values_).first(3 * count_),
                                    part_.vertices.size(), use);
  }

  const PartVertices& part_;
  GlbModel& model_;
  std::uint32_t first_ = 0;             ///< the part's least vertex of the mesh
  std::vector<std::uint32_t> numbers_;  ///< of the mesh's vertices from it on, within the part
  std::vector<Mover> movers_;
  std::size_t count_ = 0;  ///< of what is put together, at the beginning of these
  std::vector<std::uint32_t> indices_;
  std::vector<float> values_;
};

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

nlohmann::json materialOf(const MeshPart& part) {
  nlohmann::json surface{{"metallicFactor", 0.0}};
  const float roughness = std::clamp(part.roughness, 0.0F, 1.0F);
  if (roughness != 1.0F) surface["roughnessFactor"] = static_cast<double>(roughness);
  if (part.base_color != std::array<float, 4>{1, 1, 1, 1})
    surface["baseColorFactor"] = std::vector<double>(part.base_color.begin(), part.base_color.end());
  nlohmann::json material{{"name", printable(part.name, kLongestName)}, {"pbrMetallicRoughness", surface}};
  // An open surface is seen from behind too when the camera goes round.
  if (part.kind != PartKind::kEye) material["doubleSided"] = true;
  return material;
}

nlohmann::json primitiveOf(const FaceMesh& mesh, const MeshPart& part, const PrincipalShapes& shapes,
                           const std::vector<Index>& columns, const ShapeNormals& normals, GlbModel& model) {
  const PartVertices own = verticesOf(mesh, part, model.isPacked());
  const float metres = asFloat(mesh.metres_per_unit);
  constexpr int kTriangles = 4;
  nlohmann::json primitive{{"mode", kTriangles}, {"attributes", nlohmann::json::object()}};
  const auto attribute = [&](const char* name, const std::vector<float>& values, GlbType type, GlbUse use) {
    primitive["attributes"][name] = model.addAttribute(values, type, use);
  };
  attribute("POSITION", gathered(own, shapes.rest.data(), metres), GlbType::kVec3, GlbUse::kPlace);
  attribute("NORMAL", gathered(own, normals.rest.data(), 1.0F), GlbType::kVec3, GlbUse::kNormal);
  if (!mesh.vertex_colors.empty()) primitive["attributes"]["COLOR_0"] = model.addColors(gatheredColors(own, mesh));
  if (!mesh.texture_coordinates.empty()) {
    std::vector<float> coordinates;
    for (const std::uint32_t vertex : own.vertices) {
      const auto& [u, v] = mesh.texture_coordinates[vertex];
      coordinates.insert(coordinates.end(), {u, 1.0F - v});  // glTF counts v from the top
    }
    attribute("TEXCOORD_0", coordinates, GlbType::kVec2, GlbUse::kOther);
  }
  nlohmann::json targets = nlohmann::json::array();
  TargetWriter writer(own, columns, model);
  for (Index k = 0; k < shapes.shapeCount(); ++k) {
    const std::size_t position = writer.addMoves(shapes.shapes.row(k).data(), metres);
    const std::size_t normal = writer.addTurns(normals.shapes[unsignedIndex(k)]);
    targets.push_back({{"POSITION", position}, {"NORMAL", normal}});
  }
  if (!targets.empty()) primitive["targets"] = std::move(targets);
  primitive["indices"] = model.addIndices(own.indices, own.vertices.size());
  return primitive;
}

/// About what the file takes when no shape has a zero. Memory that is never written to costs nothing.
std::size_t largestBytes(const FaceMesh& mesh, const PrincipalShapes& shapes, const ShapeNormals& normals) {
  constexpr std::size_t kBytesAVertex = 64, kBytesATriangle = 12, kBytesAShape = 4096;
  std::size_t numbers = unsignedIndex(shapes.shapes.size() + shapes.weights.size());
  for (const ShapeNormals::Turns& turns : normals.shapes) numbers += 2 * turns.values.size();
  return sizeof(float) * numbers + kBytesAVertex * unsignedIndex(mesh.vertices.rows()) +
         kBytesATriangle * mesh.triangles.size() + kBytesAShape * unsignedIndex(shapes.shapeCount());
}

}  // namespace

namespace {

void packPlaces(const FaceMesh& mesh, const PrincipalShapes& shapes, GlbModel& model) {
  std::array<double, 3> lowest{}, highest{};
  for (Index axis = 0; axis < 3; ++axis) {
    const auto column = shapes.rest(0, Eigen::seqN(axis, mesh.vertices.rows(), 3));
    lowest[unsignedIndex(axis)] = mesh.metres_per_unit * static_cast<double>(column.minCoeff());
    highest[unsignedIndex(axis)] = mesh.metres_per_unit * static_cast<double>(column.maxCoeff());
  }
  model.pack(lowest, highest);
}

std::string written(const FaceMesh& mesh, const PrincipalShapes& shapes, std::string_view name,
                    std::span<const std::string> shape_names, bool is_small, const HeadAnimation* head,
                    const ShapeNormals& normals) {
  MOUTHPIECE_EXPECT(3 * mesh.vertices.rows() == shapes.rest.cols());
  MOUTHPIECE_EXPECT(!mesh.triangles.empty() && !mesh.parts.empty());
  MOUTHPIECE_EXPECT(std::ssize(normals.shapes) == shapes.shapeCount());
  GlbModel model;
  if (is_small) {
    packPlaces(mesh, shapes, model);
  } else {
    model.reserve(largestBytes(mesh, shapes, normals));
  }
  const std::vector<Index> columns = columnsOf(shapes);
  const std::string shown_name = printable(name, kLongestName);
  nlohmann::json face{{"name", shown_name}, {"primitives", nlohmann::json::array()}};
  model.root["materials"] = nlohmann::json::array();
  for (const MeshPart& part : mesh.parts) {
    if (part.triangle_count == 0) continue;
    face["primitives"].push_back(primitiveOf(mesh, part, shapes, columns, normals, model));
    face["primitives"].back()["material"] = model.root["materials"].size();
    model.root["materials"].push_back(materialOf(part));
  }
  if (shapes.shapeCount() > 0) {
    // What Blender, three.js and others read them from.
    nlohmann::json names = nlohmann::json::array();
    for (Eigen::Index k = 0; k < shapes.shapeCount(); ++k)
      names.push_back(unsignedIndex(k) < shape_names.size() ? printable(shape_names[unsignedIndex(k)], kLongestName)
                                                            : fmt::format("shape_{:02}", k));
    face["extras"] = {{"targetNames", std::move(names)}};
    face["weights"] = std::vector<double>(unsignedIndex(shapes.shapeCount()), 0.0);
    if (shapes.frameCount() > 0)
      model.addSpeech(unsignedIndex(shapes.frameCount()), shapes.frame_rate_hz,
                      {{{shapes.weights.data(), unsignedIndex(shapes.weights.size())}, {0}}});
  }
  model.root["asset"] = {{"version", "2.0"}, {"generator", "Mouthpiece"}};
  model.root["nodes"] = {{{"name", shown_name}, {"mesh", 0}}};
  if (is_small) {
    model.root["nodes"][0]["translation"] = model.placeOrigin();
    model.root["nodes"][0]["scale"] = std::vector<double>(3, model.placeUnit());
  }
  model.root["scenes"] = {{{"nodes", {0}}}};
  model.root["scene"] = 0;
  if (head != nullptr && std::ssize(head->rotations) == shapes.frameCount() && model.root.contains("animations"))
    model.addHead(head->rotations, head->pivot_m);
  model.root["meshes"] = nlohmann::json::array({std::move(face)});
  return std::move(model).toBytes();
}

}  // namespace

std::string glbBytes(const FaceMesh& mesh, const PrincipalShapes& shapes, std::string_view name,
                     std::span<const std::string> shape_names, const HeadAnimation* head, const ShapeNormals* normals) {
  if (normals == nullptr) {
    const ShapeNormals made = shapeNormals(mesh.triangles, shapes);
    return glbBytes(mesh, shapes, name, shape_names, head, &made);
  }
  return written(mesh, shapes, name, shape_names, false, head, *normals);
}

std::string smallGlbBytes(const FaceMesh& mesh, const PrincipalShapes& shapes, std::string_view name,
                          const HeadAnimation* head, const ShapeNormals* normals) {
  if (normals == nullptr) {
    const ShapeNormals made = shapeNormals(mesh.triangles, shapes);
    return smallGlbBytes(mesh, shapes, name, head, &made);
  }
  return written(mesh, shapes, name, {}, true, head, *normals);
}

}  // namespace mouthpiece
