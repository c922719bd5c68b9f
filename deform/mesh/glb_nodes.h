#pragma once

#include <tiny_gltf.h>

#include <Eigen/Geometry>
#include <string>
#include <string_view>
#include <vector>

#include "base/errors.h"
#include "base/index.h"
#include "deform/mesh/bone_roles.h"
#include "deform/mesh/glb_scene.h"
#include "deform/mesh/glb_views.h"

namespace mouthpiece {

inline constexpr int kMaxNodeDepth = 64;
inline constexpr std::size_t kMaxNodeVisits = 10'000;

/// Throws InputError: the file names a `what` that it does not hold.
[[noreturn]] void failWithout(std::string_view what, std::string_view file);

/// `what` names the kind of item. Throws InputError for an index that is none.
template <typename Item>
const Item& glbItemAt(const std::vector<Item>& items, int index, std::string_view what, std::string_view file) {
  if (index < 0 || unsignedIndex(index) >= items.size()) failWithout(what, file);
  return items[unsignedIndex(index)];
}

/// Takes the places of some vertices to the scene's: one map for all, or one a vertex.
struct GlbPoses {
  Eigen::Affine3d node = Eigen::Affine3d::Identity();
  std::vector<Eigen::Affine3f> skin;  ///< empty, or one a vertex
  std::vector<BoneRole> roles;        ///< one for all, or one a vertex
  std::vector<float> jaw_shares;      ///< empty, or one a vertex: how much bones of the jaw carry
  bool tells_bones = false;           ///< the roles come from a skeleton

  [[nodiscard]] Eigen::Vector3f placeOf(std::size_t vertex, const Eigen::Vector3d& own) const;
  /// How moves are turned and stretched: one for all, or one a vertex.
  [[nodiscard]] std::vector<Eigen::Matrix3f> sceneFromMesh() const;
  [[nodiscard]] BoneRole roleAt(std::size_t vertex) const { return roles[roles.size() == 1 ? 0 : vertex]; }
  [[nodiscard]] float jawShareAt(std::size_t vertex) const {
    return jaw_shares.empty() ? (roleAt(vertex) == BoneRole::kJaw ? 1.0F : 0.0F) : jaw_shares[vertex];
  }
};

/// A GLB as tinygltf reads it, and where its nodes and skins stand at rest.
class GlbNodes {
 public:
  /// Both must outlive it; `file` is for messages. Throws InputError for what is no GLB, needs an extension that moves
  /// vertices, or holds nodes that hold each other.
  GlbNodes(std::string_view bytes, std::string_view file);
  GlbNodes(const GlbNodes&) = delete;
  GlbNodes& operator=(const GlbNodes&) = delete;

  [[nodiscard]] const tinygltf::Model& model() const { return model_; }
  [[nodiscard]] const GlbViews& views() const { return views_; }
  /// What the node is, and where it stands at rest.
  [[nodiscard]] GlbBones::Node bone(std::size_t node) const;
  /// Whether the node, or one above it, has this name.
  [[nodiscard]] bool hangsOn(int node, std::string_view object) const;
  /// The same of the first joint: a skinned mesh often lies beside the bones that carry it.
  [[nodiscard]] bool skinHangsOn(int skin, std::string_view object) const;
  /// The node's own place, or for a skinned mesh the bones' at rest: then the node itself does not count (glTF 2.0,
  /// 3.7.3.1). `node`: -1 for none. `count`: vertices of the primitive.
  [[nodiscard]] GlbPoses posesOf(const tinygltf::Primitive& primitive, int node, std::size_t count) const;

 private:
  [[noreturn]] void fail(std::string_view what) const { throw InputError(std::string(file_), "", what); }
  void load(std::string_view given);
  void placeNodes();
  [[nodiscard]] std::vector<Eigen::Matrix4f> jointMatrices(const tinygltf::Skin& skin) const;

  std::string_view file_;
  tinygltf::Model model_;
  GlbViews views_{model_, file_};
  std::vector<int> parents_;
  std::vector<Eigen::Affine3d> scene_from_node_;
  std::vector<BoneRole> roles_;
};

}  // namespace mouthpiece
