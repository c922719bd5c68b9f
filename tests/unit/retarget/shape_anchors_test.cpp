// Anchors by a head's own shapes, and what the clicked ones tell of a mesh.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <utility>

#include "base/errors.h"
#include "base/files.h"
#include "base/index.h"
#include "deform/mesh/mesh_files.h"
#include "retarget/placing/anchors.h"
#include "retarget/placing/shape_anchors.h"
#include "support/run_program.h"
#include "test_face.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;
using test::runProgram;
using test::ScratchFolder;

/// Measured: 1.5 to 4.8 mm against what a person placed; a click is off by 2.
constexpr double kWithinMm = 6;

TEST(ShapeAnchors, LieWhereAPersonPutsThem) {
  const fs::path head = test::kSharedFaces / "ict_arkit.glb";
  if (!fs::exists(head)) GTEST_SKIP() << "no heads in " << test::kSharedFaces;
  const ScratchFolder folder;
  const fs::path file = folder.path() / "head.anchors.json";
  const auto result = runProgram("retarget", {"anchors", head.string(), "-o", file.string()});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const FaceMesh mesh = readFaceMesh(head);
  const Anchors found = parseAnchors(readFile(file), file.string());
  const fs::path by_hand = fs::path(MOUTHPIECE_SOURCE_DIR) / "sample_data/anchors/ict_head.anchors.json";
  const Anchors wanted = parseAnchors(readFile(by_hand), by_hand.string());
  EXPECT_EQ(found.markers.size(), 10U);
  for (const auto& [name, place] : found.markers) {
    const auto is = placeOf(found, name, mesh, "found");
    const auto was = placeOf(wanted, name, mesh, "wanted");
    if (!was) continue;
    EXPECT_LT(1000 * (*is - *was).norm(), kWithinMm) << name;
  }
}

/// Ready Player Me's mouthOpen takes the lower lip's middle down and leaves corners and chin: a chin was sought on the
/// lip, and corners where the lip parted no more, a third before they come.
TEST(ShapeAnchors, LieThereToldByALowerLipAlone) {
  const fs::path head = test::kSharedFaces / "ict_arkit.glb";
  if (!fs::exists(head)) GTEST_SKIP() << "no heads in " << test::kSharedFaces;
  const std::string bytes = readFile(head);
  const FaceMesh mesh = parseFaceMesh(bytes, head);
  const FaceShapes shapes = parseFaceShapes(bytes, head);
  const auto jaw = std::find(shapes.names.begin(), shapes.names.end(), "jawOpen") - shapes.names.begin();
  ASSERT_LT(unsignedIndex(jaw), shapes.names.size());
  const fs::path by_hand = fs::path(MOUTHPIECE_SOURCE_DIR) / "sample_data/anchors/ict_head.anchors.json";
  const Anchors wanted = parseAnchors(readFile(by_hand), by_hand.string());
  const auto at = [&](const char* name) { return *placeOf(wanted, name, mesh, "wanted"); };
  const Eigen::Vector3d right = at("LIP_CORNER_R"), left = at("LIP_CORNER_L"), middle = 0.5 * (right + left);
  TellingShapes lip_alone{shapes.moves[unsignedIndex(jaw)], {}, {}};
  for (Eigen::Index v = 0; v < mesh.vertices.rows(); ++v) {
    const Eigen::Vector3d from = mesh.vertices.row(v).transpose().cast<double>() - middle;
    const double across = std::max(0.0, 1 - std::abs(from.x()) / (0.38 * (left - right).norm()));
    const double down = std::clamp(1 + from.y() / (0.5 * (left - right).norm()), 0.0, 1.0);
    lip_alone.jaw_open.row(v) *= static_cast<float>(across * down);
  }
  const auto found = anchorsFromShapes(mesh, lip_alone, "head.glb");
  for (const char* name : {"LIP_CORNER_R", "LIP_CORNER_L", "LIP_UP_MID", "LIP_LO_MID", "CHIN_LOW", "NOSE_TIP"}) {
    ASSERT_TRUE(found.contains(name)) << name;
    const Eigen::Vector3d is = mesh.vertices.row(signedIndex(found.at(name))).transpose().cast<double>();
    EXPECT_LT(1000 * (is - at(name)).norm(), kWithinMm) << name;
  }
}

/// A head's file may have another axis up, and its head lie on its side: the jaw and the lids tell.
TEST(ShapeAnchors, LieInTheSamePlacesHoweverTheHeadIsTurned) {
  const fs::path head = test::kSharedFaces / "ict_arkit.glb";
  if (!fs::exists(head)) GTEST_SKIP() << "no heads in " << test::kSharedFaces;
  const std::string bytes = readFile(head);
  const FaceMesh mesh = parseFaceMesh(bytes, head);
  const FaceShapes shapes = parseFaceShapes(bytes, head);
  const auto named = [&](const char* name) {
    return shapes
        .moves[unsignedIndex(std::find(shapes.names.begin(), shapes.names.end(), name) - shapes.names.begin())];
  };
  const TellingShapes telling{named("jawOpen"), named("eyeBlink_R"), named("eyeBlink_L")};
  const TellingShapes jaw_alone{telling.jaw_open, {}, {}};
  const auto found = anchorsFromShapes(mesh, telling, "head.glb");
  ASSERT_EQ(found.size(), 10U);
  constexpr float kDegree = std::numbers::pi_v<float> / 180;
  const auto turnedBy = [&](float degrees, const Eigen::Vector3f& axis, const TellingShapes& by) {
    const Eigen::Matrix3f turn = Eigen::AngleAxisf(degrees * kDegree, axis.normalized()).toRotationMatrix().transpose();
    FaceMesh turned = mesh;
    TellingShapes moves = by;
    for (VertexPositions* rows : {&turned.vertices, &moves.jaw_open, &moves.blink_right, &moves.blink_left})
      *rows = (*rows * turn).eval();
    return anchorsFromShapes(turned, moves, "head.glb");
  };
  const Eigen::Vector3f x = Eigen::Vector3f::UnitX(), y = Eigen::Vector3f::UnitY(), z = Eigen::Vector3f::UnitZ();
  EXPECT_EQ(turnedBy(90, x, telling), found);
  EXPECT_EQ(turnedBy(180, y, telling), found);
  EXPECT_EQ(turnedBy(-90, z, telling), found);
  EXPECT_EQ(turnedBy(90, z, jaw_alone), anchorsFromShapes(mesh, jaw_alone, "head.glb"));
  for (const auto& [name, vertex] : turnedBy(60, {1, 2, 3}, telling)) {
    const float off = (mesh.vertices.row(vertex) - mesh.vertices.row(found.at(name))).norm();
    EXPECT_LT(1000 * off, kWithinMm) << name << ", lying askew";
  }
}

TEST(ShapeAnchors, AHeadWithoutShapesHasNoneByThem) {
  const fs::path head = test::kSharedFaces / "ict_head.obj";
  if (!fs::exists(head)) GTEST_SKIP() << "no heads in " << test::kSharedFaces;
  const auto result = runProgram("retarget", {"anchors", head.string(), "--by", "shapes"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_NE(result.err.find("retarget pick"), std::string::npos) << result.err;
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
}

std::string complaintOf(const FaceMesh& mesh, const Anchors& anchors) {
  try {
    (void)skinUnderAnchors(mesh, anchors, "anchors.json");
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(SkinUnderAnchors, IsSkinWhateverItIsCalled) {
  if (!test::canonicalFace()) GTEST_SKIP() << test::kNoCanonicalFace;
  FaceMesh mesh = test::defaultFace().mesh;
  const Anchors& anchors = test::defaultFace().anchors;
  EXPECT_EQ(complaintOf(mesh, anchors), "");
  EXPECT_TRUE(skinUnderAnchors(mesh, anchors, "anchors.json").empty());
  for (MeshPart& part : mesh.parts) {
    if (isSkin(part.kind)) part.kind = PartKind::kHair;
  }
  const auto kinds = skinUnderAnchors(mesh, anchors, "anchors.json");
  ASSERT_FALSE(kinds.empty());
  for (const auto& [name, kind] : kinds) EXPECT_EQ(kind, PartKind::kSkin) << name;
}

TEST(SkinUnderAnchors, TellsOfAMeshInsideOutAndOfAnchorsElsewhere) {
  if (!test::canonicalFace()) GTEST_SKIP() << test::kNoCanonicalFace;
  FaceMesh mesh = test::defaultFace().mesh;
  const Anchors& anchors = test::defaultFace().anchors;
  Anchors elsewhere;
  for (const auto& [name, place] : anchors.markers)
    elsewhere.markers[name] = Eigen::Vector3d(*placeOf(anchors, name, mesh, "") + Eigen::Vector3d(0, 1000, 0));
  EXPECT_NE(complaintOf(mesh, elsewhere).find("off the skin, all of them"), std::string::npos);
  for (Triangle& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
  EXPECT_NE(complaintOf(mesh, anchors).find("inside out"), std::string::npos);
}

/// One click in the air was once told as a mesh inside out, swapped sides as markers out of order.
TEST(SkinUnderAnchors, NamesTheClickThatIsWrong) {
  if (!test::canonicalFace()) GTEST_SKIP() << test::kNoCanonicalFace;
  const FaceMesh& mesh = test::defaultFace().mesh;
  const Anchors& right = test::defaultFace().anchors;
  const auto swapped = [&](std::initializer_list<std::pair<const char*, const char*>> pairs) {
    Anchors wrong = right;
    for (const auto& [a, b] : pairs) std::swap(wrong.markers.at(a), wrong.markers.at(b));
    return complaintOf(mesh, wrong);
  };
  const std::pair mouth("LIP_CORNER_R", "LIP_CORNER_L");
  EXPECT_EQ(swapped({mouth}),
            "anchors.json:markers.LIP_CORNER_R: lies left of LIP_CORNER_L; expected R at the head's own right");
  EXPECT_EQ(swapped({mouth, {"CANTHUS_OUT_R", "CANTHUS_OUT_L"}, {"EYE_IN_R", "EYE_IN_L"}}),
            "anchors.json:markers: have right and left the wrong way round; expected R at the head's own right");
  EXPECT_EQ(swapped({{"LIP_UP_MID", "LIP_LO_MID"}}),
            "anchors.json:markers.LIP_UP_MID: lies below LIP_LO_MID; expected the upper lip above the lower one");
  EXPECT_EQ(swapped({{"NOSE_TIP", "CHIN_LOW"}}),
            "anchors.json:markers.NOSE_TIP: lies below the lips, and CHIN_LOW above them; expected the two swapped");
  Anchors air = right;
  const auto at = [&](const char* name) { return *placeOf(right, name, mesh, ""); };
  const Eigen::Vector3d forward = at("NOSE_TIP") - 0.5 * (at("CANTHUS_OUT_R") + at("CANTHUS_OUT_L"));
  air.markers["LIP_CORNER_R"] = Eigen::Vector3d(at("LIP_CORNER_R") + 4 * forward);
  EXPECT_NE(complaintOf(mesh, air).find("anchors.json:markers.LIP_CORNER_R: lies "), std::string::npos)
      << complaintOf(mesh, air);
}

}  // namespace
}  // namespace mouthpiece
