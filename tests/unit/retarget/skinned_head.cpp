#include "skinned_head.h"

#include <cstdint>
#include <nlohmann/json.hpp>

#include "base/index.h"
#include "deform/mesh/glb_chunks.h"

namespace mouthpiece::test {
namespace {

using nlohmann::json;

class SkinnedWriter {
 public:
  std::string write(const SkinnedHead& head) {
    root_ = {{"asset", {{"version", "2.0"}}}, {"scene", 0},
             {"accessors", json::array()},    {"bufferViews", json::array()},
             {"nodes", json::array()},        {"materials", json::array()}};
    const std::size_t count = head.mesh.vertexCount();
    json attributes;
    const Eigen::Vector3f low = head.mesh.vertices.colwise().minCoeff(), high = head.mesh.vertices.colwise().maxCoeff();
    attributes["POSITION"] = add(head.mesh.vertices.data(), 3 * count, 5126, "VEC3", count);
    root_["accessors"].back()["min"] = {low.x(), low.y(), low.z()};
    root_["accessors"].back()["max"] = {high.x(), high.y(), high.z()};
    std::vector<std::uint8_t> joints;
    std::vector<float> weights;
    for (std::size_t v = 0; v < count; ++v) {
      for (const int joint : {head.carriers[v][0], head.carriers[v][1], 0, 0})
        joints.push_back(static_cast<std::uint8_t>(joint));
      weights.insert(weights.end(), {head.shares[v], 1 - head.shares[v], 0, 0});
    }
    attributes["JOINTS_0"] = add(joints.data(), joints.size(), 5121, "VEC4", count);
    attributes["WEIGHTS_0"] = add(weights.data(), weights.size(), 5126, "VEC4", count);
    json primitives = json::array();
    for (const MeshPart& part : head.mesh.parts) {
      const auto triangles = trianglesOf(head.mesh, part);
      primitives.push_back(
          {{"attributes", attributes},
           {"material", root_["materials"].size()},
           {"indices", add(triangles.data(), 3 * triangles.size(), 5125, "SCALAR", 3 * triangles.size())}});
      root_["materials"].push_back({{"name", part.name}});
    }
    root_["meshes"] = {{{"primitives", primitives}}};
    addNodes(head);
    json buffer{{"byteLength", binary_.size()}};
    root_["buffers"] = json::array({buffer});
    if (!head.vrm.empty()) addVrm(head);
    return glbOf(root_.dump(), binary_);
  }

 private:
  template <typename T>
  std::size_t add(const T* values, std::size_t count, int component, const char* type, std::size_t entries) {
    const std::size_t size = component == 5121 ? 1 : 4;
    binary_.append((4 - binary_.size() % 4) % 4, '\0');
    root_["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", binary_.size()}, {"byteLength", count * size}});
    binary_.append(reinterpret_cast<const char*>(values), count * size);
    root_["accessors"].push_back({{"bufferView", root_["bufferViews"].size() - 1},
                                  {"componentType", component},
                                  {"count", entries},
                                  {"type", type}});
    return root_["accessors"].size() - 1;
  }

  void addNodes(const SkinnedHead& head) {
    json tops = json::array(), joints = json::array();
    std::vector<float> binds;
    for (std::size_t n = 0; n < head.nodes.size(); ++n) {
      const MadeUpNode& node = head.nodes[n];
      const Eigen::Vector3d from =
          node.parent < 0 ? Eigen::Vector3d::Zero().eval() : head.nodes[static_cast<std::size_t>(node.parent)].place;
      const Eigen::Vector3d step = node.place - from;
      root_["nodes"].push_back({{"name", node.name}, {"translation", {step.x(), step.y(), step.z()}}});
      if (node.parent < 0)
        tops.push_back(n);
      else
        root_["nodes"][static_cast<std::size_t>(node.parent)]["children"].push_back(n);
      if (!node.is_joint) continue;
      joints.push_back(n);
      for (const double value : {1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -node.place.x(),
                                 -node.place.y(), -node.place.z(), 1.0})
        binds.push_back(static_cast<float>(value));
    }
    const std::size_t matrices = add(binds.data(), binds.size(), 5126, "MAT4", joints.size());
    root_["skins"] = {{{"joints", joints}, {"inverseBindMatrices", matrices}}};
    tops.push_back(root_["nodes"].size());
    root_["nodes"].push_back({{"name", "body"}, {"mesh", 0}, {"skin", 0}});
    root_["scenes"] = {{{"nodes", tops}}};
  }

  void addVrm(const SkinnedHead& head) {
    json list = json::array(), named = json::object();
    for (const auto& [bone, node] : head.human_bones) {
      list.push_back({{"bone", bone}, {"node", node}});
      named[bone] = {{"node", node}};
    }
    root_["extensionsUsed"] = {head.vrm};
    root_["extensions"][head.vrm]["humanoid"]["humanBones"] = head.vrm == "VRM" ? list : named;
  }

  json root_;
  std::string binary_;
};

}  // namespace

std::string skinnedGlb(const SkinnedHead& head) { return SkinnedWriter().write(head); }

}  // namespace mouthpiece::test
