// A GLB whose head's lips are cut open, everything else in it kept.
#include "deform/mesh/glb_cut.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <vector>

#include "base/errors.h"
#include "base/json_text.h"
#include "deform/mesh/face_mesh.h"
#include "deform/mesh/glb_chunks.h"
#include "deform/mesh/glb_nodes.h"
#include "deform/mesh/glb_scene.h"
#include "deform/mesh/lip_cut.h"

namespace mouthpiece {
namespace {

using Eigen::Vector3f;
using nlohmann::json;

std::array<std::uint32_t, 3> sorted(Triangle t) {
  std::sort(t.begin(), t.end());
  return {t[0], t[1], t[2]};
}

template <typename T>
std::string bytesOf(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

/// Counts what names each accessor; a number inside of an extension may be one.
void countUses(const json& value, bool in_extension, std::map<std::size_t, int>& uses) {
  if (in_extension && value.is_number_unsigned()) ++uses[value.get<std::size_t>()];
  if (!value.is_structured()) return;
  for (const auto& [key, entry] : value.items()) {
    const bool names_one =
        value.is_object() && (key == "indices" || key == "input" || key == "output" || key == "inverseBindMatrices");
    if (names_one && entry.is_number_unsigned()) ++uses[entry.get<std::size_t>()];
    if (value.is_object() && key == "attributes" && entry.is_object()) {
      for (const json& attribute : entry) countUses(attribute, true, uses);
    } else if (value.is_object() && key == "targets" && entry.is_array()) {
      countUses(entry, true, uses);
    } else if (key != "extras") {
      countUses(entry, in_extension || (value.is_object() && key == "extensions"), uses);
    }
  }
}

/// Every place where a view is named, extensions' too: they all call it so.
template <typename Take>
void eachView(json& value, const Take& take) {
  if (!value.is_structured()) return;
  for (auto& [key, entry] : value.items()) {
    if (value.is_object() && key == "bufferView" && entry.is_number_unsigned())
      take(entry);
    else if (key != "extras")
      eachView(entry, take);
  }
}

class GlbCutter {
 public:
  GlbCutter(std::string_view glb, std::string_view file, const FaceMesh& given, const LipCut& cut)
      : file_(file), nodes_(glb, file), given_(given), cut_(cut) {
    const GlbChunks chunks = glbChunks(glb, file);
    root_ = json::parse(chunks.json);
    binary_ = chunks.binary;
    const json buffers = root_.value("buffers", json::array());
    if (buffers.empty() || buffers[0].contains("uri")) fail("keeps its data outside of the file");
    for (const char* list : {"meshes", "skins", "animations", "extensions"})
      countUses(root_.value(list, json()), false, uses_);
    findRun(glb);
  }

  std::string bytes() {
    findChanges();
    json& mesh = root_.at("meshes").at(unsignedIndex(run_.mesh));
    for (const std::size_t p : run_.primitives) countUsesHere(mesh["primitives"].at(p));
    for (const std::size_t p : run_.primitives) {
      changeIndices(mesh["primitives"].at(p));
      lengthenAttributes(mesh["primitives"].at(p));
    }
    addBag(mesh["primitives"]);
    dropUnseenViews();
    dropUnseenBytes();
    root_["buffers"][0]["byteLength"] = binary_.size();
    return glbOf(jsonText(root_), std::move(binary_));
  }

 private:
  [[noreturn]] void fail(std::string_view what) const { throw InputError(std::string(file_), "", what); }

  [[nodiscard]] std::size_t newVertices() const { return cut_.parents.size(); }

  void findRun(std::string_view glb) {
    const std::vector<GlbRun> runs = glbRuns(glb, file_);
    const auto runOf = [&](std::uint32_t v) {
      const auto run = std::find_if(runs.begin(), runs.end(), [&](const GlbRun& r) {
        return v >= r.first_vertex && v < r.first_vertex + r.count;
      });
      if (run == runs.end()) fail("has changed since it was read");
      return run;
    };
    std::vector<std::uint32_t> parents = cut_.parents;  // each one of the file's vertices
    for (std::uint32_t& parent : parents) {
      while (parent >= given_.vertexCount()) parent = parents[parent - given_.vertexCount()];
    }
    const auto run = runOf(parents.at(0));
    for (const std::uint32_t parent : parents) {
      if (runOf(parent) != run)
        fail("has the lips' vertices in several lists; expected skin and lips that share theirs, or an .obj to write");
      parents_.push_back(parent - run->first_vertex);
    }
    run_ = *run;
  }

  /// Moves of the given vertices, doubles of those that were cut, and the triangles that get these.
  void findChanges() {
    for (std::size_t t = 0; t < given_.triangles.size(); ++t) {
      const Triangle &before = given_.triangles[t], &after = cut_.mesh.triangles[t];
      if (before == after) continue;
      lower_.insert(sorted(before));
      for (std::size_t k = 0; k < 3; ++k) {
        if (before[k] != after[k]) doubles_[before[k]] = local(after[k]);
      }
    }
  }

  /// Number of a vertex of the cut mesh in the run's list.
  [[nodiscard]] std::uint32_t local(std::uint32_t v) const {
    const std::size_t number =
        v < given_.vertexCount() ? v - run_.first_vertex : run_.count + (v - given_.vertexCount());
    return static_cast<std::uint32_t>(number);
  }

  [[nodiscard]] Eigen::Matrix3f meshFromScene(std::size_t local_vertex) const {
    return run_.sceneFromMesh(local_vertex).inverse();
  }

  std::size_t putView(const std::string& bytes, int target, std::size_t stride) {
    binary_.resize((binary_.size() + 3) / 4 * 4, '\0');
    json view{{"buffer", 0}, {"byteOffset", binary_.size()}, {"byteLength", bytes.size()}, {"target", target}};
    if (stride > 0) view["byteStride"] = stride;
    binary_ += bytes;
    root_["bufferViews"].push_back(std::move(view));
    return root_["bufferViews"].size() - 1;
  }

  /// Puts `bytes` of `accessor`'s shape where it is, or beside it where something else names it, too.
  std::size_t putAccessor(std::size_t old, json accessor, const std::string& bytes, int target, std::size_t stride) {
    accessor.erase("sparse");
    accessor.erase("byteOffset");
    accessor["bufferView"] = putView(bytes, target, stride);
    json& accessors = root_["accessors"];
    if (uses_[old] <= uses_here_[old]) {
      accessors.at(old) = std::move(accessor);
      return old;
    }
    accessors.push_back(std::move(accessor));
    return accessors.size() - 1;
  }

  /// An attribute with its parents' elements for the new vertices, byte by byte.
  std::size_t lengthened(std::size_t old) {
    if (const auto known = lengthened_.find(old); known != lengthened_.end()) return known->second;
    const tinygltf::Accessor& accessor = nodes_.views().accessorAt(static_cast<int>(old));
    const auto width =
        unsignedIndex(tinygltf::GetComponentSizeInBytes(static_cast<std::uint32_t>(accessor.componentType)) *
                      tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(accessor.type)));
    const std::size_t stride = (width + 3) / 4 * 4;
    // Read as numbers it is checked: every index, offset and count.
    (void)nodes_.views().numbers(static_cast<int>(old), {accessor.type});
    if (accessor.count != run_.count) fail("has attributes of several lengths over one list of vertices");
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
    if (accessor.sparse.isSparse) {
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
    }
    for (std::size_t i = 0; i < newVertices(); ++i)
      std::memcpy(&bytes[(run_.count + i) * stride], &bytes[parents_[i] * stride], width);
    json made = root_.at("accessors").at(old);
    made["count"] = run_.count + newVertices();
    return lengthened_[old] = putAccessor(old, std::move(made), bytes, TINYGLTF_TARGET_ARRAY_BUFFER, stride);
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
    return lengthened_[old] = putAccessor(old, std::move(made), bytesOf(values), TINYGLTF_TARGET_ARRAY_BUFFER, 0);
  }

  /// Places as they are in the mesh's own space, in floats.
  std::size_t places(std::size_t old) {
    if (const auto known = lengthened_.find(old); known != lengthened_.end()) return known->second;
    const GlbViews::Numbers own = nodes_.views().numbers(static_cast<int>(old), {TINYGLTF_TYPE_VEC3});
    std::vector<float> values;
    const auto add = [&](std::size_t from, std::size_t to) {
      const auto parent = run_.first_vertex + from;
      const Vector3f move =
          (cut_.mesh.vertices.row(signedIndex(to)) - given_.vertices.row(signedIndex(parent))).transpose();
      const Vector3f place = own.row(signedIndex(from)).transpose() + meshFromScene(from) * move;
      values.insert(values.end(), place.data(), place.data() + 3);
    };
    for (std::size_t v = 0; v < run_.count; ++v) add(v, run_.first_vertex + v);
    for (std::size_t i = 0; i < newVertices(); ++i) add(parents_[i], given_.vertexCount() + i);
    return putVec3(old, values, true);
  }

  /// Normals; the bag has those of its own surface.
  std::size_t normals(std::size_t old) {
    if (const auto known = lengthened_.find(old); known != lengthened_.end()) return known->second;
    if (nodes_.views().accessorAt(static_cast<int>(old)).componentType != TINYGLTF_COMPONENT_TYPE_FLOAT)
      return lengthened(old);
    const GlbViews::Numbers own = nodes_.views().numbers(static_cast<int>(old), {TINYGLTF_TYPE_VEC3});
    const VertexPositions scene = vertexNormals(cut_.mesh.vertices, cut_.mesh.triangles);
    std::vector<float> values(own.data(), own.data() + own.size());
    for (std::size_t i = 0; i < newVertices(); ++i) {
      const std::size_t v = given_.vertexCount() + i;
      const bool is_double =
          std::any_of(doubles_.begin(), doubles_.end(), [&](const auto& one) { return one.second == run_.count + i; });
      Vector3f normal = own.row(signedIndex(parents_[i])).transpose();
      if (!is_double) {
        const Vector3f made = run_.sceneFromMesh(parents_[i]).transpose() * scene.row(signedIndex(v)).transpose();
        if (made.norm() > 0) normal = made.normalized();
      }
      values.insert(values.end(), normal.data(), normal.data() + 3);
    }
    return putVec3(old, values, false);
  }

  void countUsesHere(const json& primitive) {
    const json targets = primitive.value("targets", json::array());
    for (const json& accessor : primitive.at("attributes")) ++uses_here_[accessor.get<std::size_t>()];
    for (const json& target : targets) {
      for (const json& accessor : target) ++uses_here_[accessor.get<std::size_t>()];
    }
    if (primitive.contains("indices")) ++uses_here_[primitive["indices"].get<std::size_t>()];
  }

  void lengthenAttributes(json& primitive) {
    for (const auto& [name, accessor] : primitive["attributes"].items()) {
      const std::size_t old = accessor;
      accessor = name == "POSITION" ? places(old) : name == "NORMAL" ? normals(old) : lengthened(old);
    }
    if (!primitive.contains("targets")) return;
    for (json& target : primitive["targets"]) {
      for (json& accessor : target) accessor = lengthened(accessor.get<std::size_t>());
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
      return putAccessor(primitive["indices"], std::move(made), bytesOf(indices), TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER,
                         0);
    made["bufferView"] = putView(bytesOf(indices), TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER, 0);
    root_["accessors"].push_back(std::move(made));
    return root_["accessors"].size() - 1;
  }

  void addBag(json& primitives) {
    const MeshPart& part = cut_.mesh.parts.back();
    const bool is_mirrored = run_.sceneFromMesh(0).determinant() < 0;
    std::vector<std::uint32_t> indices;
    for (const Triangle& t : trianglesOf(cut_.mesh, part)) {
      indices.push_back(local(t[0]));
      indices.push_back(local(t[is_mirrored ? 2 : 1]));
      indices.push_back(local(t[is_mirrored ? 1 : 2]));
    }
    json bag{{"attributes", primitives.at(run_.primitives.at(0))["attributes"]}, {"material", addMaterial(part)}};
    if (primitives.at(run_.primitives[0]).contains("targets"))
      bag["targets"] = primitives.at(run_.primitives[0])["targets"];
    bag["indices"] = addIndices(json::object(), indices);
    primitives.push_back(std::move(bag));
  }

  std::size_t addMaterial(const MeshPart& part) {
    json& materials = root_["materials"];
    if (!materials.is_array()) materials = json::array();
    materials.push_back(
        {{"name", part.name},
         {"doubleSided", true},
         {"pbrMetallicRoughness",
          {{"baseColorFactor", part.base_color}, {"metallicFactor", 0}, {"roughnessFactor", part.roughness}}}});
    // VRM 0 has an entry a material.
    const json::json_pointer vrm("/extensions/VRM/materialProperties");
    if (root_.contains(vrm) && root_[vrm].is_array())
      root_[vrm].push_back({{"name", part.name}, {"shader", "VRM_USE_GLTFSHADER"}, {"renderQueue", 2000}});
    return materials.size() - 1;
  }

  /// Takes out views that nothing names.
  void dropUnseenViews() {
    std::set<std::size_t> seen;
    eachView(root_, [&](json& number) { seen.insert(number.get<std::size_t>()); });
    json kept = json::array();
    std::map<std::size_t, std::size_t> renamed;
    for (const std::size_t view : seen) {
      renamed[view] = kept.size();
      kept.push_back(root_["bufferViews"].at(view));
    }
    eachView(root_, [&](json& number) { number = renamed.at(number.get<std::size_t>()); });
    root_["bufferViews"] = std::move(kept);
  }

  /// Takes out of the chunk what no view shows, unless views overlap.
  void dropUnseenBytes() {
    std::vector<json*> views;
    for (json& view : root_["bufferViews"]) {
      if (view.value("buffer", std::size_t{0}) == 0) views.push_back(&view);
      if (view.contains("extensions")) return;
    }
    const auto offsetOf = [](const json* view) { return view->value("byteOffset", std::size_t{0}); };
    std::sort(views.begin(), views.end(), [&](const json* a, const json* b) { return offsetOf(a) < offsetOf(b); });
    std::size_t end = 0;
    for (const json* view : views) {
      if (offsetOf(view) < end) return;
      end = offsetOf(view) + view->at("byteLength").get<std::size_t>();
      if (end > binary_.size()) return;
    }
    std::string kept;
    for (json* view : views) {
      kept.resize((kept.size() + 3) / 4 * 4, '\0');
      const std::size_t from = offsetOf(view);
      (*view)["byteOffset"] = kept.size();
      kept.append(binary_, from, view->at("byteLength").get<std::size_t>());
    }
    binary_ = std::move(kept);
  }

  std::string_view file_;
  GlbNodes nodes_;
  const FaceMesh& given_;
  const LipCut& cut_;
  json root_;
  std::string binary_;
  GlbRun run_;                                      ///< the list of vertices that the lips are in
  std::vector<std::size_t> parents_;                ///< of the new vertices, in the list
  std::set<std::array<std::uint32_t, 3>> lower_;    ///< triangles of the given mesh under the cut
  std::map<std::uint32_t, std::uint32_t> doubles_;  ///< of given vertices, in the list
  std::map<std::size_t, int> uses_, uses_here_;     ///< of accessors: in the file, in the primitives over the list
  std::map<std::size_t, std::size_t> lengthened_;   ///< accessors that are done
};

}  // namespace

std::string cutGlb(std::string_view glb, std::string_view file, const FaceMesh& given, const LipCut& cut) {
  MOUTHPIECE_EXPECT(!cut.parents.empty() && !cut.mesh.parts.empty());
  const std::string plain = unpackedGlb(glb, file);
  try {
    return GlbCutter(plain.empty() ? glb : std::string_view(plain), file, given, cut).bytes();
  } catch (const json::exception& error) {
    throw InputError(std::string(file), "", std::string("is no GLB that can be cut: ") + error.what());
  }
}

}  // namespace mouthpiece
