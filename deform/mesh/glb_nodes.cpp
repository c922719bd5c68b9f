// GLB through tinygltf, which parses the JSON; the scene as its nodes and skins show it at rest.
#include "deform/mesh/glb_nodes.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

#include "deform/mesh/glb_chunks.h"

namespace mouthpiece {
namespace {

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

}  // namespace

void failWithout(std::string_view what, std::string_view file) {
  throw InputError(std::string(file), "", fmt::format("names a {} that it does not hold", what));
}

Eigen::Vector3f GlbPoses::placeOf(std::size_t vertex, const Eigen::Vector3d& own) const {
  const Eigen::Affine3d scene_from_vertex = skin.empty() ? node : Eigen::Affine3d(skin[vertex].cast<double>());
  return (scene_from_vertex * own).cast<float>();
}

std::vector<Eigen::Matrix3f> GlbPoses::sceneFromMesh() const {
  if (skin.empty()) return {node.linear().cast<float>()};
  std::vector<Eigen::Matrix3f> turns;
  for (const Eigen::Affine3f& pose : skin) turns.emplace_back(pose.linear());
  return turns;
}

GlbNodes::GlbNodes(std::string_view bytes, std::string_view file) : file_(file) {
  load(bytes);
  placeNodes();
}

void GlbNodes::load(std::string_view given) {
  const std::string plain = unpackedGlb(given, file_);
  const std::string_view bytes = plain.empty() ? given : std::string_view(plain);
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
  if (!is_loaded)
    fail(fmt::format("is no GLB that can be read: {}", printable(error.substr(0, error.find('\n')), 160)));
  for (const std::string& extension : model_.extensionsRequired) {
    if (!leavesGeometryAlone(extension)) {
      fail(fmt::format("needs the extension {}, which is not understood; expected a GLB exported without it",
                       printable(extension, 60)));
    }
  }
}

/// Where each node of the scene stands at rest; a joint outside of it stands where its own parents put it.
void GlbNodes::placeNodes() {
  const std::size_t count = model_.nodes.size();
  if (count > kMaxNodeVisits * 10) fail("found more nodes than a head has");
  parents_.assign(count, -1);
  for (std::size_t n = 0; n < count; ++n) {
    for (const int child : model_.nodes[n].children) {
      (void)glbItemAt(model_.nodes, child, "node", file_);
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

GlbBones::Node GlbNodes::bone(std::size_t node) const {
  return {printable(model_.nodes[node].name, 120), parents_[node],
          Eigen::Vector3d(scene_from_node_[node].translation()), roles_[node]};
}

bool GlbNodes::hangsOn(int node, std::string_view object) const {
  for (int at = node; at >= 0; at = parents_[unsignedIndex(at)]) {
    if (model_.nodes[unsignedIndex(at)].name == object) return true;
  }
  return false;
}

bool GlbNodes::skinHangsOn(int skin, std::string_view object) const {
  const std::vector<int>& joints = glbItemAt(model_.skins, skin, "skin", file_).joints;
  return !joints.empty() && unsignedIndex(joints[0]) < parents_.size() && hangsOn(joints[0], object);
}

GlbPoses GlbNodes::posesOf(const tinygltf::Primitive& primitive, int node_index, std::size_t count) const {
  if (node_index < 0) return {Eigen::Affine3d::Identity(), {}, {BoneRole::kUnknown}, {}, false};
  const tinygltf::Node& node = model_.nodes[unsignedIndex(node_index)];
  const bool is_skinned = node.skin >= 0 && primitive.attributes.contains("JOINTS_0");
  if (!is_skinned) {
    const BoneRole role = roles_[unsignedIndex(node_index)];
    return {scene_from_node_[unsignedIndex(node_index)], {}, {role}, {}, role != BoneRole::kUnknown};
  }
  const tinygltf::Skin& skin = glbItemAt(model_.skins, node.skin, "skin", file_);
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
  GlbPoses poses;
  poses.tells_bones = true;
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

std::vector<Eigen::Matrix4f> GlbNodes::jointMatrices(const tinygltf::Skin& skin) const {
  if (skin.joints.size() > kMaxJoints) fail("found more joints than a body has");
  GlbViews::Numbers binds;
  if (skin.inverseBindMatrices >= 0) binds = views_.numbers(skin.inverseBindMatrices, {TINYGLTF_TYPE_MAT4});
  if (skin.inverseBindMatrices >= 0 && unsignedIndex(binds.rows()) < skin.joints.size())
    fail("found fewer bind matrices than joints");
  std::vector<Eigen::Matrix4f> matrices;
  for (std::size_t j = 0; j < skin.joints.size(); ++j) {
    (void)glbItemAt(model_.nodes, skin.joints[j], "node", file_);
    const Eigen::Matrix4d& scene_from_joint = scene_from_node_[unsignedIndex(skin.joints[j])].matrix();
    Eigen::Matrix4d joint_from_mesh = Eigen::Matrix4d::Identity();
    if (binds.rows() > 0)
      joint_from_mesh = Eigen::Map<const Eigen::Matrix4f>(binds.row(signedIndex(j)).data()).cast<double>();
    matrices.emplace_back((scene_from_joint * joint_from_mesh).cast<float>());
    if (!matrices.back().allFinite()) fail("found a bind matrix that is no number");
  }
  return matrices;
}

}  // namespace mouthpiece
