// What bones and shapes of a file are called.
#include "deform/mesh/bone_roles.h"

#include <fmt/format.h>
#include <tiny_gltf.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <map>
#include <string>

#include "base/errors.h"

namespace mouthpiece {
namespace {

/// Lower case, letters and digits only.
std::string plain(std::string_view name) {
  std::string text;
  for (const char letter : name) {
    const auto byte = static_cast<unsigned char>(letter);
    if (std::isalnum(byte) != 0) text.push_back(static_cast<char>(std::tolower(byte)));
  }
  return text;
}

template <std::size_t count>
bool hasOneOf(std::string_view text, const std::array<std::string_view, count>& words) {
  return std::any_of(words.begin(), words.end(),
                     [&](std::string_view word) { return text.find(word) != std::string_view::npos; });
}

BoneRole roleFromName(std::string_view name) {
  const std::string text = plain(name);
  constexpr std::array<std::string_view, 5> kLids{"lid", "brow", "lash", "eyecorner", "eyesack"};
  if (hasOneOf<5>(text, kLids)) return BoneRole::kHead;
  if (hasOneOf<5>(text, {"jaw", "mandible", "unterkiefer", "tongue", "lowerteeth"}) || text == "kiefer" ||
      (hasOneOf<2>(name, {"顎", "あご"}) && name.find("上") == std::string_view::npos))
    return BoneRole::kJaw;
  if (hasOneOf<1>(text, {"eye"})) return BoneRole::kEye;
  if (hasOneOf<2>(text, {"hair", "bangs"})) return BoneRole::kHair;
  if (hasOneOf<3>(text, {"head", "neck", "face"})) return BoneRole::kHead;
  return BoneRole::kUnknown;
}

void setRole(std::vector<BoneRole>& roles, const tinygltf::Value& node, std::string_view bone) {
  if (!node.IsInt()) return;
  const int number = node.Get<int>();
  if (number < 0 || static_cast<std::size_t>(number) >= roles.size()) return;
  BoneRole& role = roles[static_cast<std::size_t>(number)];
  if (bone == "head" || bone == "neck") role = BoneRole::kHead;
  if (bone == "jaw") role = BoneRole::kJaw;
  if (bone == "leftEye" || bone == "rightEye") role = BoneRole::kEye;
}

/// The library's own Get() stops a build with assertions where `value` is no object, as in any file it may be.
const tinygltf::Value& memberOf(const tinygltf::Value& value, const std::string& name) {
  static const tinygltf::Value kNone;
  return value.Has(name) ? value.Get(name) : kNone;
}

/// At most so many entries of a list in a file.
int entriesOf(const tinygltf::Value& list) {
  return list.IsArray() ? static_cast<int>(std::min<std::size_t>(list.ArrayLen(), 1000)) : 0;
}

/// VRM 0: a list of {bone, node}; VRM 1: an object of {node} by bone.
void readVrmBones(const tinygltf::Model& model, std::vector<BoneRole>& roles) {
  for (const char* extension : {"VRM", "VRMC_vrm"}) {
    const auto found = model.extensions.find(extension);
    if (found == model.extensions.end()) continue;
    const tinygltf::Value& bones = memberOf(memberOf(found->second, "humanoid"), "humanBones");
    for (int i = 0; i < entriesOf(bones); ++i) {
      const tinygltf::Value& entry = bones.Get(i);
      const tinygltf::Value& bone = memberOf(entry, "bone");
      if (bone.IsString()) setRole(roles, memberOf(entry, "node"), bone.Get<std::string>());
    }
    for (const std::string& bone : bones.Keys()) setRole(roles, memberOf(bones.Get(bone), "node"), bone);
  }
}

/// Rigify's deforming bones have no head, their spine ends in it: what a jaw hangs on is one.
void nameHeadByJaw(std::vector<BoneRole>& own, const std::vector<bool>& is_joint, const std::vector<int>& parents) {
  if (std::find(own.begin(), own.end(), BoneRole::kHead) != own.end()) return;
  for (std::size_t n = 0; n < own.size(); ++n) {
    if (own[n] != BoneRole::kJaw || parents[n] < 0) continue;
    const auto parent = static_cast<std::size_t>(parents[n]);
    if (own[parent] == BoneRole::kUnknown && is_joint[parent]) own[parent] = BoneRole::kHead;
  }
}

constexpr std::array<std::string_view, 12> kVowels{"a", "i", "u", "e", "o", "aa", "ih", "ou", "ee", "oh", "ah", "oo"};

bool isVowel(std::string_view plain_name) {
  return std::find(kVowels.begin(), kVowels.end(), plain_name) != kVowels.end();
}

/// Whether an expression's name says what its shape is, which the shape's own name then need not.
bool isTelling(std::string_view expression) { return isVowel(expression) || expression.starts_with("blink"); }

bool tellsMouthOrLids(std::string_view name) {
  // MMD's kana say less than the expression that binds one.
  return (isMouthShape(name) && !plain(name).empty()) || hasOneOf<3>(plain(name), {"blink", "eyeclose", "eyesclose"});
}

/// Hands each preset expression of a VRM to `take` with the mesh and the target of each of its binds.
template <typename Take>
void readVrmExpressions(const tinygltf::Model& model, const Take& take) {
  const auto targetsOf = [&](const std::string& name, const tinygltf::Value& binds) {
    std::map<int, std::vector<int>> targets;  // by mesh
    for (int b = 0; b < entriesOf(binds); ++b) {
      const tinygltf::Value &bind = binds.Get(b), &node = memberOf(bind, "node"), &mesh = memberOf(bind, "mesh"),
                            &index = memberOf(bind, "index");
      if (!index.IsInt()) continue;
      int number = mesh.IsInt() ? mesh.Get<int>() : -1;  // VRM 0; VRM 1 names the node
      if (node.IsInt() && node.Get<int>() >= 0 && static_cast<std::size_t>(node.Get<int>()) < model.nodes.size())
        number = model.nodes[static_cast<std::size_t>(node.Get<int>())].mesh;
      targets[number].push_back(index.Get<int>());
    }
    for (const auto& [mesh, list] : targets) {
      if (list.size() == 1) take(name, mesh, list.front());
    }
  };
  if (const auto vrm = model.extensions.find("VRM"); vrm != model.extensions.end()) {
    const tinygltf::Value& groups = memberOf(memberOf(vrm->second, "blendShapeMaster"), "blendShapeGroups");
    for (int g = 0; g < entriesOf(groups); ++g) {
      const tinygltf::Value& preset = memberOf(groups.Get(g), "presetName");
      if (preset.IsString()) targetsOf(preset.Get<std::string>(), memberOf(groups.Get(g), "binds"));
    }
  }
  if (const auto vrm = model.extensions.find("VRMC_vrm"); vrm != model.extensions.end()) {
    const tinygltf::Value& presets = memberOf(memberOf(vrm->second, "expressions"), "preset");
    for (const std::string& preset : presets.Keys())
      targetsOf(preset, memberOf(presets.Get(preset), "morphTargetBinds"));
  }
}

/// The names that `extras` has for targets.
std::vector<std::string> targetNames(const tinygltf::Value& extras) {
  std::vector<std::string> names;
  const tinygltf::Value& list = memberOf(extras, "targetNames");
  for (std::size_t t = 0; list.IsArray() && t < list.ArrayLen(); ++t) {
    const tinygltf::Value& name = list.Get(static_cast<int>(t));  // no file has 2^31 of them
    names.push_back(name.IsString() ? printable(name.Get<std::string>(), 120) : std::string());
  }
  return names;
}

}  // namespace

std::vector<std::vector<std::string>> shapeNames(const tinygltf::Model& model) {
  std::vector<std::vector<std::string>> names;
  for (const tinygltf::Mesh& mesh : model.meshes) {
    std::vector<std::string>& own = names.emplace_back(targetNames(mesh.extras));
    if (mesh.primitives.empty()) continue;
    if (own.empty()) own = targetNames(mesh.primitives[0].extras);
    own.resize(mesh.primitives[0].targets.size());
    for (std::size_t t = 0; t < own.size(); ++t) {
      if (own[t].empty()) own[t] = fmt::format("shape_{:02}", t);
    }
  }
  readVrmExpressions(model, [&](const std::string& expression, int mesh, int target) {
    if (!isTelling(plain(expression)) || mesh < 0 || static_cast<std::size_t>(mesh) >= names.size()) return;
    std::vector<std::string>& own = names[static_cast<std::size_t>(mesh)];
    if (target < 0 || static_cast<std::size_t>(target) >= own.size()) return;
    std::string& name = own[static_cast<std::size_t>(target)];
    if (!tellsMouthOrLids(name)) name = expression;
  });
  return names;
}

std::vector<BoneRole> boneRoles(const tinygltf::Model& model, const std::vector<int>& parents) {
  std::vector<BoneRole> own(model.nodes.size(), BoneRole::kUnknown);
  std::vector<bool> is_joint(model.nodes.size(), false);
  for (const tinygltf::Skin& skin : model.skins) {
    for (const int joint : skin.joints) {
      if (joint >= 0 && static_cast<std::size_t>(joint) < own.size()) is_joint[static_cast<std::size_t>(joint)] = true;
    }
  }
  for (std::size_t n = 0; n < own.size(); ++n) {
    if (is_joint[n]) own[n] = roleFromName(model.nodes[n].name);
  }
  readVrmBones(model, own);
  nameHeadByJaw(own, is_joint, parents);
  if (std::find(own.begin(), own.end(), BoneRole::kHead) == own.end()) {
    std::fill(own.begin(), own.end(), BoneRole::kUnknown);
    return own;
  }
  std::vector<BoneRole> roles(own.size(), BoneRole::kUnknown);
  for (std::size_t n = 0; n < roles.size(); ++n) {
    bool hangs_on_joint = false;
    // The reader has made sure that the way up ends.
    for (int at = static_cast<int>(n); at >= 0 && roles[n] == BoneRole::kUnknown;
         at = parents[static_cast<std::size_t>(at)]) {
      roles[n] = own[static_cast<std::size_t>(at)];
      hangs_on_joint = hangs_on_joint || is_joint[static_cast<std::size_t>(at)];
    }
    if (roles[n] == BoneRole::kUnknown && hangs_on_joint) roles[n] = BoneRole::kBody;
  }
  return roles;
}

bool isJawShape(std::string_view name) {
  const std::string text = plain(name);
  // "Fcl_MTH_A" ends so; "Fcl_MTH_Angry" goes on.
  if (hasOneOf<4>(text, {"jawopen", "mouthopen", "visemeaa", "jawdrop"}) || text.ends_with("mtha")) return true;
  return text == "a" || text == "aa" || text == "ah" || text == "vaa" || name == "あ";
}

bool isMouthShape(std::string_view name) {
  if (isJawShape(name)) return true;
  const std::string text = plain(name);
  if (hasOneOf<10>(text, {"mouth", "jaw", "viseme", "mth", "lip", "smile", "phoneme", "tongue", "frown", "pucker"}))
    return true;
  constexpr std::array<std::string_view, 5> kOfMmd{"い", "う", "え", "お", "ん"};
  return isVowel(text) || std::find(kOfMmd.begin(), kOfMmd.end(), name) != kOfMmd.end();
}

}  // namespace mouthpiece
