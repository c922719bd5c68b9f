// What the bones of a head tell; which bone stands where is told in docs/theory/face_finder/bones.md.
#include "retarget/placing/bone_anchors.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cctype>
#include <optional>
#include <string_view>

#include "base/errors.h"
#include "deform/mesh/face_mesh.h"
#include "deform/mesh/glb_scene.h"
#include "deform/mesh/triangle_tree.h"
#include "retarget/placing/face_page.h"

namespace mouthpiece {
namespace {

/// How far the jaw is turned, radians: lips part, and the chin stays what the jaw moves furthest.
constexpr double kJawTurn = 0.25;

struct FaceBone {
  std::string_view bone;  ///< plain()
  std::string_view anchor;
};
constexpr std::array<FaceBone, 21> kFaceBones{
    {// MetaHuman: FACIAL_R_LipCorner; Daz: rLipCorner, r_lipcorner
     {"rlipcorner", "LIP_CORNER_R"},
     {"llipcorner", "LIP_CORNER_L"},
     {"clipupper", "LIP_UP_MID"},
     {"cliplower", "LIP_LO_MID"},
     {"lipuppermiddle", "LIP_UP_MID"},
     {"liplowermiddle", "LIP_LO_MID"},
     {"cnosetip", "NOSE_TIP"},
     {"reyecornerouter", "CANTHUS_OUT_R"},
     {"leyecornerouter", "CANTHUS_OUT_L"},
     {"reyecornerinner", "EYE_IN_R"},
     {"leyecornerinner", "EYE_IN_L"},
     {"reyelidouter", "CANTHUS_OUT_R"},
     {"leyelidouter", "CANTHUS_OUT_L"},
     {"reyelidinner", "EYE_IN_R"},
     {"leyelidinner", "EYE_IN_L"},
     // Rigify: a chain of a lip starts in its middle, the cheek's at the corner
     {"liptl", "LIP_UP_MID"},
     {"liptr", "LIP_UP_MID"},
     {"lipbl", "LIP_LO_MID"},
     {"lipbr", "LIP_LO_MID"},
     {"cheekbr", "LIP_CORNER_R"},
     {"cheekbl", "LIP_CORNER_L"}}};

/// Lower case, letters alone: what programs put before a name, behind it or between its words is gone.
std::string plain(std::string_view name) {
  std::string text;
  for (const char letter : name) {
    const auto byte = static_cast<unsigned char>(letter);
    if (std::isalpha(byte) != 0) text.push_back(static_cast<char>(std::tolower(byte)));
  }
  return text;
}

std::string boneName(std::string_view name) {
  std::string text = plain(name);
  for (const std::string_view prefix : {"facial", "def", "org"}) {
    if (text.starts_with(prefix)) text.erase(0, prefix.size());
  }
  return text;
}

/// Rigify numbers a chain's further bones: "lip.T.L.001" starts elsewhere than "lip.T.L".
bool isFurtherInChain(std::string_view name) {
  const std::size_t dot = name.find_last_of("._");
  if (dot == std::string_view::npos || dot + 1 == name.size()) return false;
  return std::all_of(name.begin() + static_cast<std::ptrdiff_t>(dot) + 1, name.end(),
                     [](char letter) { return std::isdigit(static_cast<unsigned char>(letter)) != 0; });
}

/// Where the jaw turns: the uppermost of its bones, of several the one that carries a chain of them.
std::optional<Eigen::Vector3d> jawJoint(const GlbBones& bones) {
  for (const GlbBones::Node& node : bones.nodes) {
    if (node.role != BoneRole::kJaw) continue;
    if (node.parent < 0 || bones.nodes[static_cast<std::size_t>(node.parent)].role != BoneRole::kJaw) return node.place;
  }
  return std::nullopt;
}

/// The jaw's bones turned about the axis through their joint that runs from ear to ear.
VertexPositions openedByJaw(const FaceMesh& mesh, const GlbBones& bones) {
  const auto joint = jawJoint(bones);
  if (!joint) return {};
  double carried = 0, forward = 0;
  for (std::size_t v = 0; v < bones.jaw_share.size(); ++v) {
    const auto share = static_cast<double>(bones.jaw_share[v]);
    carried += share;
    forward += share * (pointAt(mesh.vertices, v).z() - joint->z());
  }
  if (!(carried > 0)) return {};
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(forward < 0 ? -kJawTurn : kJawTurn, Eigen::Vector3d::UnitX()).toRotationMatrix();
  VertexPositions moves = VertexPositions::Zero(mesh.vertices.rows(), 3);
  for (std::size_t v = 0; v < bones.jaw_share.size(); ++v) {
    const Eigen::Vector3d from = pointAt(mesh.vertices, v) - *joint;
    moves.row(signedIndex(v)) =
        (static_cast<double>(bones.jaw_share[v]) * (turn * from - from)).cast<float>().transpose();
  }
  return moves;
}

std::map<std::string, Eigen::Vector3d> onSkin(const FaceMesh& mesh, std::map<std::string, Eigen::Vector3d> places) {
  if (places.empty()) return places;
  const TriangleTree skin(mesh.vertices, trianglesOf(mesh, {PartKind::kSkin, PartKind::kLips}));
  for (auto& [name, place] : places) {
    if (const auto foot = skin.closest(place)) place = foot->point;
  }
  return places;
}

}  // namespace

BoneAnchors anchorsFromBones(const FaceMesh& mesh, const GlbBones& bones) {
  MOUTHPIECE_EXPECT(bones.roles.size() == mesh.vertexCount() && bones.jaw_share.size() == mesh.vertexCount());
  BoneAnchors found;
  for (const GlbBones::Node& node : bones.nodes) {
    for (const AnchorToPick& anchor : suggestedAnchors()) {
      if (plain(node.name) == plain(anchor.name)) found.named.emplace(anchor.name, node.place);
    }
    if (node.role == BoneRole::kUnknown || isFurtherInChain(node.name)) continue;
    const std::string name = boneName(node.name);
    for (const auto& [bone, anchor] : kFaceBones) {
      if (name == bone) found.face_bones.emplace(anchor, node.place);
    }
  }
  found.face_bones = onSkin(mesh, std::move(found.face_bones));
  found.jaw_open = openedByJaw(mesh, bones);
  for (std::uint32_t v = 0; v < bones.roles.size(); ++v) {
    const BoneRole role = bones.roles[v];
    if (role == BoneRole::kHead || role == BoneRole::kJaw || role == BoneRole::kEye) found.head.push_back(v);
  }
  return found;
}

}  // namespace mouthpiece
