// Shapes and weights written into a GLB that was given.
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <map>
#include <set>

#include "base/errors.h"
#include "base/index.h"
#include "exports/gltf/glb.h"
#include "exports/gltf/glb_model.h"

namespace mouthpiece {
namespace {

using Targets = std::vector<std::map<std::string, int>>;

constexpr int kMaxNodeDepth = 64;

/// Walks the scene as the GLB reader does, so that vertices are met in the same order, and gives each primitive its
/// targets.
class ShapeAdder {
 public:
  ShapeAdder(GlbModel& model, const std::string& file, const PrincipalShapes& shapes, const Eigen::Matrix3d& upright)
      : model_(model),
        file_(file),
        shapes_(shapes),
        mesh_from_upright_(upright.transpose()),
        columns_(unsignedIndex(shapes.rest.cols() / 3), -1) {
    const std::vector<std::uint32_t> vertices = shapes.columnVertices();
    for (std::size_t i = 0; i < vertices.size(); ++i) columns_[vertices[i]] = 3 * signedIndex(i);
  }

  /// False when a mesh is shown twice.
  bool add() {
    if (model_.gltf.scenes.empty()) return false;
    for (const int node : at(model_.gltf.scenes, std::max(0, model_.gltf.defaultScene)).nodes)
      visit(node, Eigen::Affine3d::Identity(), 0);
    if (first_vertex_ != columns_.size() || is_shown_twice_ || moving_nodes_.empty()) return false;
    model_.setSpeech(unsignedIndex(shapes_.frameCount()), shapes_.frame_rate_hz,
                     {{{shapes_.weights.data(), unsignedIndex(shapes_.weights.size())}, moving_nodes_}});
    return true;
  }

 private:
  [[noreturn]] void fail(std::string_view what) const { throw InputError(file_, "", what); }

  template <typename T>
  T& at(std::vector<T>& list, int number) const {
    if (number < 0 || unsignedIndex(number) >= list.size()) fail("names an entry that it does not hold");
    return list[unsignedIndex(number)];
  }

  static Eigen::Affine3d parentFromNode(const tinygltf::Node& node) {
    Eigen::Affine3d transform = Eigen::Affine3d::Identity();
    if (node.matrix.size() == 16) {
      transform.matrix() = Eigen::Map<const Eigen::Matrix4d>(node.matrix.data());
      return transform;
    }
    if (node.translation.size() == 3) transform.translate(Eigen::Map<const Eigen::Vector3d>(node.translation.data()));
    if (node.rotation.size() == 4) {
      const Eigen::Quaterniond rotation(Eigen::Map<const Eigen::Vector4d>(node.rotation.data()));
      if (rotation.norm() > 1e-6) transform.rotate(rotation.normalized());
    }
    if (node.scale.size() == 3) transform.scale(Eigen::Map<const Eigen::Vector3d>(node.scale.data()));
    return transform;
  }

  void visit(int number, const Eigen::Affine3d& scene_from_parent, int depth) {
    if (depth > kMaxNodeDepth) fail("found nodes that hold each other in a ring");
    const tinygltf::Node& node = at(model_.gltf.nodes, number);
    const Eigen::Affine3d scene_from_node = scene_from_parent * parentFromNode(node);
    if (node.mesh >= 0) {
      is_shown_twice_ |= !shown_.insert(node.mesh).second;
      if (!is_shown_twice_ && addTargets(at(model_.gltf.meshes, node.mesh),
                                         scene_from_node.linear().inverse() * mesh_from_upright_))
        moving_nodes_.push_back(number);
    }
    for (const int child : node.children) visit(child, scene_from_node, depth + 1);
  }

  /// Whether anything of the mesh moves.
  bool addTargets(tinygltf::Mesh& mesh, const Eigen::Matrix3d& node_from_upright) {
    std::map<int, Targets> targets_of;  // by position accessor
    bool moves = false;
    for (tinygltf::Primitive& primitive : mesh.primitives) {
      primitive.targets.clear();
      if (primitive.mode != TINYGLTF_MODE_TRIANGLES && primitive.mode != -1) continue;
      const auto positions = primitive.attributes.find("POSITION");
      if (positions == primitive.attributes.end()) fail("found a mesh without positions");
      const auto [known, is_new] = targets_of.try_emplace(positions->second);
      if (is_new) {
        const std::size_t count = at(model_.gltf.accessors, positions->second).count;
        if (count > columns_.size() - first_vertex_) fail("has changed since the fit");
        known->second = targets(count, node_from_upright);
        first_vertex_ += count;
      }
      primitive.targets = known->second;
      moves = true;
    }
    GlbModel::nameTargets(mesh, unsignedIndex(shapes_.shapeCount()));
    return moves;
  }

  Targets targets(std::size_t count, const Eigen::Matrix3d& node_from_upright) {
    const Eigen::Matrix3f turn = node_from_upright.cast<float>();
    Targets list;
    std::vector<std::uint32_t> moved;
    std::vector<float> values;
    for (Eigen::Index k = 0; k < shapes_.shapeCount(); ++k) {
      moved.clear();
      values.clear();
      for (std::uint32_t v = 0; v < count; ++v) {
        const Eigen::Index column = columns_[first_vertex_ + v];
        if (column < 0 || shapes_.shapes.row(k).segment<3>(column).isZero(0)) continue;
        const Eigen::Vector3f move = turn * shapes_.shapes.row(k).segment<3>(column).transpose();
        moved.push_back(v);
        values.insert(values.end(), move.begin(), move.end());
      }
      list.push_back({{"POSITION", model_.addMostlyZeroVec3(moved, values, count, true)}});
    }
    return list;
  }

  GlbModel& model_;
  const std::string& file_;
  const PrincipalShapes& shapes_;
  Eigen::Matrix3d mesh_from_upright_;
  std::vector<Eigen::Index> columns_;  ///< of each vertex' x in the shapes; -1: it rests
  std::size_t first_vertex_ = 0;
  std::set<int> shown_;
  bool is_shown_twice_ = false;
  std::vector<int> moving_nodes_;
};

/// For each morph target of a mesh the column that it follows, or -1.
std::vector<int> columnsOf(const tinygltf::Mesh& mesh, const std::function<int(std::string_view)>& column_of) {
  std::vector<int> columns(mesh.primitives.empty() ? 0 : mesh.primitives[0].targets.size(), -1);
  if (!mesh.extras.IsObject() || !mesh.extras.Get("targetNames").IsArray()) return columns;
  const auto& names = mesh.extras.Get("targetNames").Get<tinygltf::Value::Array>();
  for (std::size_t k = 0; k < std::min(columns.size(), names.size()); ++k) {
    if (names[k].IsString()) columns[k] = column_of(names[k].Get<std::string>());
  }
  return columns;
}

}  // namespace

std::optional<std::string> glbWithShapes(std::string_view glb, const std::string& file, const PrincipalShapes& shapes,
                                         const Eigen::Matrix3d& upright_from_mesh) {
  GlbModel model(glb, file);
  if (!model.hasData() || shapes.shapeCount() == 0) return std::nullopt;
  if (!ShapeAdder(model, file, shapes, upright_from_mesh).add()) return std::nullopt;
  return std::move(model).toBytes();
}

std::optional<std::string> glbWithWeights(std::string_view glb, const std::string& file, double frame_rate_hz,
                                          const RowMajorMatrixF& weights,
                                          const std::function<int(std::string_view)>& column_of) {
  GlbModel model(glb, file);
  if (!model.hasData()) throw InputError(file, "", "holds no mesh with shapes in its own binary chunk");
  std::vector<RowMajorMatrixF> driven;  // frames x targets, one for each of `nodes`
  std::vector<int> nodes;
  for (std::size_t node = 0; node < model.gltf.nodes.size(); ++node) {
    const int mesh = model.gltf.nodes[node].mesh;
    if (mesh < 0) continue;
    if (unsignedIndex(mesh) >= model.gltf.meshes.size()) throw InputError(file, "", "names a mesh that it does not hold");
    const std::vector<int> columns = columnsOf(model.gltf.meshes[unsignedIndex(mesh)], column_of);
    if (std::all_of(columns.begin(), columns.end(), [](int column) { return column < 0; })) continue;
    RowMajorMatrixF own = RowMajorMatrixF::Zero(weights.rows(), signedIndex(columns.size()));
    for (std::size_t k = 0; k < columns.size(); ++k) {
      if (columns[k] >= 0) own.col(signedIndex(k)) = weights.col(columns[k]);
    }
    driven.push_back(std::move(own));
    nodes.push_back(static_cast<int>(node));
  }
  if (nodes.empty()) return std::nullopt;
  std::vector<SpeechTrack> tracks;
  for (std::size_t i = 0; i < nodes.size(); ++i)
    tracks.push_back({{driven[i].data(), unsignedIndex(driven[i].size())}, {nodes[i]}});
  model.setSpeech(unsignedIndex(weights.rows()), frame_rate_hz, tracks);
  return std::move(model).toBytes();
}

}  // namespace mouthpiece
