// GLB through tinygltf, which parses the JSON; every offset and count it hands over is checked here before it is used.
#include <fmt/format.h>
#include <tiny_gltf.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstring>
#include <map>

#include "base/errors.h"
#include "deform/mesh/glb_views.h"
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
    std::uint32_t length = 0;
    std::memcpy(&length, bytes_.data() + 8, 4);
    if (length > bytes_.size()) fail(fmt::format("is {} bytes long; its header says {}", bytes_.size(), length));
    tinygltf::TinyGLTF loader;
    loader.SetImageLoader(keepImageUndecoded, nullptr);
    loader.SetFsCallbacks(noFiles());
    std::string error;
    std::string warning;
    bool is_loaded = false;
    try {
      is_loaded =
          loader.LoadBinaryFromMemory(&model_, &error, &warning, reinterpret_cast<const unsigned char*>(bytes_.data()),
                                      static_cast<unsigned int>(bytes_.size()), "");
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
      for (std::size_t mesh = 0; mesh < model_.meshes.size(); ++mesh)
        addMesh(static_cast<int>(mesh), Eigen::Affine3d::Identity());
      return;
    }
    const int scene = model_.defaultScene >= 0 ? model_.defaultScene : 0;
    if (static_cast<std::size_t>(scene) >= model_.scenes.size()) fail("names a scene that it does not hold");
    for (const int node : model_.scenes[static_cast<std::size_t>(scene)].nodes)
      visitNode(node, Eigen::Affine3d::Identity(), 0);
  }

  void visitNode(int index, const Eigen::Affine3d& scene_from_parent, int depth) {
    if (index < 0 || static_cast<std::size_t>(index) >= model_.nodes.size()) fail("names a node that it does not hold");
    if (depth > kMaxNodeDepth || ++node_visits_ > kMaxNodeVisits) fail("found nodes that hold each other in a ring");
    const tinygltf::Node& node = model_.nodes[static_cast<std::size_t>(index)];
    const Eigen::Affine3d scene_from_node = scene_from_parent * parentFromNode(node);
    if (!scene_from_node.matrix().allFinite()) fail("found a node whose transform is no number");
    if (node.mesh >= 0) addMesh(node.mesh, scene_from_node);
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

  void addMesh(int index, const Eigen::Affine3d& scene_from_mesh) {
    if (static_cast<std::size_t>(index) >= model_.meshes.size()) fail("names a mesh that it does not hold");
    const tinygltf::Mesh& mesh = model_.meshes[static_cast<std::size_t>(index)];
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
      Eigen::Vector3f raw;
      std::memcpy(raw.data(), view.data + i * view.stride, 12);
      const Eigen::Vector3f point = (scene_from_mesh * raw.cast<double>()).cast<float>();
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
    if (names.IsArray() && target < names.ArrayLen() && names.Get(target).IsString())
      return printable(names.Get(target).Get<std::string>(), 120);
    return fmt::format("shape_{:02}", target);
  }

  void padShape(VertexPositions& moves) const {
    const Eigen::Index before = moves.rows(), all = static_cast<Eigen::Index>(soup_.vertexCount());
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
      const std::vector<float> moves = views_.mostlyZeroVec3(position->second, count);
      for (std::size_t i = 0; i < count; ++i) {
        const Eigen::Vector3f move =
            (turn * Eigen::Map<const Eigen::Vector3f>(&moves[3 * i]).cast<double>()).cast<float>();
        if (!(move.cwiseAbs().maxCoeff() <= kMaxCoordinate)) fail("found a shape with a move that is no usable number");
        shapes_.moves[shape].row(static_cast<Eigen::Index>(first_vertex + i)) = move.transpose();
      }
    }
  }

  void addColors(const tinygltf::Primitive& primitive, std::size_t count) {
    soup_.vertex_colors.resize(soup_.vertexCount(), {1.0F, 1.0F, 1.0F});
    const auto attribute = primitive.attributes.find("COLOR_0");
    if (attribute == primitive.attributes.end()) return;
    const int type = views_.typeOf(attribute->second);
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
    if (material >= 0 && static_cast<std::size_t>(material) < model_.materials.size()) {
      const tinygltf::Material& source = model_.materials[static_cast<std::size_t>(material)];
      if (!source.name.empty() && (kindFromName(source.name) || !kindFromName(mesh_name)))
        part.name = printable(source.name, 120);
      const auto& factor = source.pbrMetallicRoughness.baseColorFactor;
      for (std::size_t k = 0; k < 4 && k < factor.size(); ++k) {
        part.base_color[k] = static_cast<float>(std::isfinite(factor[k]) ? std::clamp(factor[k], 0.0, 1.0) : 1.0);
      }
      const double roughness = source.pbrMetallicRoughness.roughnessFactor;
      part.roughness = static_cast<float>(std::isfinite(roughness) ? std::clamp(roughness, 0.0, 1.0) : 0.6);
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
