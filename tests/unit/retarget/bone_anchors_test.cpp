// Anchors by what a head's bones carry and are called, and by nodes called as anchors are.
#include "retarget/placing/bone_anchors.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <ostream>

#include "base/files.h"
#include "deform/mesh/face_mesh.h"
#include "deform/topology/head_topology.h"
#include "retarget/placing/anchors.h"
#include "retarget/placing/face_page.h"
#include "skinned_head.h"
#include "support/run_program.h"
#include "test_face.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;
using test::runProgram;
using test::ScratchFolder;

constexpr int kHips = 0, kHead = 1, kJaw = 2, kRightEye = 3, kLeftEye = 4;

/// The names of one convention; a head without a name of its own has "".
struct Convention {
  const char* name;
  const char *head, *jaw, *right_eye, *left_eye;
  const char* vrm = "";
};
void PrintTo(const Convention& convention, std::ostream* out) { *out << convention.name; }

/// The default head in metres, on bones: the jaw carries the lower lip whole, the chin nearly, the cheeks in part.
test::SkinnedHead defaultHeadOn(const Convention& names) {
  const DefaultFace& face = test::defaultFace();
  test::SkinnedHead head;
  head.mesh = face.mesh;
  head.mesh.texture_coordinates.clear();
  head.mesh.vertex_colors.clear();
  const HeadTopology topology(face.mesh, openingsOf(face.mesh, face.anchors, "default"));
  const std::vector<PartKind> kinds = vertexKinds(face.mesh);
  const Eigen::Vector3d corner = *placeOf(face.anchors, "LIP_CORNER_L", face.mesh, "");
  for (std::uint32_t v = 0; v < face.mesh.vertexCount(); ++v) {
    // Within the mouth a lip is carried whole or not at all; beside it more and more, the further down.
    const Eigen::Vector3d at = pointAt(face.mesh.vertices, v);
    const double beside = std::clamp((std::abs(at.x()) - corner.x()) / 8, 0.0, 1.0);  // mm
    const double side = topology.lowerShare(v) > 0.5 ? 1 : 0;
    const double below = (1 - beside) * side + beside * std::clamp(0.5 + (corner.y() - at.y()) / 40, 0.0, 1.0);
    const double near = std::clamp(2.5 - topology.wayToLowerLip()[v] / 40, 0.0, 1.0);  // of the lip, mm
    if (kinds[v] == PartKind::kEye) {
      head.carriers.push_back({face.mesh.vertices(v, 0) < 0 ? kRightEye : kLeftEye, kHead});
      head.shares.push_back(1);
    } else {
      head.carriers.push_back({kJaw, kHead});
      head.shares.push_back(kinds[v] == PartKind::kLowerTeeth ? 1.0F : asFloat(below * near));
    }
  }
  head.mesh.vertices *= 0.001F;
  const Eigen::Vector3d right = 0.001 * *placeOf(face.anchors, "CANTHUS_OUT_R", face.mesh, ""),
                        left = 0.001 * *placeOf(face.anchors, "CANTHUS_OUT_L", face.mesh, "");
  const Eigen::Vector3d mouth = 0.001 * *placeOf(face.anchors, "LIP_CORNER_R", face.mesh, "");
  const Eigen::Vector3d joint(0, mouth.y() + 0.04, mouth.z() - 0.07);
  head.nodes = {{"hips", {0, -0.5, 0}},
                {names.head, {0, joint.y() - 0.02, joint.z() - 0.01}, kHips},
                {names.jaw, joint, kHead},
                {names.right_eye, {right.x() + 0.014, right.y(), right.z()}, kHead},
                {names.left_eye, {left.x() - 0.014, left.y(), left.z()}, kHead}};
  head.vrm = names.vrm;
  if (!head.vrm.empty())
    head.human_bones = {
        {"hips", kHips}, {"head", kHead}, {"jaw", kJaw}, {"rightEye", kRightEye}, {"leftEye", kLeftEye}};
  return head;
}

struct Found {
  std::map<std::string, Eigen::Vector3d> places;
  std::string said;
};
Found foundOn(const test::SkinnedHead& head, const std::vector<std::string>& more = {}) {
  const ScratchFolder folder;
  const fs::path glb = folder.path() / "head.glb", file = folder.path() / "head.anchors.json";
  writeFileAtomically(glb, skinnedGlb(head));
  std::vector<std::string> line{"anchors", glb.string(), "-o", file.string()};
  line.insert(line.end(), more.begin(), more.end());
  const auto result = runProgram("retarget", line);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  if (result.exit_code != 0) return {};
  const FaceMesh mesh = readFaceMesh(glb);
  const Anchors anchors = parseAnchors(readFile(file), file.string());
  Found found{{}, result.out};
  for (const auto& [name, place] : anchors.markers) found.places[name] = *placeOf(anchors, name, mesh, "");
  return found;
}

/// Metres from where the default face has it.
double offTheDefault(const Found& found, const std::string& name) {
  const DefaultFace& face = test::defaultFace();
  return (found.places.at(name) - 0.001 * *placeOf(face.anchors, name, face.mesh, "")).norm();
}

class JawBones : public testing::TestWithParam<Convention> {};

TEST_P(JawBones, PartTheLips) {
  if (!test::canonicalFace()) GTEST_SKIP() << test::kNoCanonicalFace;
  const Found found = foundOn(defaultHeadOn(GetParam()), {"--by", "bones"});
  EXPECT_NE(found.said.find("by what the jaw's bone parts"), std::string::npos) << found.said;
  ASSERT_GE(found.places.size(), 8U);
  for (const auto& [name, place] : found.places)
    EXPECT_LT(offTheDefault(found, name), name == "CHIN_LOW" ? 0.015 : 0.008) << name;
}

INSTANTIATE_TEST_SUITE_P(Named, JawBones,
                         testing::Values(Convention{"vrm_1", "J_1", "J_2", "J_3", "J_4", "VRMC_vrm"},
                                         Convention{"vrm_0", "kubi", "ago", "migime", "hidarime", "VRM"},
                                         Convention{"mpfb", "head", "jaw", "eye.R", "eye.L"},
                                         Convention{"rigify", "DEF-spine.006", "DEF-jaw", "DEF-eye.R", "DEF-eye.L"},
                                         Convention{"character_creator", "CC_Base_Head", "CC_Base_JawRoot",
                                                    "CC_Base_R_Eye", "CC_Base_L_Eye"},
                                         Convention{"daz", "head", "lowerJaw", "rEye", "lEye"},
                                         Convention{"metahuman", "head", "FACIAL_C_Jaw", "FACIAL_R_Eye",
                                                    "FACIAL_L_Eye"}),
                         [](const auto& convention) { return convention.param.name; });

TEST(HeadBones, ShowWhereOnAFigureToLook) {
  if (!test::canonicalFace()) GTEST_SKIP() << test::kNoCanonicalFace;
  // Mixamo's and Ready Player Me's heads have no jaw. Beside this one stands a pole of four metres, which bones do not
  // carry: the head is a speck in the picture of both.
  test::SkinnedHead head =
      defaultHeadOn({"mixamo", "mixamorig:Head", "mixamorig:Neck", "mixamorig:RightEye", "mixamorig:LeftEye"});
  const auto first = static_cast<std::uint32_t>(head.mesh.vertexCount());
  head.mesh.vertices.conservativeResize(first + 4, 3);
  head.mesh.vertices.bottomRows(4) << 0.5F, -1.5F, 0, 0.55F, -1.5F, 0, 0.55F, 4, 0, 0.5F, 4, 0;
  for (int corner = 0; corner < 4; ++corner) {
    head.carriers.push_back({kHips, kHips});
    head.shares.push_back(1);
  }
  const std::size_t before = head.mesh.triangles.size();
  head.mesh.triangles.insert(head.mesh.triangles.end(), {{first, first + 1, first + 2}, {first, first + 2, first + 3}});
  head.mesh.parts.push_back({.name = "pole", .first_triangle = before, .triangle_count = 2});
  const ScratchFolder folder;
  writeObj(folder.path() / "no_bones.obj", head.mesh);
  EXPECT_EQ(runProgram("retarget", {"anchors", (folder.path() / "no_bones.obj").string()}).exit_code, 1);
  const Found found = foundOn(head);
  EXPECT_NE(found.said.find("as the head looks"), std::string::npos) << found.said;
  ASSERT_EQ(found.places.size(), suggestedAnchors().size());
  for (const auto& [name, place] : found.places)
    EXPECT_LT(offTheDefault(found, name), name == "CHIN_LOW" ? 0.015 : 0.008) << name;
}

TEST(NamedNodes, AreTheAnchorsTheyAreCalledBy) {
  if (!test::canonicalFace()) GTEST_SKIP() << test::kNoCanonicalFace;
  test::SkinnedHead head = defaultHeadOn({"plain", "head", "jaw", "eye.R", "eye.L"});
  std::map<std::string, Eigen::Vector3d> set;
  for (const AnchorToPick& anchor : suggestedAnchors()) {
    // Off the usual places, so that nothing else can have found them.
    const Eigen::Vector3d place =
        0.001 * *placeOf(test::defaultFace().anchors, std::string(anchor.name), test::defaultFace().mesh, "") +
        Eigen::Vector3d(0.0031, 0, 0);
    set[std::string(anchor.name)] = place;
    std::string name(anchor.name);
    std::transform(name.begin(), name.end(), name.begin(), [](char c) { return std::tolower(c); });
    head.nodes.push_back({set.size() % 2 == 0 ? name : std::string(anchor.name) + ".001", place, kHead, false});
  }
  const Found found = foundOn(head);
  EXPECT_NE(found.said.find("by nodes named so"), std::string::npos) << found.said;
  ASSERT_EQ(found.places.size(), set.size());
  for (const auto& [name, place] : set) EXPECT_LT((found.places.at(name) - place).norm(), 1e-5) << name;
}

TEST(FaceBones, TellWhatStandsAtThem) {
  if (!test::canonicalFace()) GTEST_SKIP() << test::kNoCanonicalFace;
  test::SkinnedHead head = defaultHeadOn({"metahuman", "head", "FACIAL_C_Jaw", "FACIAL_R_Eye", "FACIAL_L_Eye"});
  const std::map<std::string, std::string> anchor_of{{"FACIAL_R_LipCorner", "LIP_CORNER_R"},
                                                     {"FACIAL_L_LipCorner", "LIP_CORNER_L"},
                                                     {"FACIAL_C_LipUpper", "LIP_UP_MID"},
                                                     {"FACIAL_C_LipLower", "LIP_LO_MID"},
                                                     {"FACIAL_L_EyeCornerOuter", "CANTHUS_OUT_L"}};
  for (const auto& [bone, anchor] : anchor_of) {
    // A bone stands under the skin.
    const Eigen::Vector3d place = 0.001 * *placeOf(test::defaultFace().anchors, anchor, test::defaultFace().mesh, "") -
                                  Eigen::Vector3d(0, 0, 0.001);
    head.nodes.push_back({bone, place, kHead, true});
  }
  const Found found = foundOn(head);
  EXPECT_NE(found.said.find("by bones of the face"), std::string::npos) << found.said;
  for (const auto& [bone, anchor] : anchor_of) EXPECT_LT(offTheDefault(found, anchor), 0.002) << bone;
  EXPECT_TRUE(found.places.contains("CHIN_LOW")) << "by the jaw's bone";
}

}  // namespace
}  // namespace mouthpiece
