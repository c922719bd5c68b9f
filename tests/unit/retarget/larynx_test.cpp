#include "retarget/rig/face_rig.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "deform/mesh/face_mesh.h"
#include "retarget/rig/face_rig.h"

namespace mouthpiece {
namespace {

constexpr double kFaceWidth = 90;
const Eigen::Vector3d kChin(0, 0, 100);

/// A grid of skin from y = `top` down to `bottom`, a round neck in front of which the chin lies 60 mm further.
FaceMesh neck(double top, double bottom) {
  constexpr int kNeckColumns = 21;
  const int rows = static_cast<int>((top - bottom) / 5) + 1;
  FaceMesh mesh;
  mesh.vertices.resize(rows * kNeckColumns, 3);
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < kNeckColumns; ++column) {
      const double x = 5.0 * (column - kNeckColumns / 2);
      mesh.vertices.row(row * kNeckColumns + column) << static_cast<float>(x), static_cast<float>(top - 5 * row),
          static_cast<float>(std::sqrt(60. * 60. - x * x) - 20);
      if (row == 0 || column == 0) continue;
      const auto at = static_cast<std::uint32_t>(row * kNeckColumns + column);
      const auto above = at - kNeckColumns;
      mesh.triangles.push_back({above - 1, at - 1, at});
      mesh.triangles.push_back({above - 1, at, above});
    }
  }
  mesh.parts = {{.name = "skin", .triangle_count = mesh.triangles.size()}};
  return mesh;
}

TEST(LarynxBump, GoesUpTheFrontOfTheNeck) {
  const FaceMesh mesh = neck(-10, -120);
  const LarynxBump larynx(mesh, kChin, kFaceWidth);
  ASSERT_GT(larynx.vertices().size(), 20U);
  EXPECT_TRUE(std::is_sorted(larynx.vertices().begin(), larynx.vertices().end()));
  std::vector<float> added(3 * larynx.vertices().size());
  larynx.displacements(0, added);
  EXPECT_TRUE(std::all_of(added.begin(), added.end(), [](float value) { return value == 0; })) << "rest is rest";
  larynx.displacements(1, added);
  double highest = 0, forward = 0, back = 0;
  for (std::size_t i = 0; i < larynx.vertices().size(); ++i) {
    highest = std::max<double>(highest, added[3 * i + 1]);
    const double above = mesh.vertices(larynx.vertices()[i], 1) + 0.5 * kFaceWidth;
    if (above > 15) forward = std::max<double>(forward, added[3 * i + 2]);
    if (above < -5) back = std::min<double>(back, added[3 * i + 2]);
  }
  EXPECT_NEAR(highest, kLarynxTravel * kFaceWidth, 0.2) << "mm";
  EXPECT_GT(forward, 0.3) << "it stands out where it has come to";
  EXPECT_LT(back, -0.3) << "and no longer where it was";
}

TEST(LarynxBump, HalfTheHeightIsHalfTheWay) {
  const LarynxBump larynx(neck(-10, -120), kChin, kFaceWidth);
  std::vector<float> half(3 * larynx.vertices().size()), whole = half;
  larynx.displacements(0.5, half);
  larynx.displacements(1, whole);
  for (std::size_t i = 1; i < half.size(); i += 3) EXPECT_NEAR(half[i], 0.5F * whole[i], 1e-5);
}

TEST(LarynxBump, AFaceWithoutANeckHasNone) {
  EXPECT_TRUE(LarynxBump(neck(-2, -10), kChin, kFaceWidth).vertices().empty());
  EXPECT_TRUE(LarynxBump(neck(80, 20), kChin, kFaceWidth).vertices().empty());
  FaceMesh hair = neck(-10, -120);
  hair.parts[0].kind = PartKind::kHair;
  EXPECT_TRUE(LarynxBump(hair, kChin, kFaceWidth).vertices().empty());
}

TEST(LarynxBump, TheDefaultFaceRaisesItsLarynxAndNothingElse) {
  const std::filesystem::path file = std::filesystem::path(MOUTHPIECE_BUILD_SHARE_DIR) / "default.face";
  if (!std::filesystem::exists(file)) GTEST_SKIP() << "no default face in " << file << ": run `make data`";
  const FaceRig rig = FaceRig::load(file);
  // All markers at zero are as good as any others, moved alike in both animations.
  const FaceMotion motion(PositionMatrix::Zero(2, 3 * static_cast<Eigen::Index>(rig.markerNames().size())));
  const std::vector<TonguePose> tongues(2);
  const std::vector<double> heights = {0, 1}, lowered = {0, 0};
  const FaceAnimation still = rig.movingFrames(motion, tongues, 60).all();
  const FaceAnimation raised = rig.movingFrames(motion, tongues, 60, heights).all();
  EXPECT_EQ(rig.movingFrames(motion, tongues, 60, lowered).vertices, still.vertices);
  std::size_t moved = 0;
  float highest = 0;
  for (std::size_t i = 0; i < raised.vertices.size(); ++i) {
    const auto found = std::lower_bound(still.vertices.begin(), still.vertices.end(), raised.vertices[i]);
    const bool was_there = found != still.vertices.end() && *found == raised.vertices[i];
    for (Eigen::Index frame = 0; frame < 2; ++frame) {
      const Eigen::RowVector3f now = raised.positions.row(frame).segment<3>(3 * static_cast<Eigen::Index>(i));
      const Eigen::RowVector3f before =
          was_there ? Eigen::RowVector3f(still.positions.row(frame).segment<3>(3 * (found - still.vertices.begin())))
                    : Eigen::RowVector3f(rig.mesh().vertices.row(raised.vertices[i]));
      if (frame == 0) {
        EXPECT_EQ(now, before) << raised.vertices[i];
      } else if (now != before) {
        ++moved;
        highest = std::max(highest, now.y() - before.y());
        EXPECT_LT(rig.mesh().vertices(raised.vertices[i], 1), -90) << "below the chin";
        EXPECT_LT(std::abs(rig.mesh().vertices(raised.vertices[i], 0)), 40);
      }
    }
  }
  EXPECT_GT(moved, 20U);
  EXPECT_NEAR(highest, 10, 1) << "mm";
}

}  // namespace
}  // namespace mouthpiece
