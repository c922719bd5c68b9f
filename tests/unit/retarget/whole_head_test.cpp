// What is no one head is told before it is fitted.
#include "retarget/placing/whole_head.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "deform/mesh/face_mesh.h"
#include "test_face.h"

namespace mouthpiece {
namespace {

class WholeHead : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!test::canonicalFace()) GTEST_SKIP() << test::kNoCanonicalFace;
    mesh_ = readFaceMesh(*test::canonicalFace());
  }
  FaceMesh mesh_;
};

TEST_F(WholeHead, AWholeOneIsTaken) {
  EXPECT_EQ(whyNoWholeHead(mesh_), "");
  EXPECT_EQ(whyNoWholeHead(test::defaultFace().mesh), "");
}

TEST_F(WholeHead, HalfAHeadIsTold) {
  FaceMesh half = mesh_;
  const auto is_other = [&](const Triangle& t) {
    return std::any_of(t.begin(), t.end(), [&](std::uint32_t v) { return half.vertices(v, 0) < -1e-4F; });
  };
  std::erase_if(half.triangles, is_other);
  half.parts.resize(1);
  half.parts[0].triangle_count = half.triangles.size();
  EXPECT_EQ(whyNoWholeHead(half).substr(0, 62), "is half a head: its skin ends in the plane x = 0; apply the mo");
}

/// As a bust does whose arms are cut off.
TEST(WholeHeads, MayEndInPlanesAtBothSides) {
  constexpr std::uint32_t kSide = 11;
  FaceMesh sheet;
  sheet.vertices.resize(kSide * kSide, 3);
  for (std::uint32_t v = 0; v < kSide * kSide; ++v)
    sheet.vertices.row(v) << static_cast<float>(v % kSide), static_cast<float>(v / kSide), 0;
  for (std::uint32_t v = 0; v + kSide + 1 < kSide * kSide; ++v) {
    if (v % kSide + 1 == kSide) continue;
    sheet.triangles.push_back({v, v + 1, v + kSide});
    sheet.triangles.push_back({v + 1, v + kSide + 1, v + kSide});
  }
  sheet.parts = {{.name = "skin", .triangle_count = sheet.triangles.size()}};
  EXPECT_EQ(whyNoWholeHead(sheet), "");
  for (Eigen::Index v = 0; v < sheet.vertices.rows(); ++v) {
    if (sheet.vertices(v, 0) == 10) sheet.vertices(v, 0) += 0.1F * sheet.vertices(v, 1);
  }
  EXPECT_NE(whyNoWholeHead(sheet), "");
}

TEST_F(WholeHead, LevelsOfDetailInOnePlaceAreTold) {
  FaceMesh both = mesh_;
  const auto first = static_cast<std::uint32_t>(mesh_.vertexCount());
  both.vertices.conservativeResize(2 * first, 3);
  both.vertices.bottomRows(first) = 1.001F * mesh_.vertices;
  for (const Triangle& t : mesh_.triangles) both.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  both.parts = {{.name = "LOD0", .triangle_count = mesh_.triangles.size()},
                {.name = "LOD1", .first_triangle = mesh_.triangles.size(), .triangle_count = mesh_.triangles.size()}};
  EXPECT_EQ(whyNoWholeHead(both),
            "has two layers of skin in one place, 'LOD0' and 'LOD1'; expected one level of detail");
  both.vertices.bottomRows(first) *= 1.3F;
  EXPECT_EQ(whyNoWholeHead(both), "");
}

}  // namespace
}  // namespace mouthpiece
