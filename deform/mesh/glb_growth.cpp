// A GLB with more of a head than it had, everything else in it kept.
#include "deform/mesh/glb_growth.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <vector>

#include "base/errors.h"
#include "deform/mesh/face_mesh.h"
#include "deform/mesh/glb_chunks.h"
#include "deform/mesh/glb_document.h"
#include "deform/mesh/glb_nodes.h"
#include "deform/mesh/glb_scene.h"

namespace mouthpiece {
namespace {

using Eigen::Vector3f;
using nlohmann::json;

constexpr std::string_view kSeveralLengths = "has attributes of several lengths over one list of vertices";

std::array<std::uint32_t, 3> sorted(Triangle t) {
  std::sort(t.begin(), t.end());
  return {t[0], t[1], t[2]};
}

class GlbGrower {
 public:
  /// `run`: the list of vertices that all which is new goes with.
  GlbGrower(std::string_view glb, std::string_view file, GlbRun run, const FaceMesh& given, const GrownMesh& grown)
      : file_(file), nodes_(glb, file), document_(glb, file), given_(given), grown_(grown), run_(std::move(run)) {
    for (const std::uint32_t parent : grown.parents) parents_.push_back(parent - run_.first_vertex);
  }

  std::string bytes() {
    findChanges();
    json& mesh = root().at("meshes").at(unsignedIndex(run_.mesh));
    for (const std::size_t p : run_.primitives) claim(mesh["primitives"].at(p));
    for (const std::size_t p : run_.primitives) {
      changeIndices(mesh["primitives"].at(p));
      lengthenAttributes(mesh["primitives"].at(p));
    }
    for (std::size_t p = given_.parts.size(); p < grown_.mesh.parts.size(); ++p)
      addPart(mesh["primitives"], grown_.mesh.parts[p]);
    return document_.bytes();
  }

 private:
  [[noreturn]] void fail(std::string_view what) const { throw InputError(std::string(file_), "", what); }

  [[nodiscard]] json& root() { return document_.root(); }
  [[nodiscard]] std::size_t givenCount() const { return given_.vertexCount(); }
  [[nodiscard]] std::size_t newVertices() const { return grown_.parents.size(); }

  /// Moves of the given vertices, doubles of those that were cut, and the triangles that get these.
  void findChanges() {
    for (std::size_t t = 0; t < given_.triangles.size(); ++t) {
      const Triangle &before = given_.triangles[t], &after = grown_.mesh.triangles[t];
      if (before == after) continue;
      lower_.insert(sorted(before));
      for (std::size_t k = 0; k < 3; ++k) {
        if (before[k] == after[k]) continue;
        doubles_[before[k]] = local(after[k]);
        double_numbers_.insert(local(after[k]));
      }
    }
  }

  /// Whether the i-th new vertex is a given one's double, no part of a new surface.
  [[nodiscard]] bool isDouble(std::size_t i) const { return double_numbers_.contains(run_.count + i); }

  /// Number of a vertex of the grown mesh in the run's list.
  [[nodiscard]] std::uint32_t local(std::uint32_t v) const {
    const std::size_t number =
        v < given_.vertexCount() ? v - run_.first_vertex : run_.count + (v - given_.vertexCount());
    return static_cast<std::uint32_t>(number);
  }

  [[nodiscard]] Eigen::Matrix3f meshFromScene(std::size_t local_vertex) const {
    return run_.sceneFromMesh(local_vertex).inverse();
  }

  /// What new vertices of an attribute are: as their parents, as the mesh is coloured, or, where they belong to a new
  /// surface, zero.
  enum class Fresh { kAsParents, kColours, kZero };

  static std::size_t widthOf(const tinygltf::Accessor& accessor) {
    return unsignedIndex(tinygltf::GetComponentSizeInBytes(static_cast<std::uint32_t>(accessor.componentType)) *
                         tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(accessor.type)));
  }

  /// The elements of an attribute of the list, `stride` apart, with room for those of new vertices.
  std::string elementsOf(std::size_t number, std::size_t stride) const {
    const tinygltf::Accessor& accessor = nodes_.views().accessorAt(static_cast<int>(number));
    const std::size_t width = widthOf(accessor);
    // Read as numbers it is checked: every index, offset and count.
    (void)nodes_.views().numbers(static_cast<int>(number), {accessor.type});
    if (accessor.count != run_.count) fail(kSeveralLengths);
    std::string bytes((run_.count + newVertices()) * stride, '\0');
    const auto dataOf = [&](int view, std::size_t offset) {
      const tinygltf::BufferView& shown = nodes_.model().bufferViews[unsignedIndex(view)];
      return nodes_.model().buffers[unsignedIndex(shown.buffer)].data.data() + shown.byteOffset + offset;
    };
    if (accessor.bufferView >= 0) {
      const tinygltf::BufferView& view = nodes_.model().bufferViews[unsignedIndex(accessor.bufferView)];
      const auto* data = dataOf(accessor.bufferView, accessor.byteOffset);
      const std::size_t step = view.byteStride > 0 ? view.byteStride : width;
      for (std::size_t i = 0; i < run_.count; ++i) std::memcpy(&bytes[i * stride], data + i * step, width);
    }
    if (!accessor.sparse.isSparse) return bytes;
    const auto& sparse = accessor.sparse;
    const auto index_width =
        unsignedIndex(tinygltf::GetComponentSizeInBytes(static_cast<std::uint32_t>(sparse.indices.componentType)));
    const auto* indices = dataOf(sparse.indices.bufferView, unsignedIndex(sparse.indices.byteOffset));
    const auto* values = dataOf(sparse.values.bufferView, unsignedIndex(sparse.values.byteOffset));
    for (std::size_t i = 0; i < unsignedIndex(sparse.count); ++i) {
      std::uint32_t index = 0;  // both are little-endian
      std::memcpy(&index, indices + i * index_width, index_width);
      std::memcpy(&bytes[index * stride], values + i * width, width);
    }
    return bytes;
  }

  /// An attribute, or a shape's moves, with elements for the new vertices, byte by byte.
  std::size_t lengthened(std::size_t old, Fresh fresh, bool is_shape) {
    if (const auto known = lengthened_.find(old); known != lengthened_.end()) return known->second;
    const tinygltf::Accessor& accessor = nodes_.views().accessorAt(static_cast<int>(old));
    const std::size_t width = widthOf(accessor), stride = (width + 3) / 4 * 4;
    std::string bytes = elementsOf(old, stride);
    for (std::size_t i = 0; i < newVertices(); ++i) {
      char* element = &bytes[(run_.count + i) * stride];
      if (fresh != Fresh::kZero || isDouble(i)) std::memcpy(element, &bytes[parents_[i] * stride], width);
      if (fresh == Fresh::kColours)
        putColour(accessor.componentType, grown_.mesh.vertex_colors[givenCount() + i], element);
    }
    json made = root().at("accessors").at(old);
    made["count"] = run_.count + newVertices();
    if (fresh != Fresh::kAsParents) {
      made.erase("min");
      made.erase("max");
    }
    std::vector<std::uint32_t> moved;
    std::string moves;
    for (std::size_t v = 0; is_shape && v * stride < bytes.size(); ++v) {
      const auto element = bytes.begin() + static_cast<std::ptrdiff_t>(v * stride);
      if (std::all_of(element, element + static_cast<std::ptrdiff_t>(width), [](char c) { return c == 0; })) continue;
      moved.push_back(static_cast<std::uint32_t>(v));
      moves.append(bytes, v * stride, width);
    }
    const bool is_sparse = is_shape && moves.size() + sizeof(moved[0]) * moved.size() < bytes.size();
    return lengthened_[old] =
               is_sparse ? document_.putSparse(old, std::move(made), moved, moves)
                         : document_.putAccessor(old, std::move(made), bytes, TINYGLTF_TARGET_ARRAY_BUFFER, stride);
  }

  /// Red, green and blue as numbers of the component's type; an alpha behind them stays.
  static void putColour(int component, const std::array<float, 3>& colour, char* element) {
    const auto put = [&](auto largest) {
      for (std::size_t k = 0; k < colour.size(); ++k) {
        const auto share = static_cast<decltype(largest)>(colour[k] * static_cast<float>(largest));
        std::memcpy(element + k * sizeof share, &share, sizeof share);
      }
    };
    if (component == TINYGLTF_COMPONENT_TYPE_FLOAT) put(1.0F);
    if (component == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT) put(std::numeric_limits<std::uint16_t>::max());
    if (component == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE) put(std::numeric_limits<std::uint8_t>::max());
  }

  std::size_t putVec3(std::size_t old, const std::vector<float>& values, bool with_bounds) {
    json made{{"componentType", TINYGLTF_COMPONENT_TYPE_FLOAT}, {"type", "VEC3"}, {"count", values.size() / 3}};
    if (with_bounds) {
      std::array<float, 3> low{values[0], values[1], values[2]}, high = low;
      for (std::size_t i = 0; i < values.size(); ++i) {
        low[i % 3] = std::min(low[i % 3], values[i]);
        high[i % 3] = std::max(high[i % 3], values[i]);
      }
      made["min"] = low;
      made["max"] = high;
    }
    return lengthened_[old] =
               document_.putAccessor(old, std::move(made), bytesOf(values), TINYGLTF_TARGET_ARRAY_BUFFER, 0);
  }

  /// Places as they are in the mesh's own space, in floats.
  std::size_t places(std::size_t old) {
    if (const auto known = lengthened_.find(old); known != lengthened_.end()) return known->second;
    const GlbViews::Numbers own = nodes_.views().numbers(static_cast<int>(old), {TINYGLTF_TYPE_VEC3});
    std::vector<float> values;
    const auto add = [&](std::size_t from, std::size_t to) {
      const auto parent = run_.first_vertex + from;
      const Vector3f move =
          (grown_.mesh.vertices.row(signedIndex(to)) - given_.vertices.row(signedIndex(parent))).transpose();
      const Vector3f place = own.row(signedIndex(from)).transpose() + meshFromScene(from) * move;
      values.insert(values.end(), place.data(), place.data() + 3);
    };
    for (std::size_t v = 0; v < run_.count; ++v) add(v, run_.first_vertex + v);
    for (std::size_t i = 0; i < newVertices(); ++i) add(parents_[i], givenCount() + i);
    return putVec3(old, values, true);
  }

  /// Normals in floats; new surfaces have their own.
  std::size_t normals(std::size_t old) {
    if (const auto known = lengthened_.find(old); known != lengthened_.end()) return known->second;
    const GlbViews::Numbers own = nodes_.views().numbers(static_cast<int>(old), {TINYGLTF_TYPE_VEC3});
    if (unsignedIndex(own.rows()) != run_.count) fail(kSeveralLengths);
    const VertexPositions scene = vertexNormals(grown_.mesh.vertices, grown_.mesh.triangles);
    std::vector<float> values(own.data(), own.data() + own.size());
    for (std::size_t i = 0; i < newVertices(); ++i) {
      const std::size_t v = givenCount() + i;
      Vector3f normal = own.row(signedIndex(parents_[i])).transpose();
      if (!isDouble(i)) {
        const Vector3f made = run_.sceneFromMesh(parents_[i]).transpose() * scene.row(signedIndex(v)).transpose();
        if (made.norm() > 0) normal = made.normalized();
      }
      values.insert(values.end(), normal.data(), normal.data() + 3);
    }
    return putVec3(old, values, false);
  }

  void claim(const json& primitive) {
    const json targets = primitive.value("targets", json::array());
    for (const json& accessor : primitive.at("attributes")) document_.claim(accessor.get<std::size_t>());
    for (const json& target : targets) {
      for (const auto& [name, accessor] : target.items()) {
        document_.claim(accessor.get<std::size_t>());
        if (name == "POSITION") moves_.insert(accessor.get<std::size_t>());
      }
    }
    if (primitive.contains("indices")) document_.claim(primitive["indices"].get<std::size_t>());
  }

  void lengthenAttributes(json& primitive) {
    for (const auto& [name, accessor] : primitive["attributes"].items()) {
      const std::size_t old = accessor;
      const bool is_coloured = name == "COLOR_0" && !grown_.mesh.vertex_colors.empty();
      accessor = name == "POSITION" ? places(old)
                 : name == "NORMAL" ? normals(old)
                                    : lengthened(old, is_coloured ? Fresh::kColours : Fresh::kAsParents, false);
    }
    if (!primitive.contains("targets")) return;
    for (json& target : primitive["targets"]) {
      for (const auto& [name, accessor] : target.items()) {
        const std::size_t old = accessor;
        const bool turns = (name == "NORMAL" || name == "TANGENT") && !moves_.contains(old);
        accessor = lengthened(old, turns ? Fresh::kZero : Fresh::kAsParents, true);
      }
    }
  }

  void changeIndices(json& primitive) {
    std::vector<std::uint32_t> indices;
    if (primitive.contains("indices")) {
      indices = nodes_.views().wholes(primitive["indices"].get<int>(), {TINYGLTF_TYPE_SCALAR});
    } else {
      for (std::uint32_t v = 0; v < run_.count; ++v) indices.push_back(v);
    }
    bool is_changed = false;
    const auto first = static_cast<std::uint32_t>(run_.first_vertex);
    for (std::size_t i = 0; i + 2 < indices.size(); i += 3) {
      const Triangle own{indices[i] + first, indices[i + 1] + first, indices[i + 2] + first};
      if (!lower_.contains(sorted(own))) continue;
      for (std::size_t k = 0; k < 3; ++k) {
        if (const auto other = doubles_.find(own[k]); other != doubles_.end()) indices[i + k] = other->second;
      }
      is_changed = true;
    }
    if (is_changed) primitive["indices"] = addIndices(primitive, indices);
  }

  std::size_t addIndices(const json& primitive, const std::vector<std::uint32_t>& indices) {
    json made{{"componentType", TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT}, {"type", "SCALAR"}, {"count", indices.size()}};
    if (primitive.contains("indices"))
      return document_.putAccessor(primitive["indices"], std::move(made), bytesOf(indices),
                                   TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER, 0);
    return document_.addAccessor(std::move(made), bytesOf(indices), TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER);
  }

  void addPart(json& primitives, const MeshPart& part) {
    const bool is_mirrored = run_.sceneFromMesh(0).determinant() < 0;
    std::vector<std::uint32_t> indices;
    for (const Triangle& t : trianglesOf(grown_.mesh, part)) {
      indices.push_back(local(t[0]));
      indices.push_back(local(t[is_mirrored ? 2 : 1]));
      indices.push_back(local(t[is_mirrored ? 1 : 2]));
    }
    json made{{"attributes", primitives.at(run_.primitives.at(0))["attributes"]}, {"material", addMaterial(part)}};
    if (primitives.at(run_.primitives[0]).contains("targets"))
      made["targets"] = primitives.at(run_.primitives[0])["targets"];
    made["indices"] = addIndices(json::object(), indices);
    primitives.push_back(std::move(made));
  }

  std::size_t addMaterial(const MeshPart& part) {
    json& materials = root()["materials"];
    if (!materials.is_array()) materials = json::array();
    materials.push_back(
        {{"name", part.name},
         {"doubleSided", true},
         {"pbrMetallicRoughness",
          {{"baseColorFactor", part.base_color}, {"metallicFactor", 0}, {"roughnessFactor", part.roughness}}}});
    // VRM 0 has an entry a material.
    const json::json_pointer vrm("/extensions/VRM/materialProperties");
    if (root().contains(vrm) && root()[vrm].is_array())
      root()[vrm].push_back({{"name", part.name}, {"shader", "VRM_USE_GLTFSHADER"}, {"renderQueue", 2000}});
    return materials.size() - 1;
  }

  std::string_view file_;
  GlbNodes nodes_;
  GlbDocument document_;
  const FaceMesh& given_;
  const GrownMesh& grown_;
  GlbRun run_;
  std::vector<std::size_t> parents_;                ///< of the new vertices, in the list
  std::set<std::array<std::uint32_t, 3>> lower_;    ///< triangles of the given mesh under the cut
  std::map<std::uint32_t, std::uint32_t> doubles_;  ///< of given vertices, in the list
  std::set<std::size_t> double_numbers_;            ///< the doubles themselves
  std::set<std::size_t> moves_;                     ///< accessors of shapes' moves; zeros are often their turns, too
  std::map<std::size_t, std::size_t> lengthened_;   ///< accessors that are done
};

/// Of each vertex that is new: the given one that it goes with.
std::vector<std::uint32_t> originsOf(const GrownMesh& grown, std::size_t given) {
  std::vector<std::uint32_t> origins = grown.parents;
  for (std::uint32_t& origin : origins) {
    while (origin >= given) origin = origins.at(origin - given);
  }
  return origins;
}

/// What of `grown` goes with the given vertices of one list: `run_of_vertex` tells whose each vertex is, new ones too.
GrownMesh ofRun(const FaceMesh& given, const GrownMesh& grown, const std::vector<std::uint32_t>& origins,
                const std::vector<std::size_t>& run_of_vertex, std::size_t run) {
  GrownMesh made{grown.mesh, {}};
  std::vector<std::uint32_t> number(run_of_vertex.size());
  for (std::size_t v = 0; v < number.size(); ++v) {
    number[v] = static_cast<std::uint32_t>(v < given.vertexCount() ? v : given.vertexCount() + made.parents.size());
    if (v < given.vertexCount() || run_of_vertex[v] != run) continue;
    made.mesh.vertices.row(number[v]) = grown.mesh.vertices.row(signedIndex(v));
    if (!made.mesh.vertex_colors.empty()) made.mesh.vertex_colors[number[v]] = grown.mesh.vertex_colors[v];
    made.parents.push_back(origins[v - given.vertexCount()]);
  }
  made.mesh.vertices.conservativeResize(signedIndex(given.vertexCount() + made.parents.size()), Eigen::NoChange);
  made.mesh.triangles = given.triangles;
  made.mesh.parts = given.parts;
  for (std::size_t t = 0; t < given.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t v = grown.mesh.triangles[t][k];
      if (run_of_vertex[v] == run) made.mesh.triangles[t][k] = number[v];
    }
  }
  for (std::size_t p = given.parts.size(); p < grown.mesh.parts.size(); ++p) {
    const std::span<const Triangle> own = trianglesOf(grown.mesh, grown.mesh.parts[p]);
    if (own.empty() || run_of_vertex[own[0][0]] != run) continue;
    made.mesh.parts.push_back(grown.mesh.parts[p]);
    made.mesh.parts.back().first_triangle = made.mesh.triangles.size();
    for (const Triangle& t : own) made.mesh.triangles.push_back({number[t[0]], number[t[1]], number[t[2]]});
  }
  return made;
}

std::string grownBytes(std::string bytes, std::string_view file, std::string_view object, const FaceMesh& given,
                       const GrownMesh& grown) {
  const std::vector<GlbRun> runs = glbRuns(bytes, file, object);
  const std::vector<std::uint32_t> origins = originsOf(grown, given.vertexCount());
  std::vector<std::size_t> run_of_vertex;
  for (std::size_t run = 0; run < runs.size(); ++run) run_of_vertex.resize(run_of_vertex.size() + runs[run].count, run);
  if (run_of_vertex.size() != given.vertexCount())
    throw InputError(std::string(file), "", "has changed since it was read");
  for (const std::uint32_t origin : origins) run_of_vertex.push_back(run_of_vertex[origin]);
  std::set<std::size_t> grow;
  for (std::size_t t = 0; t < grown.mesh.triangles.size(); ++t) {
    const Triangle& corners = grown.mesh.triangles[t];
    if (t < given.triangles.size() && corners == given.triangles[t]) continue;
    for (const std::uint32_t v : corners) {
      if (run_of_vertex[v] != run_of_vertex[corners[0]])
        throw InputError(
            std::string(file), "",
            "has the lips' vertices in several lists; expected skin and lips that share theirs, or an .obj "
            "to write");
      grow.insert(run_of_vertex[v]);
    }
  }
  // From the last list to the first, so that the numbers of those to come stay.
  for (auto run = grow.rbegin(); run != grow.rend(); ++run)
    bytes = GlbGrower(bytes, file, runs[*run], given, ofRun(given, grown, origins, run_of_vertex, *run)).bytes();
  return bytes;
}

}  // namespace

std::string grownGlb(std::string_view glb, std::string_view file, std::string_view object, const FaceMesh& given,
                     const GrownMesh& grown) {
  MOUTHPIECE_EXPECT(!grown.parents.empty() && grown.mesh.triangles.size() > given.triangles.size());
  std::string plain = unpackedGlb(glb, file);
  try {
    return grownBytes(plain.empty() ? std::string(glb) : std::move(plain), file, object, given, grown);
  } catch (const json::exception& error) {
    throw InputError(std::string(file), "", std::string("is no GLB that can be added to: ") + error.what());
  }
}

}  // namespace mouthpiece
