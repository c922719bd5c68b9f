// The face that comes with Mouthpiece.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <map>
#include <set>

#include "base/errors.h"
#include "deform/mesh/face_mesh.h"
#include "motion/marker_layout.h"
#include "retarget/sample_head/head_model.h"
#include "test_face.h"

namespace mouthpiece {
namespace {

using test::canonicalFace;
using test::defaultFace;

class DefaultFaceTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!canonicalFace()) GTEST_SKIP() << test::kNoCanonicalFace;
  }
  static Eigen::Vector3d vertex(std::uint32_t v) {
    return defaultFace().mesh.vertices.row(v).cast<double>().transpose();
  }
};

TEST_F(DefaultFaceTest, HasAboutFiftyThousandTriangles) {
  EXPECT_GT(defaultFace().mesh.triangles.size(), 40'000U);
  EXPECT_LT(defaultFace().mesh.triangles.size(), 60'000U);
}

TEST_F(DefaultFaceTest, TheLipsMeetAtRest) {
  constexpr double kMeetMm = 1e-3;
  for (std::size_t i = 0; i < kInnerUpperLip.size(); ++i) {
    EXPECT_LT((vertex(kInnerUpperLip[i]) - vertex(kInnerLowerLip[i])).norm(), kMeetMm) << kInnerUpperLip[i];
  }
  // So does every vertex between them: the mouth's line is doubled all the way.
  std::map<std::array<float, 3>, int> at;
  const auto& mesh = defaultFace().mesh;
  for (Eigen::Index v = 0; v < mesh.vertices.rows(); ++v)
    ++at[{mesh.vertices(v, 0), mesh.vertices(v, 1), mesh.vertices(v, 2)}];
  std::size_t doubled = 0;
  for (const auto& [place, count] : at) doubled += count == 2 ? 1 : 0;
  EXPECT_GE(doubled, 35U);  // nine pairs and what subdivision put between them
}

TEST_F(DefaultFaceTest, TheLipsAreApart) {
  // No way along the mesh's triangles of the lips leads straight from one lip's middle to the other's: they share no
  // vertex.
  std::set<std::uint32_t> above, below;
  for (const auto& triangle : defaultFace().mesh.triangles) {
    for (const std::uint32_t v : triangle) {
      if (v == 13) above.insert(triangle.begin(), triangle.end());
      if (v == 14) below.insert(triangle.begin(), triangle.end());
    }
  }
  for (const std::uint32_t v : above) EXPECT_FALSE(below.contains(v)) << v;
}

TEST_F(DefaultFaceTest, NoTriangleIsDegenerate) {
  const auto& mesh = defaultFace().mesh;
  for (const auto& [a, b, c] : mesh.triangles) {
    ASSERT_TRUE(a != b && b != c && c != a);
    const double doubled_area = (vertex(b) - vertex(a)).cross(vertex(c) - vertex(a)).norm();
    EXPECT_GT(doubled_area, 1e-6) << a << " " << b << " " << c;
  }
}

TEST_F(DefaultFaceTest, EveryPartIsThere) {
  std::set<PartKind> kinds;
  for (const MeshPart& part : defaultFace().mesh.parts) {
    kinds.insert(part.kind);
    EXPECT_GT(part.triangle_count, 0U) << part.name;
  }
  for (const PartKind kind : {PartKind::kSkin, PartKind::kLips, PartKind::kUpperTeeth, PartKind::kLowerTeeth,
                              PartKind::kTongue, PartKind::kMouthInside, PartKind::kEye, PartKind::kHair}) {
    EXPECT_TRUE(kinds.contains(kind)) << nameOf(kind);
  }
  EXPECT_EQ(defaultFace().mesh.vertex_colors.size(), static_cast<std::size_t>(defaultFace().mesh.vertices.rows()));
}

TEST_F(DefaultFaceTest, MarkersLieNearTheCanonicalFacesPoints) {
  // Landmarks stay vertices. Around mouth and eyes they were moved on purpose; elsewhere smoothing moves them little.
  constexpr double kSmoothingMm = 2.0;
  const FaceMesh canonical = readFaceMesh(*canonicalFace());
  for (const LayoutMarker& marker : defaultLayout().markers) {
    if (marker.region == "lip" || marker.region == "lid") continue;
    const auto id = static_cast<std::uint32_t>(marker.mediapipe_landmark);
    const Eigen::Vector3d before = 10.0 * canonical.vertices.row(id).cast<double>().transpose();
    EXPECT_LT((vertex(id) - before).norm(), kSmoothingMm) << marker.name;
  }
}

TEST_F(DefaultFaceTest, LeftMirrorsRight) {
  constexpr double kMirrorMm = 0.05;
  for (const LayoutMarker& marker : defaultLayout().markers) {
    const auto id = static_cast<std::uint32_t>(marker.mediapipe_landmark);
    const auto other = static_cast<std::uint32_t>(defaultLayout().markers[marker.mirror.value].mediapipe_landmark);
    EXPECT_LT((vertex(id).cwiseProduct(Eigen::Vector3d(-1, 1, 1)) - vertex(other)).norm(), kMirrorMm) << marker.name;
  }
}

TEST_F(DefaultFaceTest, TheSameInputGivesTheSameBytes) {
  const DefaultFace again = makeDefaultFace(readFaceMesh(*canonicalFace()), "canonical");
  EXPECT_EQ(objBytes(again.mesh), objBytes(defaultFace().mesh));
}

TEST_F(DefaultFaceTest, AnotherMeshIsRefused) {
  FaceMesh other = readFaceMesh(*canonicalFace());
  other.triangles.pop_back();
  EXPECT_THROW(makeDefaultFace(other, "other.obj"), InputError);
}

TEST_F(DefaultFaceTest, FitsWithoutAFault) {
  FaceMesh mesh;
  const FaceFile face = test::fittedDefaultFace(mesh);
  const FaceCheck check = checkFace(face, mesh);
  for (const std::string& fault : faultsOf(check)) ADD_FAILURE() << fault;
  EXPECT_LT(check.landmark_max_mm, 1e-6);
  EXPECT_LT(check.marker_to_surface_max_mm, 0.5);
  EXPECT_EQ(check.fold_overs, 0U);
  EXPECT_EQ(check.binding.lip_side_errors, 0U);
  EXPECT_GT(check.binding.coverage, 0.95);
  EXPECT_LT(check.patch_edge_angle_max_deg, 0.01);
}

}  // namespace
}  // namespace mouthpiece
