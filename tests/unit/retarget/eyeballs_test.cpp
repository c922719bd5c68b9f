#include "retarget/rig/eyeballs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>

#include "base/index.h"
#include "motion/arkit_shapes.h"
#include "retarget/rig/face_file.h"
#include "retarget/rig/face_rig.h"

namespace mouthpiece {
namespace {

/// A round patch of a sphere about `middle`, from its front to `widest` radians off it, as a part of its own.
void addCap(FaceMesh& mesh, const Eigen::Vector3f& middle, float radius, double from, double widest, PartKind kind) {
  constexpr std::uint32_t kRings = 8, kSegments = 16;
  const auto first = static_cast<std::uint32_t>(mesh.vertices.rows());
  MeshPart part;
  part.name = "part" + std::to_string(mesh.parts.size());
  part.kind = kind;
  part.first_triangle = mesh.triangles.size();
  mesh.vertices.conservativeResize(first + (kRings + 1) * kSegments, 3);
  for (std::uint32_t r = 0; r <= kRings; ++r) {
    const double off = from + (widest - from) * (r + 0.01) / kRings;
    for (std::uint32_t s = 0; s < kSegments; ++s) {
      const double round = 2 * std::numbers::pi * s / kSegments;
      const Eigen::Vector3d way(std::sin(off) * std::cos(round), std::sin(off) * std::sin(round), std::cos(off));
      mesh.vertices.row(first + r * kSegments + s) = middle + radius * way.cast<float>();
      if (r == kRings) continue;
      const std::uint32_t a = first + r * kSegments + s, b = first + r * kSegments + (s + 1) % kSegments;
      mesh.triangles.push_back({a, a + kSegments, b});
      mesh.triangles.push_back({b, a + kSegments, b + kSegments});
    }
  }
  part.triangle_count = mesh.triangles.size() - part.first_triangle;
  mesh.parts.push_back(part);
}

TEST(Eyeballs, BallsAndWhatLiesOnThemTurnLidsAndTearLinesDoNot) {
  FaceMesh mesh;
  const Eigen::Vector3f left(30, 40, -5), right(-30, 40, -5);
  addCap(mesh, left, 12, 0, 2.6, PartKind::kEye);       // 0..143: a ball
  addCap(mesh, left, 12.3F, 0, 0.4, PartKind::kEye);    // its cornea
  addCap(mesh, left, 12.2F, 0.9, 1.1, PartKind::kEye);  // its tear line
  addCap(mesh, right, 12, 0, 1.5, PartKind::kEye);      // half a ball
  addCap(mesh, right, 13, 0.3, 1.2, PartKind::kSkin);   // a lid
  constexpr std::uint32_t kEach = 9 * 16;
  const Eyeballs eyes(mesh);
  std::vector<std::uint32_t> expected;
  for (std::uint32_t v = 0; v < 4 * kEach; ++v) {
    if (v < 2 * kEach || v >= 3 * kEach) expected.push_back(v);
  }
  ASSERT_EQ(eyes.vertices(), expected);

  std::vector<float> places(3 * expected.size());
  eyes.places(mesh, {}, places);
  for (std::size_t i = 0; i < expected.size(); ++i)
    EXPECT_LT((Eigen::Vector3f::Map(&places[3 * i]) - mesh.vertices.row(expected[i]).transpose()).norm(), 1e-4F);
  eyes.places(mesh, {.yaw = 0.3F, .pitch = 0.2F}, places);
  // What looked straight ahead looks to the subject's left and up; nothing leaves the ball.
  EXPECT_NEAR(places[0] - left.x(), 12 * std::sin(0.3) * std::cos(0.2), 0.1);
  EXPECT_NEAR(places[1] - left.y(), 12 * std::sin(0.2), 0.1);
  for (std::size_t i = 0; i < kEach; ++i) EXPECT_NEAR((Eigen::Vector3f::Map(&places[3 * i]) - left).norm(), 12, 0.05);
}

TEST(Eyeballs, AreNoneWherePaintedOrFlat) {
  FaceMesh mesh;
  addCap(mesh, {0, 0, 0}, 12, 0, 0.5, PartKind::kEye);  // a shallow bowl
  addCap(mesh, {40, 0, 0}, 12, 0, 2.5, PartKind::kSkin);
  EXPECT_TRUE(Eyeballs(mesh).vertices().empty());
  EXPECT_TRUE(Eyeballs(FaceMesh()).vertices().empty());
}

TEST(Lids, FollowTheEyesUpAndDownAndNeverMeetByIt) {
  const std::filesystem::path path = std::filesystem::path(MOUTHPIECE_BUILD_SHARE_DIR) / "default.face";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "no default face in " << path << ": run `make data`";
  const FaceFile file = readFaceFile(path);
  const FaceRig rig = FaceRig::load(path);
  const auto row = [&](const char* name) {
    return std::find(file.marker_names.begin(), file.marker_names.end(), name) - file.marker_names.begin();
  };
  const Eigen::Index upper = row("LID_UP_L"), lower = row("LID_LO_L");
  ASSERT_LT(std::max(upper, lower), std::ssize(file.marker_names));
  // Ahead, down, up, aside, and down with lids that are nearly closed.
  MotionClip motion{60, file.marker_names, PositionMatrix(5, file.actor_neutral_mm.size())};
  const Eigen::Map<const Eigen::RowVectorXd> neutral(file.actor_neutral_mm.data(), file.actor_neutral_mm.size());
  motion.positions_mm = neutral.replicate(5, 1);
  const Eigen::RowVector3d open = file.actor_neutral_mm.row(upper) - file.actor_neutral_mm.row(lower);
  motion.positions_mm.block<1, 3>(4, 3 * upper) -= 0.95 * open;
  const std::vector<GazeTurn> gaze{{}, {0, -kWholeLook}, {0, kWholeLook}, {kWholeLook, 0}, {0, -kWholeLook}};
  const PositionMatrix still = rig.retarget(motion).markers(),
                       looks = rig.retarget(motion, nullptr, {}, gaze).markers();
  const auto height = [](const PositionMatrix& at, Eigen::Index frame, Eigen::Index marker) {
    return at(frame, 3 * marker + 1);
  };
  const double opening = height(still, 0, upper) - height(still, 0, lower);
  const auto rises = [&](Eigen::Index frame, Eigen::Index marker) {
    return (height(looks, frame, marker) - height(still, frame, marker)) / opening;
  };
  EXPECT_EQ(rises(0, upper), 0);
  EXPECT_LT(rises(1, upper), -0.5);
  EXPECT_LT(rises(1, lower), -0.1);
  EXPECT_GT(rises(2, upper), 0.25);
  EXPECT_EQ(rises(3, upper), 0);
  EXPECT_GT(rises(4, upper), -0.1) << "lids that are closed stay";
  for (Eigen::Index frame = 0; frame < 5; ++frame) EXPECT_GT(height(looks, frame, upper), height(looks, frame, lower));
  // Nothing but lids.
  for (Eigen::Index marker = 0; marker < std::ssize(file.marker_names); ++marker) {
    const bool is_lid = file.marker_names[unsignedIndex(marker)].starts_with("LID_");
    EXPECT_TRUE(is_lid || rises(1, marker) == 0) << file.marker_names[unsignedIndex(marker)];
  }
}

}  // namespace
}  // namespace mouthpiece
