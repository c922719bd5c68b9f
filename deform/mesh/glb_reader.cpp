// GLB through tinygltf, which parses the JSON; the scene as its nodes and skins show it at rest.
#include <fmt/format.h>
#include <tiny_gltf.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>

#include "base/errors.h"
#include "deform/mesh/bone_roles.h"
#include "deform/mesh/glb_chunks.h"
#include "deform/mesh/glb_scene.h"
#include "deform/mesh/glb_views.h"
#include "deform/mesh/mesh_reader.h"

namespace mouthpiece {
namespace {

constexpr int kMaxNodeDepth = 64;
constexpr std::size_t kMaxNodeVisits = 10'000;
constexpr std::size_t kMaxJoints = 20'000;

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

/// Extensions that say nothing of where a vertex is; what a file requires besides is refused.
bool leavesGeometryAlone(std::string_view extension) {
  if (extension == "KHR_texture_transform" || extension == "KHR_texture_basisu" ||
      extension == "KHR_mesh_quantization" || extension == "EXT_texture_webp" || extension == "EXT_texture_avif" ||
      extension == "KHR_lights_punctual" || extension == "KHR_animation_pointer" || extension == "MSFT_texture_dds" ||
      extension == "VRM")
    return true;
  return extension.starts_with("KHR_materials_") || extension.starts_with("VRMC_");
}

template <typename Item>
const Item& itemAt(const std::vector<Item>& items, int index, std::string_view what, std::string_view file) {
  if (index < 0 || unsignedIndex(index) >= items.size())
    throw InputError(std::string(file), "", fmt::format("names a {} that it does not hold", what));
  return items[unsignedIndex(index)];
}

Eigen::Affine3d parentFromNode(const tinygltf::Node& node) {
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

/// Takes the places of some vertices to the scene's: one map for all, or one a vertex.
struct Poses {
  Eigen::Affine3d node = Eigen::Affine3d::Identity();
  std::vector<Eigen::Affine3f> skin;  ///< empty, or one a vertex
  std::vector<BoneRole> roles;        ///< one for all, or one a vertex
  std::vector<float> jaw_shares;      ///< empty, or one a vertex: how much bones of the jaw carry

  [[nodiscard]] Eigen::Affine3d at(std::size_t vertex) const {
    return skin.empty() ? node : Eigen::Affine3d(skin[vertex].cast<double>());
  }
  [[nodiscard]] BoneRole roleAt(std::size_t vertex) const { return roles[roles.size() == 1 ? 0 : vertex]; }
  [[nodiscard]] float jawShareAt(std::size_t vertex) const {
    return jaw_shares.empty() ? (roleAt(vertex) == BoneRole::kJaw ? 1.0F : 0.0F) : jaw_shares[vertex];
  }
};

/// What the reader is after: the surface, its shapes, or where both come from.
enum class Wanted { kMesh, kShapes, kRuns, kBones };

class GlbParser {
 public:
  GlbParser(std::string_view bytes, std::string_view file, std::string_view object, Wanted wanted)
      : bytes_(bytes), file_(file), object_(object), wanted_(wanted) {
    load();
    placeNodes();
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
    for (std::size_t n = 0; n < model_.nodes.size(); ++n) {
      bones_.nodes.push_back({printable(model_.nodes[n].name, 120), parents_[n],
                              Eigen::Vector3d(scene_from_node_[n].translation()), roles_[n]});
    }
    return std::move(bones_);
  }
  std::vector<float> scalars(int accessor) const {
    const GlbViews::Numbers numbers = views_.numbers(accessor, {TINYGLTF_TYPE_SCALAR});
    return {numbers.data(), numbers.data() + numbers.size()};
  }

 private:
  [[noreturn]] void fail(std::string_view what) const { throw InputError(std::string(file_), "", what); }

  void load() {
    const std::string plain = unpackedGlb(bytes_, file_);
    const std::string_view bytes = plain.empty() ? bytes_ : std::string_view(plain);
    glbChunks(bytes, file_);  // the frame, and how deep the JSON is: tinygltf asks for neither
    tinygltf::TinyGLTF loader;
    loader.SetImageLoader(keepImageUndecoded, nullptr);
    loader.SetFsCallbacks(noFiles());
    std::string error;
    std::string warning;
    bool is_loaded = false;
    try {
      is_loaded =
          loader.LoadBinaryFromMemory(&model_, &error, &warning, reinterpret_cast<const unsigned char*>(bytes.data()),
                                      static_cast<unsigned int>(bytes.size()), "");
    } catch (const std::exception& problem) {
      error = problem.what();
    }
    if (!is_loaded) fail(fmt::format("is no GLB that can be read: {}", printable(error, 160)));
    for (const std::string& extension : model_.extensionsRequired) {
      if (!leavesGeometryAlone(extension)) {
        fail(fmt::format("needs the extension {}, which is not understood; expected a GLB exported without it",
                         printable(extension, 60)));
      }
    }
  }

  /// Where each node of the scene stands at rest; a joint outside of it stands where its own parents put it.
  void placeNodes() {
    const std::size_t count = model_.nodes.size();
    if (count > kMaxNodeVisits * 10) fail("found more nodes than a head has");
    parents_.assign(count, -1);
    for (std::size_t n = 0; n < count; ++n) {
      for (const int child : model_.nodes[n].children) {
        (void)itemAt(model_.nodes, child, "node", file_);
        parents_[unsignedIndex(child)] = static_cast<int>(n);
      }
    }
    scene_from_node_.resize(count);
    for (std::size_t n = 0; n < count; ++n) {
      Eigen::Affine3d transform = Eigen::Affine3d::Identity();
      int depth = 0;
      for (int at = static_cast<int>(n); at >= 0; at = parents_[unsignedIndex(at)]) {
        if (++depth > kMaxNodeDepth) fail("found nodes that hold each other in a ring");
        transform = parentFromNode(model_.nodes[unsignedIndex(at)]) * transform;
      }
      if (!transform.matrix().allFinite()) fail("found a node whose transform is no number");
      scene_from_node_[n] = transform;
    }
    roles_ = boneRoles(model_, parents_);
  }

  void visitScene() {
    if (model_.nodes.empty()) fail("found no node; expected a scene with a mesh");
    if (model_.scenes.empty()) {
      for (std::size_t m = 0; m < model_.meshes.size(); ++m) addMesh(-1, static_cast<int>(m));
      return;
    }
    const tinygltf::Scene& scene = itemAt(model_.scenes, std::max(model_.defaultScene, 0), "scene", file_);
    for (const int node : scene.nodes) visitNode(node, 0);
    if (!object_.empty() && !found_object_) {
      std::string names;
      for (const int node : scene.nodes) names += " '" + printable(model_.nodes[unsignedIndex(node)].name, 40) + "'";
      fail(fmt::format("shows no object named '{}'; its scene holds{}", printable(object_, 60), printable(names, 300)));
    }
  }

  void visitNode(int index, int depth) {
    const tinygltf::Node& node = itemAt(model_.nodes, index, "node", file_);
    if (depth > kMaxNodeDepth || ++node_visits_ > kMaxNodeVisits) fail("found nodes that hold each other in a ring");
    if (node.mesh >= 0) {
      const tinygltf::Mesh& mesh = itemAt(model_.meshes, node.mesh, "mesh", file_);
      if (object_.empty() || mesh.name == object_ || hangsOnObject(index) ||
          (node.skin >= 0 && skinHangsOnObject(node.skin))) {
        found_object_ = true;
        addMesh(index, node.mesh);
      }
    }
    for (const int child : node.children) visitNode(child, depth + 1);
  }

  bool hangsOnObject(int node) const {
    for (int at = node; at >= 0; at = parents_[unsignedIndex(at)]) {
      if (model_.nodes[unsignedIndex(at)].name == object_) return true;
    }
    return false;
  }
  /// A skinned mesh often lies beside the bones that carry it.
  bool skinHangsOnObject(int skin) const {
    const std::vector<int>& joints = itemAt(model_.skins, skin, "skin", file_).joints;
    return !joints.empty() && unsignedIndex(joints[0]) < parents_.size() && hangsOnObject(joints[0]);
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
      addVertices(primitive, position->second, mesh);
    }
    GlbRun& run = runs_[entry->second];
    run.primitives.push_back(number);
    if (wanted_ != Wanted::kMesh) return;
    // A mirrored node turns the triangles inside out.
    const bool is_mirrored = run.count > 0 && run.sceneFromMesh(0).determinant() < 0;
    addTriangles(primitive, run.first_vertex, run.count, is_mirrored, addPart(primitive.material, mesh.name));
  }

  void addVertices(const tinygltf::Primitive& primitive, int position_accessor, const tinygltf::Mesh& mesh) {
    const GlbViews::Numbers places = views_.numbers(position_accessor, {TINYGLTF_TYPE_VEC3});
    const std::size_t count = unsignedIndex(places.rows());
    if (soup_.vertexCount() + count > kMaxMeshVertices)
      fail(fmt::format("found more than {} vertices", kMaxMeshVertices));
    GlbRun& run = runs_.back();
    const Poses poses = posesOf(primitive, run.node, count);
    run.count = count;
    if (poses.skin.empty()) run.scene_from_mesh.emplace_back(poses.node.linear().cast<float>());
    for (const Eigen::Affine3f& pose : poses.skin) run.scene_from_mesh.emplace_back(pose.linear());
    for (std::size_t i = 0; i < count; ++i) {
      const Eigen::Vector3d own = places.row(signedIndex(i)).transpose().cast<double>();
      const Eigen::Vector3f point = (poses.at(i) * own).cast<float>();
      for (int axis = 0; axis < 3; ++axis) {
        if (!(std::abs(point[axis]) <= kMaxCoordinate))
          fail(fmt::format("vertex {}: found a coordinate that is no usable number", i));
        soup_.positions.push_back(point[axis]);
      }
    }
    if (wanted_ == Wanted::kShapes) addShapes(primitive, mesh, run);
    if (wanted_ == Wanted::kBones) addCarried(poses, count);
    if (wanted_ != Wanted::kMesh) return;
    addColors(primitive, count);
    addTexture(primitive, count);
    for (std::size_t i = 0; i < count; ++i) soup_.evidence.bones.push_back(poses.roleAt(i));
    addMouthMoves(primitive, mesh, run);
  }

  void addCarried(const Poses& poses, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
      bones_.roles.push_back(poses.roleAt(i));
      bones_.jaw_share.push_back(poses.jawShareAt(i));
    }
  }

  /// The node's own place, or for a skinned mesh the bones' at rest: then the node itself does not count (glTF 2.0,
  /// 3.7.3.1).
  Poses posesOf(const tinygltf::Primitive& primitive, int node_index, std::size_t count) {
    if (node_index < 0) return {Eigen::Affine3d::Identity(), {}, {BoneRole::kUnknown}, {}};
    const tinygltf::Node& node = model_.nodes[unsignedIndex(node_index)];
    const bool is_skinned = node.skin >= 0 && primitive.attributes.contains("JOINTS_0");
    if (!is_skinned) {
      has_bones_ = has_bones_ || roles_[unsignedIndex(node_index)] != BoneRole::kUnknown;
      return {scene_from_node_[unsignedIndex(node_index)], {}, {roles_[unsignedIndex(node_index)]}, {}};
    }
    has_bones_ = true;
    const tinygltf::Skin& skin = itemAt(model_.skins, node.skin, "skin", file_);
    const std::vector<Eigen::Matrix4f> joints = jointMatrices(skin);
    std::vector<Eigen::Matrix4f> sums(count, Eigen::Matrix4f::Zero());
    std::vector<float> totals(count, 0.0F);
    std::vector<std::array<float, 6>> shares(count, std::array<float, 6>{});
    for (int set = 0; set < 4; ++set) {
      const auto joint = primitive.attributes.find(fmt::format("JOINTS_{}", set));
      const auto weight = primitive.attributes.find(fmt::format("WEIGHTS_{}", set));
      if (joint == primitive.attributes.end() || weight == primitive.attributes.end()) break;
      const std::vector<std::uint32_t> which = views_.wholes(joint->second, {TINYGLTF_TYPE_VEC4});
      const GlbViews::Numbers much = views_.numbers(weight->second, {TINYGLTF_TYPE_VEC4});
      if (which.size() != 4 * count || unsignedIndex(much.rows()) != count)
        fail("found fewer joints or weights than vertices");
      for (std::size_t i = 0; i < 4 * count; ++i) {
        const float share = much(signedIndex(i / 4), signedIndex(i % 4));
        if (!(share > 0)) continue;
        if (which[i] >= joints.size()) fail(fmt::format("found joint {}; the skin has {}", which[i], joints.size()));
        sums[i / 4] += share * joints[which[i]];
        totals[i / 4] += share;
        shares[i / 4][static_cast<std::size_t>(roles_[unsignedIndex(skin.joints[which[i]])])] += share;
      }
    }
    Poses poses;
    const Eigen::Affine3f plain = scene_from_node_[unsignedIndex(node_index)].cast<float>();
    for (std::size_t i = 0; i < count; ++i) {
      const bool hangs = totals[i] > 1e-6F && std::isfinite(totals[i]);
      poses.skin.push_back(hangs ? Eigen::Affine3f(sums[i] / totals[i]) : plain);
      const auto most = std::max_element(shares[i].begin(), shares[i].end());
      poses.roles.push_back(hangs ? static_cast<BoneRole>(most - shares[i].begin()) : BoneRole::kUnknown);
      const float jaw = shares[i][static_cast<std::size_t>(BoneRole::kJaw)];
      poses.jaw_shares.push_back(hangs ? jaw / totals[i] : 0.0F);
    }
    return poses;
  }

  std::vector<Eigen::Matrix4f> jointMatrices(const tinygltf::Skin& skin) const {
    if (skin.joints.size() > kMaxJoints) fail("found more joints than a body has");
    GlbViews::Numbers binds;
    if (skin.inverseBindMatrices >= 0) binds = views_.numbers(skin.inverseBindMatrices, {TINYGLTF_TYPE_MAT4});
    if (skin.inverseBindMatrices >= 0 && unsignedIndex(binds.rows()) < skin.joints.size())
      fail("found fewer bind matrices than joints");
    std::vector<Eigen::Matrix4f> matrices;
    for (std::size_t j = 0; j < skin.joints.size(); ++j) {
      (void)itemAt(model_.nodes, skin.joints[j], "node", file_);
      const Eigen::Matrix4d& scene_from_joint = scene_from_node_[unsignedIndex(skin.joints[j])].matrix();
      Eigen::Matrix4d joint_from_mesh = Eigen::Matrix4d::Identity();
      if (binds.rows() > 0)
        joint_from_mesh = Eigen::Map<const Eigen::Matrix4f>(binds.row(signedIndex(j)).data()).cast<double>();
      matrices.emplace_back((scene_from_joint * joint_from_mesh).cast<float>());
      if (!matrices.back().allFinite()) fail("found a bind matrix that is no number");
    }
    return matrices;
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

  GlbViews::Numbers movesOf(int accessor, std::size_t count) const {
    GlbViews::Numbers moves = views_.numbers(accessor, {TINYGLTF_TYPE_VEC3});
    if (unsignedIndex(moves.rows()) != count) fail("found a shape that is no list of one move a vertex");
    if (!moves.allFinite() || (moves.size() > 0 && moves.cwiseAbs().maxCoeff() > kMaxCoordinate))
      fail("found a shape with a move that is no usable number");
    return moves;
  }

  void addShapes(const tinygltf::Primitive& primitive, const tinygltf::Mesh& mesh, const GlbRun& run) {
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
      const GlbViews::Numbers moves = movesOf(position->second, run.count);
      for (std::size_t i = 0; i < run.count; ++i) {
        shapes_.moves[shape].row(signedIndex(run.first_vertex + i)) =
            (run.sceneFromMesh(i) * moves.row(signedIndex(i)).transpose()).transpose();
      }
    }
  }

  void addMouthMoves(const tinygltf::Primitive& primitive, const tinygltf::Mesh& mesh, const GlbRun& run) {
    VertexEvidence& evidence = soup_.evidence;
    evidence.mouth_moves.resize(soup_.vertexCount(), 0.0F);
    evidence.jaw_moves.resize(soup_.vertexCount(), 0.0F);
    for (std::size_t target = 0; target < std::min(primitive.targets.size(), kMaxShapes); ++target) {
      const auto position = primitive.targets[target].find("POSITION");
      const std::string name = shapeName(mesh, target);
      if (position == primitive.targets[target].end() || !isMouthShape(name)) continue;
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

  std::uint32_t addPart(int material, const std::string& mesh_name) {
    MeshPart part{.name = printable(mesh_name.empty() ? "mesh" : mesh_name, 120), .base_color = {1, 1, 1, 1}};
    if (material >= 0 && unsignedIndex(material) < model_.materials.size()) {
      const tinygltf::Material& source = model_.materials[unsignedIndex(material)];
      part.material = material;
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

  std::string_view bytes_;
  std::string_view file_;
  std::string_view object_;
  Wanted wanted_;
  tinygltf::Model model_;
  GlbViews views_{model_, file_};
  std::vector<int> parents_;
  std::vector<Eigen::Affine3d> scene_from_node_;
  std::vector<BoneRole> roles_;
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
