// GLB through tinygltf, which parses the JSON; every offset and count it hands over is checked here before it is used.
#include <fmt/format.h>
#include <tiny_gltf.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstring>
#include <map>

#include "base/errors.h"
#include "deform/mesh/mesh_reader.h"

namespace mouthpiece {
namespace {

constexpr int kMaxNodeDepth = 64;
constexpr std::size_t kMaxNodeVisits = 10'000;

bool keepImageUndecoded(tinygltf::Image*, const int, std::string*, std::string*, int, int, const unsigned char*, int,
                        void*) {
  return true;
}

/// A GLB stands alone: whatever else it names is not opened.
tinygltf::FsCallbacks noFiles() {
  tinygltf::FsCallbacks callbacks{};
  callbacks.FileExists = [](const std::string&, void*) { return false; };
  callbacks.ExpandFilePath = [](const std::string& path, void*) { return path; };
  callbacks.ReadWholeFile = [](std::vector<unsigned char>*, std::string*, const std::string&, void*) { return false; };
  callbacks.WriteWholeFile = [](std::string*, const std::string&, const std::vector<unsigned char>&, void*) {
    return false;
  };
  return callbacks;
}

/// Reads a number that may stand anywhere.
template <typename Number>
Number numberAt(const unsigned char* place) {
  Number value{};
  std::memcpy(&value, place, sizeof value);
  return value;
}

/// An entry of one of the model's lists, by a number that the file gives. Throws InputError.
template <typename Item>
const Item& itemAt(const std::vector<Item>& items, int index, std::string_view what, std::string_view file) {
  if (index < 0 || unsignedIndex(index) >= items.size())
    throw InputError(file, "", fmt::format("names a {} that it does not hold", what));
  return items[unsignedIndex(index)];
}

/// Elements of a GLB's buffer, all of whose bytes are there.
struct GlbView {
  const unsigned char* data = nullptr;
  std::size_t count = 0;
  std::size_t stride = 0;
  int component = 0;  ///< tinygltf's number of the type of one component

  [[nodiscard]] const unsigned char* at(std::size_t i) const { return data + i * stride; }
  [[nodiscard]] Eigen::Vector3f vec3(std::size_t i) const {
    return {numberAt<float>(at(i)), numberAt<float>(at(i) + 4), numberAt<float>(at(i) + 8)};
  }
  /// Component k of element i as a number; whole numbers are shares of their type's largest. Not finite: 0.
  [[nodiscard]] float channel(std::size_t i, std::size_t k) const {
    if (component == TINYGLTF_COMPONENT_TYPE_FLOAT) {
      const float value = numberAt<float>(at(i) + 4 * k);
      return std::isfinite(value) ? value : 0.0F;
    }
    if (component == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT)
      return asFloat(numberAt<std::uint16_t>(at(i) + 2 * k)) / 65535.0F;
    return asFloat(at(i)[k]) / 255.0F;
  }
};

/// A GLB's accessors and buffer views, every index, offset and count of which is checked. Each throws InputError.
class GlbViews {
 public:
  /// Both must outlive it; `file` is for messages.
  GlbViews(const tinygltf::Model& model, std::string_view file) : model_(model), file_(file) {}

  [[nodiscard]] const tinygltf::Accessor& accessorAt(int index) const {
    return itemAt(model_.accessors, index, "accessor", file_);
  }

  /// A plain accessor of tinygltf's `type`.
  [[nodiscard]] GlbView accessor(int index, int type) const {
    const tinygltf::Accessor& wanted = accessorAt(index);
    if (wanted.sparse.isSparse) fail("found a sparse accessor; expected plain ones");
    if (wanted.type != type) fail("found an accessor of the wrong type");
    return plainPart(wanted);
  }

  /// `count` moves of an accessor that may be sparse: what it leaves out is zero.
  [[nodiscard]] VertexPositions moves(int index, std::size_t count) const {
    const tinygltf::Accessor& wanted = accessorAt(index);
    if (wanted.count != count || wanted.type != TINYGLTF_TYPE_VEC3 ||
        wanted.componentType != TINYGLTF_COMPONENT_TYPE_FLOAT)
      fail("found a shape that is no list of one move a vertex");
    VertexPositions moves = VertexPositions::Zero(signedIndex(count), 3);
    if (wanted.bufferView >= 0) {
      const GlbView view = plainPart(wanted);
      for (std::size_t i = 0; i < count; ++i) moves.row(signedIndex(i)) = view.vec3(i).transpose();
    }
    const auto& sparse = wanted.sparse;
    if (!sparse.isSparse) return moves;
    if (sparse.count < 0 || unsignedIndex(sparse.count) > count) fail("found a damaged sparse accessor");
    const std::size_t replaced = unsignedIndex(sparse.count);
    const GlbView at =
        packed(sparse.indices.bufferView, sparse.indices.byteOffset, sparse.indices.componentType, 1, replaced);
    const GlbView values =
        packed(sparse.values.bufferView, sparse.values.byteOffset, TINYGLTF_COMPONENT_TYPE_FLOAT, 3, replaced);
    for (std::size_t i = 0; i < replaced; ++i) {
      const std::size_t vertex = indexAt(at, i);
      if (vertex >= count) fail("found a sparse accessor with an index out of range");
      moves.row(signedIndex(vertex)) = values.vec3(i).transpose();
    }
    return moves;
  }

  /// Element i of a view of whole numbers.
  [[nodiscard]] std::size_t indexAt(const GlbView& view, std::size_t i) const {
    if (view.component == TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT) return numberAt<std::uint32_t>(view.at(i));
    if (view.component == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT) return numberAt<std::uint16_t>(view.at(i));
    if (view.component != TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE) fail("found indices that are no whole numbers");
    return *view.at(i);
  }

 private:
  [[noreturn]] void fail(std::string_view what) const { throw InputError(file_, "", what); }

  /// The bytes of a buffer view.
  [[nodiscard]] std::span<const unsigned char> bytesOf(int view_index) const {
    const tinygltf::BufferView& view = itemAt(model_.bufferViews, view_index, "buffer view", file_);
    const std::vector<unsigned char>& data = itemAt(model_.buffers, view.buffer, "buffer", file_).data;
    if (view.byteOffset > data.size() || view.byteLength > data.size() - view.byteOffset)
      fail(fmt::format("buffer view {} reaches beyond its buffer of {} bytes", view_index, data.size()));
    return {data.data() + view.byteOffset, view.byteLength};
  }

  static int componentSize(int component) { return tinygltf::GetComponentSizeInBytes(unsignedWord(component)); }
  static std::uint32_t unsignedWord(int number) { return static_cast<std::uint32_t>(number); }

  /// An accessor's own elements, whether or not a sparse part replaces some of them.
  [[nodiscard]] GlbView plainPart(const tinygltf::Accessor& accessor) const {
    const std::span<const unsigned char> bytes = bytesOf(accessor.bufferView);
    const std::size_t declared = model_.bufferViews[unsignedIndex(accessor.bufferView)].byteStride;
    const int size = componentSize(accessor.componentType);
    const int components = tinygltf::GetNumComponentsInType(unsignedWord(accessor.type));
    if (size <= 0 || components <= 0) fail("found an accessor of an unknown type");
    const std::size_t element = unsignedIndex(size * components);
    const std::size_t stride = declared == 0 ? element : declared;
    // Each factor is bounded before it is multiplied, so the product cannot wrap.
    const bool fits =
        accessor.byteOffset <= bytes.size() && stride >= element && stride <= 4096 &&
        accessor.count <= kMaxMeshVertices * 8 &&
        (accessor.count == 0 || (accessor.count - 1) * stride + element <= bytes.size() - accessor.byteOffset);
    if (!fits) {
      fail(fmt::format("accessor {} reaches beyond its buffer of {} bytes", &accessor - model_.accessors.data(),
                       bytes.size()));
    }
    return {bytes.data() + accessor.byteOffset, accessor.count, stride, accessor.componentType};
  }

  /// `count` tightly packed elements within a buffer view.
  [[nodiscard]] GlbView packed(int view_index, int offset, int component, std::size_t width, std::size_t count) const {
    const std::span<const unsigned char> bytes = bytesOf(view_index);
    if (componentSize(component) <= 0) fail("found an accessor of an unknown type");
    const std::size_t element = width * unsignedIndex(componentSize(component));
    if (offset < 0 || unsignedIndex(offset) > bytes.size() || count > (bytes.size() - unsignedIndex(offset)) / element)
      fail("found a sparse accessor that reaches beyond its buffer");
    return {bytes.data() + offset, count, element, component};
  }

  const tinygltf::Model& model_;
  std::string_view file_;
};

class GlbParser {
 public:
  GlbParser(std::string_view bytes, std::string_view file) : bytes_(bytes), file_(file) {}

  FaceShapes parseShapes() {
    with_shapes_ = true;
    load();
    visitScene();
    for (VertexPositions& moves : shapes_.moves) padShape(moves);
    return std::move(shapes_);
  }

  FaceMesh parse() {
    load();
    soup_.metres_per_unit = 1.0;
    soup_.has_colors = true;
    visitScene();
    if (!has_vertex_colors_) soup_.vertex_colors.clear();
    if (!has_texture_) soup_.texture_coordinates.clear();
    return finishMesh(std::move(soup_), file_);
  }

 private:
  [[noreturn]] void fail(std::string_view what) const { throw InputError(file_, "", what); }

  void load() {
    if (bytes_.size() < 20 || !bytes_.starts_with("glTF")) fail("found no 'glTF' at the start; expected a GLB file");
    if (bytes_.size() > 0xFFFFFFFFU) fail("is larger than 4 GB");
    const auto* start = reinterpret_cast<const unsigned char*>(bytes_.data());
    const auto length = numberAt<std::uint32_t>(start + 8);
    if (length > bytes_.size()) fail(fmt::format("is {} bytes long; its header says {}", bytes_.size(), length));
    tinygltf::TinyGLTF loader;
    loader.SetImageLoader(keepImageUndecoded, nullptr);
    loader.SetFsCallbacks(noFiles());
    std::string error;
    std::string warning;
    bool is_loaded = false;
    try {
      is_loaded =
          loader.LoadBinaryFromMemory(&model_, &error, &warning, start, static_cast<unsigned int>(bytes_.size()), "");
    } catch (const std::exception& problem) {
      error = problem.what();
    }
    if (!is_loaded) fail(fmt::format("is no GLB that can be read: {}", printable(error, 160)));
    for (const std::string& extension : model_.extensionsRequired) {
      if (extension != "KHR_materials_unlit" && extension != "KHR_texture_transform") {
        fail(fmt::format("needs the extension {}; expected a plain GLB (export it without compression)",
                         printable(extension, 60)));
      }
    }
  }

  void visitScene() {
    if (model_.nodes.empty()) fail("found no node; expected a scene with a mesh");
    if (model_.scenes.empty()) {
      for (const tinygltf::Mesh& mesh : model_.meshes) addMesh(mesh, Eigen::Affine3d::Identity());
      return;
    }
    const tinygltf::Scene& scene = itemAt(model_.scenes, std::max(model_.defaultScene, 0), "scene", file_);
    for (const int node : scene.nodes) visitNode(node, Eigen::Affine3d::Identity(), 0);
  }

  void visitNode(int index, const Eigen::Affine3d& scene_from_parent, int depth) {
    const tinygltf::Node& node = itemAt(model_.nodes, index, "node", file_);
    if (depth > kMaxNodeDepth || ++node_visits_ > kMaxNodeVisits) fail("found nodes that hold each other in a ring");
    const Eigen::Affine3d scene_from_node = scene_from_parent * parentFromNode(node);
    if (!scene_from_node.matrix().allFinite()) fail("found a node whose transform is no number");
    if (node.mesh >= 0) addMesh(itemAt(model_.meshes, node.mesh, "mesh", file_), scene_from_node);
    for (const int child : node.children) visitNode(child, scene_from_node, depth + 1);
  }

  static Eigen::Affine3d parentFromNode(const tinygltf::Node& node) {
    Eigen::Affine3d transform = Eigen::Affine3d::Identity();
    if (node.matrix.size() == 16) {
      transform.matrix() = Eigen::Map<const Eigen::Matrix4d>(node.matrix.data());
      return transform;
    }
    if (node.translation.size() == 3) transform.translate(Eigen::Map<const Eigen::Vector3d>(node.translation.data()));
    if (node.rotation.size() == 4) {
      const Eigen::Quaterniond rotation(node.rotation[3], node.rotation[0], node.rotation[1], node.rotation[2]);
      if (rotation.norm() > 1e-6) transform.rotate(rotation.normalized());
    }
    if (node.scale.size() == 3) transform.scale(Eigen::Map<const Eigen::Vector3d>(node.scale.data()));
    return transform;
  }

  void addMesh(const tinygltf::Mesh& mesh, const Eigen::Affine3d& scene_from_mesh) {
    first_vertex_.clear();  // primitives of one mesh may share their vertices
    for (const tinygltf::Primitive& primitive : mesh.primitives) addPrimitive(primitive, mesh, scene_from_mesh);
  }

  void addPrimitive(const tinygltf::Primitive& primitive, const tinygltf::Mesh& mesh,
                    const Eigen::Affine3d& scene_from_mesh) {
    const std::string& mesh_name = mesh.name;
    if (primitive.mode == TINYGLTF_MODE_POINTS || primitive.mode == TINYGLTF_MODE_LINE ||
        primitive.mode == TINYGLTF_MODE_LINE_LOOP || primitive.mode == TINYGLTF_MODE_LINE_STRIP) {
      return;
    }
    if (primitive.mode != TINYGLTF_MODE_TRIANGLES && primitive.mode != -1)
      fail("found a triangle strip or fan; expected triangles");
    const auto position = primitive.attributes.find("POSITION");
    if (position == primitive.attributes.end())
      fail(fmt::format("mesh '{}' has no positions", printable(mesh_name, 60)));
    const auto [entry, is_new] = first_vertex_.try_emplace(position->second, soup_.vertexCount());
    const std::size_t count = is_new ? addVertices(primitive, position->second, scene_from_mesh)
                                     : views_.accessor(position->second, TINYGLTF_TYPE_VEC3).count;
    if (with_shapes_) {
      if (is_new) addShapes(primitive, mesh, entry->second, count, scene_from_mesh.linear());
      return;
    }
    // A mirrored node turns the triangles inside out.
    const bool is_mirrored = scene_from_mesh.linear().determinant() < 0;
    addTriangles(primitive, entry->second, count, is_mirrored, addPart(primitive.material, mesh_name));
  }

  std::size_t addVertices(const tinygltf::Primitive& primitive, int position_accessor,
                          const Eigen::Affine3d& scene_from_mesh) {
    const GlbView view = views_.accessor(position_accessor, TINYGLTF_TYPE_VEC3);
    if (view.component != TINYGLTF_COMPONENT_TYPE_FLOAT) fail("found positions that are no floats");
    if (soup_.vertexCount() + view.count > kMaxMeshVertices)
      fail(fmt::format("found more than {} vertices", kMaxMeshVertices));
    for (std::size_t i = 0; i < view.count; ++i) {
      const Eigen::Vector3f point = (scene_from_mesh * view.vec3(i).cast<double>()).cast<float>();
      for (int axis = 0; axis < 3; ++axis) {
        if (!(std::abs(point[axis]) <= kMaxCoordinate))
          fail(fmt::format("vertex {}: found a coordinate that is no usable number", i));
        soup_.positions.push_back(point[axis]);
      }
    }
    addColors(primitive, view.count);
    addTexture(primitive, view.count);
    return view.count;
  }

  /// Names are Khronos' convention, extras.targetNames; without it a shape is called by its number.
  static std::string shapeName(const tinygltf::Mesh& mesh, std::size_t target) {
    const tinygltf::Value& names = mesh.extras.Get("targetNames");
    const int place = static_cast<int>(target);  // no file has 2^31 of them
    if (names.IsArray() && target < names.ArrayLen() && names.Get(place).IsString())
      return printable(names.Get(place).Get<std::string>(), 120);
    return fmt::format("shape_{:02}", target);
  }

  void padShape(VertexPositions& moves) const {
    const Eigen::Index before = moves.rows(), all = signedIndex(soup_.vertexCount());
    if (before == all) return;
    if (3 * shapes_.names.size() * soup_.vertexCount() > kMaxShapeNumbers) fail("found more shapes than a face has");
    moves.conservativeResize(all, Eigen::NoChange);
    moves.bottomRows(all - before).setZero();
  }

  void addShapes(const tinygltf::Primitive& primitive, const tinygltf::Mesh& mesh, std::size_t first_vertex,
                 std::size_t count, const Eigen::Matrix3d& turn) {
    for (std::size_t target = 0; target < primitive.targets.size(); ++target) {
      const auto position = primitive.targets[target].find("POSITION");
      if (position == primitive.targets[target].end()) continue;
      const std::string name = shapeName(mesh, target);
      std::size_t shape = 0;
      while (shape < shapes_.names.size() && shapes_.names[shape] != name) ++shape;
      if (shape == shapes_.names.size()) {
        if (shape == kMaxShapes) fail("found more shapes than a face has");
        shapes_.names.push_back(name);
        shapes_.moves.emplace_back(0, 3);
      }
      padShape(shapes_.moves[shape]);
      const VertexPositions moves = views_.moves(position->second, count);
      for (Eigen::Index i = 0; i < moves.rows(); ++i) {
        const Eigen::Vector3f move = (turn * pointAt(moves, i)).cast<float>();
        if (!(move.cwiseAbs().maxCoeff() <= kMaxCoordinate)) fail("found a shape with a move that is no usable number");
        shapes_.moves[shape].row(signedIndex(first_vertex) + i) = move.transpose();
      }
    }
  }

  void addColors(const tinygltf::Primitive& primitive, std::size_t count) {
    soup_.vertex_colors.resize(soup_.vertexCount(), {1.0F, 1.0F, 1.0F});
    const auto attribute = primitive.attributes.find("COLOR_0");
    if (attribute == primitive.attributes.end()) return;
    const int type = views_.accessorAt(attribute->second).type;
    const GlbView view =
        views_.accessor(attribute->second, type == TINYGLTF_TYPE_VEC4 ? TINYGLTF_TYPE_VEC4 : TINYGLTF_TYPE_VEC3);
    if (view.count != count) fail("found fewer colours than vertices");
    has_vertex_colors_ = true;
    for (std::size_t i = 0; i < count; ++i) {
      auto& color = soup_.vertex_colors[soup_.vertexCount() - count + i];
      for (std::size_t k = 0; k < 3; ++k) color[k] = std::clamp(view.channel(i, k), 0.0F, 1.0F);
    }
  }

  void addTexture(const tinygltf::Primitive& primitive, std::size_t count) {
    soup_.texture_coordinates.resize(soup_.vertexCount(), {0.0F, 0.0F});
    const auto attribute = primitive.attributes.find("TEXCOORD_0");
    if (attribute == primitive.attributes.end()) return;
    const GlbView view = views_.accessor(attribute->second, TINYGLTF_TYPE_VEC2);
    if (view.component != TINYGLTF_COMPONENT_TYPE_FLOAT || view.count != count) return;
    has_texture_ = true;
    for (std::size_t i = 0; i < count; ++i) {
      auto& uv = soup_.texture_coordinates[soup_.vertexCount() - count + i];
      for (std::size_t k = 0; k < 2; ++k) uv[k] = view.channel(i, k);
    }
  }

  std::uint32_t addPart(int material, const std::string& mesh_name) {
    MeshPart part{.name = printable(mesh_name.empty() ? "mesh" : mesh_name, 120), .base_color = {1, 1, 1, 1}};
    if (material >= 0 && unsignedIndex(material) < model_.materials.size()) {
      const tinygltf::Material& source = model_.materials[unsignedIndex(material)];
      if (!source.name.empty() && (kindFromName(source.name) || !kindFromName(mesh_name)))
        part.name = printable(source.name, 120);
      const auto& factor = source.pbrMetallicRoughness.baseColorFactor;
      for (std::size_t k = 0; k < 4 && k < factor.size(); ++k) {
        part.base_color[k] = asFloat(std::isfinite(factor[k]) ? std::clamp(factor[k], 0.0, 1.0) : 1.0);
      }
      const double roughness = source.pbrMetallicRoughness.roughnessFactor;
      part.roughness = asFloat(std::isfinite(roughness) ? std::clamp(roughness, 0.0, 1.0) : 0.6);
    }
    for (std::size_t p = 0; p < soup_.parts.size(); ++p) {
      if (soup_.parts[p].name == part.name && soup_.parts[p].base_color == part.base_color)
        return static_cast<std::uint32_t>(p);
    }
    if (soup_.parts.size() == kMaxMeshParts) fail(fmt::format("found more than {} materials", kMaxMeshParts));
    soup_.parts.push_back(std::move(part));
    return static_cast<std::uint32_t>(soup_.parts.size() - 1);
  }

  void addTriangles(const tinygltf::Primitive& primitive, std::size_t first_vertex, std::size_t vertices,
                    bool is_mirrored, std::uint32_t part) {
    GlbView view;
    if (primitive.indices >= 0) view = views_.accessor(primitive.indices, TINYGLTF_TYPE_SCALAR);
    const std::size_t corners = primitive.indices >= 0 ? view.count : vertices;
    if (corners % 3 != 0) fail(fmt::format("found {} corners of triangles; expected a multiple of 3", corners));
    if (soup_.triangles.size() + corners / 3 > kMaxMeshTriangles)
      fail(fmt::format("found more than {} triangles", kMaxMeshTriangles));
    const auto corner = [&](std::size_t i) {
      const std::size_t index = primitive.indices >= 0 ? views_.indexAt(view, i) : i;
      if (index >= vertices) fail(fmt::format("found vertex index {}; expected 0 to {}", index, vertices - 1));
      return static_cast<std::uint32_t>(first_vertex + index);
    };
    for (std::size_t i = 0; i < corners; i += 3) {
      std::array<std::uint32_t, 3> triangle{corner(i), corner(i + 1), corner(i + 2)};
      if (is_mirrored) std::swap(triangle[1], triangle[2]);
      appendPolygon(soup_, triangle, part);
    }
  }

  std::string_view bytes_;
  std::string_view file_;
  tinygltf::Model model_;
  GlbViews views_{model_, file_};
  MeshSoup soup_;
  std::map<int, std::size_t> first_vertex_;
  std::size_t node_visits_ = 0;
  bool has_vertex_colors_ = false;
  bool has_texture_ = false;
  bool with_shapes_ = false;
  FaceShapes shapes_;
};

}  // namespace

FaceMesh parseGlb(std::string_view bytes, std::string_view file) { return GlbParser(bytes, file).parse(); }

FaceShapes parseGlbShapes(std::string_view bytes, std::string_view file) {
  return GlbParser(bytes, file).parseShapes();
}

}  // namespace mouthpiece
