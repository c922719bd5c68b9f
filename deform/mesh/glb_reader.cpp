// The surface and the shapes of what the scene of a GLB shows.
#include <fmt/format.h>
#include <tiny_gltf.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>

#include "base/errors.h"
#include "deform/mesh/glb_nodes.h"
#include "deform/mesh/glb_scene.h"
#include "deform/mesh/glb_views.h"
#include "deform/mesh/mesh_reader.h"

namespace mouthpiece {
namespace {

/// What the reader is after: the surface, its shapes, or where both come from.
enum class Wanted { kMesh, kShapes, kRuns, kBones };

class GlbParser {
 public:
  GlbParser(std::string_view bytes, std::string_view file, std::string_view object, Wanted wanted)
      : file_(file), object_(object), wanted_(wanted), nodes_(bytes, file) {
    visitScene();
  }

  FaceMesh mesh() {
    soup_.metres_per_unit = 1.0;
    soup_.has_colors = true;
    if (!has_vertex_colors_) soup_.vertex_colors.clear();
    if (!has_texture_) soup_.texture_coordinates.clear();
    if (!has_bones_) soup_.evidence.bones.clear();
    if (!has_mouth_shapes_) soup_.evidence.mouth_moves.clear();
    if (!has_jaw_shape_) soup_.evidence.jaw_moves.clear();
    return finishMesh(std::move(soup_), file_);
  }
  FaceShapes shapes() {
    for (VertexPositions& moves : shapes_.moves) padShape(moves);
    return std::move(shapes_);
  }
  std::vector<GlbRun> runs() { return std::move(runs_); }
  GlbBones bones() {
    for (std::size_t n = 0; n < nodes_.model().nodes.size(); ++n) bones_.nodes.push_back(nodes_.bone(n));
    return std::move(bones_);
  }
  std::vector<float> scalars(int accessor) const {
    const GlbViews::Numbers numbers = views_.numbers(accessor, {TINYGLTF_TYPE_SCALAR});
    return {numbers.data(), numbers.data() + numbers.size()};
  }

 private:
  [[noreturn]] void fail(std::string_view what) const { throw InputError(std::string(file_), "", what); }

  void visitScene() {
    if (model_.nodes.empty()) fail("found no node; expected a scene with a mesh");
    if (model_.scenes.empty()) {
      for (std::size_t m = 0; m < model_.meshes.size(); ++m) addMesh(-1, static_cast<int>(m));
      return;
    }
    const tinygltf::Scene& scene = glbItemAt(model_.scenes, std::max(model_.defaultScene, 0), "scene", file_);
    for (const int node : scene.nodes) visitNode(node, 0);
    if (!object_.empty() && !found_object_) {
      std::string names;
      for (const int node : scene.nodes) names += " '" + printable(model_.nodes[unsignedIndex(node)].name, 40) + "'";
      fail(fmt::format("shows no object named '{}'; its scene holds{}", printable(object_, 60), printable(names, 300)));
    }
  }

  void visitNode(int index, int depth) {
    const tinygltf::Node& node = glbItemAt(model_.nodes, index, "node", file_);
    if (depth > kMaxNodeDepth || ++node_visits_ > kMaxNodeVisits) fail("found nodes that hold each other in a ring");
    if (node.mesh >= 0) {
      const tinygltf::Mesh& mesh = glbItemAt(model_.meshes, node.mesh, "mesh", file_);
      if (object_.empty() || mesh.name == object_ || nodes_.hangsOn(index, object_) ||
          (node.skin >= 0 && nodes_.skinHangsOn(node.skin, object_))) {
        found_object_ = true;
        addMesh(index, node.mesh);
      }
    }
    for (const int child : node.children) visitNode(child, depth + 1);
  }

  void addMesh(int node, int mesh_index) {
    const tinygltf::Mesh& mesh = model_.meshes[unsignedIndex(mesh_index)];
    run_of_.clear();  // primitives of one mesh may share their vertices
    for (std::size_t p = 0; p < mesh.primitives.size(); ++p) addPrimitive(p, mesh_index, node);
  }

  void addPrimitive(std::size_t number, int mesh_index, int node) {
    const tinygltf::Mesh& mesh = model_.meshes[unsignedIndex(mesh_index)];
    const tinygltf::Primitive& primitive = mesh.primitives[number];
    if (primitive.mode == TINYGLTF_MODE_POINTS || primitive.mode == TINYGLTF_MODE_LINE ||
        primitive.mode == TINYGLTF_MODE_LINE_LOOP || primitive.mode == TINYGLTF_MODE_LINE_STRIP) {
      return;
    }
    if (primitive.mode != TINYGLTF_MODE_TRIANGLES && primitive.mode != -1)
      fail("found a triangle strip or fan; expected triangles");
    const auto position = primitive.attributes.find("POSITION");
    if (position == primitive.attributes.end())
      fail(fmt::format("mesh '{}' has no positions", printable(mesh.name, 60)));
    const auto [entry, is_new] = run_of_.try_emplace(position->second, runs_.size());
    if (is_new) {
      runs_.push_back({node, mesh_index, {}, soup_.vertexCount(), 0, {}});
      addVertices(primitive, position->second);
    }
    GlbRun& run = runs_[entry->second];
    run.primitives.push_back(number);
    if (wanted_ != Wanted::kMesh) return;
    // A mirrored node turns the triangles inside out.
    const bool is_mirrored = run.count > 0 && run.sceneFromMesh(0).determinant() < 0;
    addTriangles(primitive, run.first_vertex, run.count, is_mirrored, addPart(primitive.material, mesh.name));
  }

  void addVertices(const tinygltf::Primitive& primitive, int position_accessor) {
    GlbViews::Numbers places = views_.numbers(position_accessor, {TINYGLTF_TYPE_VEC3});
    const std::size_t count = unsignedIndex(places.rows());
    if (soup_.vertexCount() + count > kMaxMeshVertices)
      fail(fmt::format("found more than {} vertices", kMaxMeshVertices));
    GlbRun& run = runs_.back();
    const GlbPoses poses = nodes_.posesOf(primitive, run.node, count);
    has_bones_ = has_bones_ || poses.tells_bones;
    run.count = count;
    run.scene_from_mesh = poses.sceneFromMesh();
    addShapesLeftUp(primitive, run, places);
    for (std::size_t i = 0; i < count; ++i) {
      const Eigen::Vector3d own = places.row(signedIndex(i)).transpose().cast<double>();
      const Eigen::Vector3f point = poses.placeOf(i, own);
      for (int axis = 0; axis < 3; ++axis) {
        if (!(std::abs(point[axis]) <= kMaxCoordinate))
          fail(fmt::format("vertex {}: found a coordinate that is no usable number", i));
        soup_.positions.push_back(point[axis]);
      }
    }
    if (wanted_ == Wanted::kShapes) addShapes(primitive, run);
    if (wanted_ == Wanted::kBones) addCarried(poses, count);
    if (wanted_ != Wanted::kMesh) return;
    addColors(primitive, count);
    addTexture(primitive, count);
    for (std::size_t i = 0; i < count; ++i) soup_.evidence.bones.push_back(poses.roleAt(i));
    addMouthMoves(primitive, run);
  }

  /// Shapes that the file shows at rest, by the weights of the node or else of its mesh, are of the head.
  void addShapesLeftUp(const tinygltf::Primitive& primitive, const GlbRun& run, GlbViews::Numbers& places) const {
    const std::vector<double>& of_mesh = model_.meshes[unsignedIndex(run.mesh)].weights;
    const bool has_own = run.node >= 0 && !model_.nodes[unsignedIndex(run.node)].weights.empty();
    const std::vector<double>& weights = has_own ? model_.nodes[unsignedIndex(run.node)].weights : of_mesh;
    for (std::size_t target = 0; target < std::min(primitive.targets.size(), weights.size()); ++target) {
      const auto position = primitive.targets[target].find("POSITION");
      if (weights[target] == 0 || position == primitive.targets[target].end()) continue;
      places += asFloat(weights[target]) * movesOf(position->second, run.count);
    }
  }

  void addCarried(const GlbPoses& poses, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
      bones_.roles.push_back(poses.roleAt(i));
      bones_.jaw_share.push_back(poses.jawShareAt(i));
    }
  }

  /// Of a primitive with more targets than its mesh' first one has, which is no glTF, the others have no name.
  [[nodiscard]] std::string nameOf(const GlbRun& run, std::size_t target) const {
    const std::vector<std::string>& names = shape_names_[unsignedIndex(run.mesh)];
    return target < names.size() ? names[target] : fmt::format("shape_{:02}", target);
  }

  void padShape(VertexPositions& moves) const {
    const Eigen::Index before = moves.rows(), all = signedIndex(soup_.vertexCount());
    if (before == all) return;
    if (3 * shapes_.names.size() * soup_.vertexCount() > kMaxShapeNumbers) fail("found more shapes than a face has");
    moves.conservativeResize(all, Eigen::NoChange);
    moves.bottomRows(all - before).setZero();
  }

  GlbViews::Numbers movesOf(int accessor, std::size_t count) const {
    GlbViews::Numbers moves = views_.numbers(accessor, {TINYGLTF_TYPE_VEC3});
    if (unsignedIndex(moves.rows()) != count) fail("found a shape that is no list of one move a vertex");
    if (!moves.allFinite() || (moves.size() > 0 && moves.cwiseAbs().maxCoeff() > kMaxCoordinate))
      fail("found a shape with a move that is no usable number");
    return moves;
  }

  void addShapes(const tinygltf::Primitive& primitive, const GlbRun& run) {
    for (std::size_t target = 0; target < primitive.targets.size(); ++target) {
      const auto position = primitive.targets[target].find("POSITION");
      if (position == primitive.targets[target].end()) continue;
      const std::string name = nameOf(run, target);
      std::size_t shape = 0;
      while (shape < shapes_.names.size() && shapes_.names[shape] != name) ++shape;
      if (shape == shapes_.names.size()) {
        if (shape == kMaxShapes) fail("found more shapes than a face has");
        shapes_.names.push_back(name);
        shapes_.moves.emplace_back(0, 3);
      }
      padShape(shapes_.moves[shape]);
      const GlbViews::Numbers moves = movesOf(position->second, run.count);
      for (std::size_t i = 0; i < run.count; ++i) {
        shapes_.moves[shape].row(signedIndex(run.first_vertex + i)) =
            (run.sceneFromMesh(i) * moves.row(signedIndex(i)).transpose()).transpose();
      }
    }
  }

  void addMouthMoves(const tinygltf::Primitive& primitive, const GlbRun& run) {
    VertexEvidence& evidence = soup_.evidence;
    evidence.mouth_moves.resize(soup_.vertexCount(), 0.0F);
    evidence.jaw_moves.resize(soup_.vertexCount(), 0.0F);
    for (std::size_t target = 0; target < std::min(primitive.targets.size(), kMaxShapes); ++target) {
      const auto position = primitive.targets[target].find("POSITION");
      if (position == primitive.targets[target].end()) continue;
      const std::string name = nameOf(run, target);
      if (!isMouthShape(name)) continue;
      const bool opens_jaw = isJawShape(name);
      has_mouth_shapes_ = true;
      has_jaw_shape_ = has_jaw_shape_ || opens_jaw;
      const GlbViews::Numbers moves = movesOf(position->second, run.count);
      for (std::size_t i = 0; i < run.count; ++i) {
        const float far = (run.sceneFromMesh(i) * moves.row(signedIndex(i)).transpose()).norm();
        const std::size_t vertex = run.first_vertex + i;
        evidence.mouth_moves[vertex] = std::max(evidence.mouth_moves[vertex], far);
        if (opens_jaw) evidence.jaw_moves[vertex] = std::max(evidence.jaw_moves[vertex], far);
      }
    }
  }

  void addColors(const tinygltf::Primitive& primitive, std::size_t count) {
    soup_.vertex_colors.resize(soup_.vertexCount(), {1.0F, 1.0F, 1.0F});
    const auto attribute = primitive.attributes.find("COLOR_0");
    if (attribute == primitive.attributes.end()) return;
    const GlbViews::Numbers colors = views_.numbers(attribute->second, {TINYGLTF_TYPE_VEC3, TINYGLTF_TYPE_VEC4});
    if (unsignedIndex(colors.rows()) != count) fail("found fewer colours than vertices");
    has_vertex_colors_ = true;
    for (std::size_t i = 0; i < count; ++i) {
      auto& color = soup_.vertex_colors[soup_.vertexCount() - count + i];
      for (std::size_t k = 0; k < 3; ++k) {
        const float channel = colors(signedIndex(i), signedIndex(k));
        color[k] = std::isfinite(channel) ? std::clamp(channel, 0.0F, 1.0F) : 0.0F;
      }
    }
  }

  void addTexture(const tinygltf::Primitive& primitive, std::size_t count) {
    soup_.texture_coordinates.resize(soup_.vertexCount(), {0.0F, 0.0F});
    const auto attribute = primitive.attributes.find("TEXCOORD_0");
    if (attribute == primitive.attributes.end()) return;
    const GlbViews::Numbers places = views_.numbers(attribute->second, {TINYGLTF_TYPE_VEC2});
    if (unsignedIndex(places.rows()) != count) return;
    has_texture_ = true;
    for (std::size_t i = 0; i < count; ++i) {
      auto& uv = soup_.texture_coordinates[soup_.vertexCount() - count + i];
      for (std::size_t k = 0; k < 2; ++k) {
        const float value = places(signedIndex(i), signedIndex(k));
        uv[k] = std::isfinite(value) ? value : 0.0F;
      }
    }
  }

  /// The materials of a mesh whose own name tells the kind stay parts of their own: the first is called as the mesh,
  /// the others "mesh.material", or by number.
  void nameByMesh(const std::string& material_name, MeshPart& part) const {
    const bool is_taken = std::any_of(soup_.parts.begin(), soup_.parts.end(), [&](const MeshPart& other) {
      return other.name == part.name && other.material != part.material;
    });
    if (is_taken)
      part.name += "." + (material_name.empty() ? fmt::format("{}", part.material) : printable(material_name, 60));
  }

  std::uint32_t addPart(int material, const std::string& mesh_name) {
    MeshPart part{.name = printable(mesh_name.empty() ? "mesh" : mesh_name, 120), .base_color = {1, 1, 1, 1}};
    if (material >= 0 && unsignedIndex(material) < model_.materials.size()) {
      const tinygltf::Material& source = model_.materials[unsignedIndex(material)];
      part.material = material;
      const bool is_called_so = !source.name.empty() && (kindFromName(source.name) || !kindFromName(mesh_name));
      if (is_called_so) part.name = printable(source.name, 120);
      const auto& factor = source.pbrMetallicRoughness.baseColorFactor;
      for (std::size_t k = 0; k < 4 && k < factor.size(); ++k) {
        part.base_color[k] = asFloat(std::isfinite(factor[k]) ? std::clamp(factor[k], 0.0, 1.0) : 1.0);
      }
      const double roughness = source.pbrMetallicRoughness.roughnessFactor;
      part.roughness = asFloat(std::isfinite(roughness) ? std::clamp(roughness, 0.0, 1.0) : 0.6);
      if (!is_called_so) nameByMesh(source.name, part);
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
    std::vector<std::uint32_t> indices;
    if (primitive.indices >= 0) indices = views_.wholes(primitive.indices, {TINYGLTF_TYPE_SCALAR});
    const std::size_t corners = primitive.indices >= 0 ? indices.size() : vertices;
    if (corners % 3 != 0) fail(fmt::format("found {} corners of triangles; expected a multiple of 3", corners));
    if (soup_.triangles.size() + corners / 3 > kMaxMeshTriangles)
      fail(fmt::format("found more than {} triangles", kMaxMeshTriangles));
    const auto corner = [&](std::size_t i) {
      const std::size_t index = primitive.indices >= 0 ? indices[i] : i;
      if (index >= vertices) fail(fmt::format("found vertex index {}; expected 0 to {}", index, vertices - 1));
      return static_cast<std::uint32_t>(first_vertex + index);
    };
    for (std::size_t i = 0; i < corners; i += 3) {
      std::array<std::uint32_t, 3> triangle{corner(i), corner(i + 1), corner(i + 2)};
      if (is_mirrored) std::swap(triangle[1], triangle[2]);
      appendPolygon(soup_, triangle, part);
    }
  }

  std::string_view file_;
  std::string_view object_;
  Wanted wanted_;
  GlbNodes nodes_;
  const tinygltf::Model& model_ = nodes_.model();
  const GlbViews& views_ = nodes_.views();
  const std::vector<std::vector<std::string>> shape_names_ = shapeNames(model_);
  MeshSoup soup_;
  std::vector<GlbRun> runs_;
  std::map<int, std::size_t> run_of_;  ///< by position accessor, of the mesh being read
  std::size_t node_visits_ = 0;
  bool found_object_ = false;
  bool has_vertex_colors_ = false, has_texture_ = false;
  bool has_bones_ = false, has_mouth_shapes_ = false, has_jaw_shape_ = false;
  FaceShapes shapes_;
  GlbBones bones_;
};

}  // namespace

FaceMesh parseGlb(std::string_view bytes, std::string_view file, std::string_view object) {
  return GlbParser(bytes, file, object, Wanted::kMesh).mesh();
}

FaceShapes parseGlbShapes(std::string_view bytes, std::string_view file, std::string_view object) {
  return GlbParser(bytes, file, object, Wanted::kShapes).shapes();
}

std::vector<GlbRun> glbRuns(std::string_view bytes, std::string_view file, std::string_view object) {
  return GlbParser(bytes, file, object, Wanted::kRuns).runs();
}

std::vector<std::vector<std::string>> glbShapeNames(std::string_view bytes, std::string_view file) {
  return shapeNames(GlbNodes(bytes, file).model());
}

GlbBones glbBones(std::string_view bytes, std::string_view file, std::string_view object) {
  return GlbParser(bytes, file, object, Wanted::kBones).bones();
}

std::vector<std::vector<float>> glbScalars(std::string_view bytes, std::string_view file,
                                           const std::vector<std::size_t>& accessors) {
  const GlbParser parser(bytes, file, {}, Wanted::kRuns);
  std::vector<std::vector<float>> all;
  for (const std::size_t accessor : accessors) all.push_back(parser.scalars(static_cast<int>(accessor)));
  return all;
}

}  // namespace mouthpiece
