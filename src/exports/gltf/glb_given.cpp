#include "exports/gltf/glb_given.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <map>
#include <set>
#include <vector>

#include "base/errors.h"
#include "exports/gltf/glb_chunks.h"

namespace mouthpiece {
namespace {

using Eigen::Index;
using nlohmann::json;

constexpr int kTriangles = 4;
constexpr int kMaxNodeDepth = 64;

/// Walks the scene as the GLB reader does, so that vertices are met in the same order, and gives each primitive its
/// targets.
class ShapeAdder {
 public:
  ShapeAdder(GlbChunks& chunks, const std::string& file, const PrincipalShapes& shapes, const Eigen::Matrix3d& upright)
      : chunks_(chunks), root_(chunks.root), file_(file), shapes_(shapes), mesh_from_upright_(upright.transpose()) {}

  /// False when a mesh is shown twice.
  bool add() {
    const auto count = root_.value("scene", std::size_t{0});
    if (chunks_.hasList("scenes")) {
      if (count >= root_["scenes"].size()) fail("names a scene that it does not hold");
      for (const json& node : root_["scenes"][count].value("nodes", json::array()))
        visit(node, Eigen::Affine3d::Identity(), 0);
    } else {
      return false;
    }
    if (first_vertex_ != static_cast<std::size_t>(shapes_.rest.cols() / 3)) return false;
    for (const std::size_t node : moving_nodes_) addChannel(node);
    root_["animations"] = json::array({{{"name", "speech"}, {"samplers", samplers_}, {"channels", channels_}}});
    return !is_shown_twice_ && !channels_.empty();
  }

 private:
  [[noreturn]] void fail(std::string_view what) const { throw InputError(file_, "", what); }

  [[nodiscard]] std::size_t numberIn(const json& value, const char* list) const {
    if (!value.is_number_unsigned() || !chunks_.hasList(list) || value.get<std::size_t>() >= root_[list].size())
      fail(fmt::format("names an entry of '{}' that it does not hold", list));
    return value.get<std::size_t>();
  }

  static Eigen::Affine3d parentFromNode(const json& node) {
    Eigen::Affine3d transform = Eigen::Affine3d::Identity();
    const auto numbers = [&](const char* key) { return node.value(key, std::vector<double>()); };
    if (const auto matrix = numbers("matrix"); matrix.size() == 16) {
      transform.matrix() = Eigen::Map<const Eigen::Matrix4d>(matrix.data());
      return transform;
    }
    if (const auto t = numbers("translation"); t.size() == 3) transform.translate(Eigen::Vector3d(t[0], t[1], t[2]));
    if (const auto r = numbers("rotation"); r.size() == 4) {
      const Eigen::Quaterniond rotation(r[3], r[0], r[1], r[2]);
      if (rotation.norm() > 1e-6) transform.rotate(rotation.normalized());
    }
    if (const auto s = numbers("scale"); s.size() == 3) transform.scale(Eigen::Vector3d(s[0], s[1], s[2]));
    return transform;
  }

  void visit(const json& index, const Eigen::Affine3d& scene_from_parent, int depth) {
    const std::size_t number = numberIn(index, "nodes");
    if (depth > kMaxNodeDepth) fail("found nodes that hold each other in a ring");
    const json node = root_["nodes"][number];
    const Eigen::Affine3d scene_from_node = scene_from_parent * parentFromNode(node);
    if (node.contains("mesh")) {
      const std::size_t mesh = numberIn(node["mesh"], "meshes");
      if (!shown_.insert(mesh).second) is_shown_twice_ = true;
      if (!is_shown_twice_ && addTargets(mesh, scene_from_node.linear().inverse() * mesh_from_upright_))
        moving_nodes_.push_back(number);
    }
    for (const json& child : node.value("children", json::array())) visit(child, scene_from_node, depth + 1);
  }

  /// Whether anything of the mesh moves.
  bool addTargets(std::size_t mesh, const Eigen::Matrix3d& node_from_upright) {
    std::map<std::size_t, json> targets_of;  // by position accessor
    bool moves = false;
    for (json& primitive : root_["meshes"][mesh]["primitives"]) {
      primitive.erase("targets");
      if (primitive.value("mode", kTriangles) != kTriangles) continue;
      const std::size_t positions = numberIn(primitive["attributes"]["POSITION"], "accessors");
      const auto [known, is_new] = targets_of.try_emplace(positions);
      if (is_new) {
        const auto count = root_["accessors"][positions].value("count", std::size_t{0});
        if (count > static_cast<std::size_t>(shapes_.rest.cols() / 3) - first_vertex_)
          fail("has changed since the fit");
        known->second = targets(count, node_from_upright);
        first_vertex_ += count;
      }
      primitive["targets"] = known->second;
      moves = true;
    }
    root_["meshes"][mesh]["weights"] = std::vector<float>(static_cast<std::size_t>(shapes_.shapeCount()), 0.0F);
    json names = json::array();
    for (Index k = 0; k < shapes_.shapeCount(); ++k) names.push_back(fmt::format("shape_{:02}", k));
    root_["meshes"][mesh]["extras"]["targetNames"] = std::move(names);
    return moves;
  }

  json targets(std::size_t count, const Eigen::Matrix3d& node_from_upright) {
    const Eigen::Matrix3f turn = node_from_upright.cast<float>();
    json list = json::array();
    std::vector<float> values(3 * count);
    for (Index k = 0; k < shapes_.shapeCount(); ++k) {
      const float* row = shapes_.shapes.row(k).data() + 3 * first_vertex_;
      for (std::size_t v = 0; v < count; ++v) {
        const Eigen::Vector3f move = turn * Eigen::Map<const Eigen::Vector3f>(row + 3 * v);
        std::copy_n(move.data(), 3, values.begin() + static_cast<std::ptrdiff_t>(3 * v));
      }
      list.push_back({{"POSITION", chunks_.addMostlyZeroVec3(values)}});
    }
    return list;
  }

  void addChannel(std::size_t node) {
    if (samplers_.empty()) {
      std::vector<float> times(static_cast<std::size_t>(shapes_.frameCount()));
      for (std::size_t f = 0; f < times.size(); ++f)
        times[f] = static_cast<float>(static_cast<double>(f) / shapes_.frame_rate_hz);
      const std::size_t input = chunks_.addFloats(times, 1, true);
      const std::span<const float> weights(shapes_.weights.data(), static_cast<std::size_t>(shapes_.weights.size()));
      samplers_.push_back(
          {{"input", input}, {"output", chunks_.addFloats(weights, 1, false)}, {"interpolation", "LINEAR"}});
    }
    channels_.push_back({{"sampler", 0}, {"target", {{"node", node}, {"path", "weights"}}}});
  }

  GlbChunks& chunks_;
  json& root_;
  const std::string& file_;
  const PrincipalShapes& shapes_;
  Eigen::Matrix3d mesh_from_upright_;
  std::size_t first_vertex_ = 0;
  std::set<std::size_t> shown_;
  bool is_shown_twice_ = false;
  std::vector<std::size_t> moving_nodes_;
  json samplers_ = json::array(), channels_ = json::array();
};

}  // namespace

std::optional<std::string> glbWithShapes(std::string_view glb, const std::string& file, const PrincipalShapes& shapes,
                                         const Eigen::Matrix3d& upright_from_mesh) {
  MOUTHPIECE_EXPECT(shapes.vertices.empty());
  GlbChunks chunks = glbChunks(glb, file);
  if (!chunks.hasList("nodes") || !chunks.hasList("meshes") || !chunks.hasList("buffers") || chunks.binary.empty() ||
      shapes.shapeCount() == 0) {
    return std::nullopt;
  }
  try {
    if (!ShapeAdder(chunks, file, shapes, upright_from_mesh).add()) return std::nullopt;
  } catch (const json::exception&) {  // a field of another type than glTF's
    throw InputError(file, "", "is no GLB that can be read");
  }
  return chunks.toBytes();
}

}  // namespace mouthpiece
