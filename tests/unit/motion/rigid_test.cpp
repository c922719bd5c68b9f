#include "motion/rigid.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <random>

#include "base/errors.h"
#include "motion/marker_layout.h"
#include "synthetic_motion.h"

namespace mouthpiece {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

MarkerPositions randomPose(unsigned seed, Eigen::Index count) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> place(-80.0, 80.0);
  MarkerPositions pose(count, 3);
  for (double& value : pose.reshaped()) value = place(random);
  return pose;
}

RigidMotion randomMotion(unsigned seed, double degrees = 40.0) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0.0, 1.0);
  const Eigen::Vector3d axis = Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized();
  return {Eigen::AngleAxisd(degrees / 57.3, axis).toRotationMatrix(),
          Eigen::Vector3d(30.0, -200.0, 15.0 * normal(random))};
}

MarkerPositions moved(const MarkerPositions& pose, const RigidMotion& motion) {
  return (pose * motion.rotation.transpose()).rowwise() + motion.translation_mm.transpose();
}

double difference(const RigidMotion& a, const RigidMotion& b) {
  return (a.rotation - b.rotation).norm() + (a.translation_mm - b.translation_mm).norm();
}

TEST(FitRigidMotion, FindsTheMotion) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const MarkerPositions pose = randomPose(seed, 3 + seed % 8);
    const RigidMotion motion = randomMotion(seed, 170.0 * seed / 20.0);
    for (const int rounds : {0, 5}) {
      const auto found = fitRigidMotion(pose, moved(pose, motion), {rounds});
      ASSERT_TRUE(found);
      EXPECT_LT(difference(*found, motion), 1e-8) << "seed " << seed;
      EXPECT_NEAR(found->rotation.determinant(), 1.0, 1e-12);
    }
  }
}

TEST(FitRigidMotion, NeverReflects) {
  const MarkerPositions pose = randomPose(4, 8);
  MarkerPositions mirrored = pose;
  mirrored.col(0) *= -1.0;
  const auto found = fitRigidMotion(pose, mirrored, {0});
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->rotation.determinant(), 1.0, 1e-12);
}

TEST(FitRigidMotion, LeavesOutWhatWasNotSeen) {
  const MarkerPositions pose = randomPose(5, 10);
  const RigidMotion motion = randomMotion(5);
  MarkerPositions source = pose;
  MarkerPositions target = moved(pose, motion);
  source.row(2).setConstant(kNan);
  target.row(7).setConstant(kNan);
  const auto found = fitRigidMotion(source, target);
  ASSERT_TRUE(found);
  EXPECT_LT(difference(*found, motion), 1e-8);
}

TEST(FitRigidMotion, SaysWhenThereIsTooLittle) {
  MarkerPositions pose = randomPose(6, 4);
  EXPECT_FALSE(fitRigidMotion(pose.topRows(2), pose.topRows(2)));
  pose.topRows(2).setConstant(kNan);
  EXPECT_FALSE(fitRigidMotion(pose, pose));
  MarkerPositions line(5, 3);
  for (Eigen::Index i = 0; i < 5; ++i) line.row(i) = static_cast<double>(i) * Eigen::RowVector3d(1.0, 2.0, 3.0);
  EXPECT_FALSE(fitRigidMotion(line, line));
}

TEST(FitRigidMotion, RobustRoundsPassOverAMarkerThatSlipped) {
  const MarkerPositions pose = randomPose(7, 11);
  const RigidMotion motion = randomMotion(7);
  MarkerPositions target = moved(pose, motion);
  target.row(3) += Eigen::RowVector3d(0.0, 12.0, 0.0);
  const auto plain = fitRigidMotion(pose, target, {0});
  const auto robust = fitRigidMotion(pose, target, {5});
  ASSERT_TRUE(plain && robust);
  const Eigen::Vector3d chin(0.0, -100.0, 20.0);
  EXPECT_GT((plain->apply(chin) - motion.apply(chin)).norm(), 1.0);
  EXPECT_LT((robust->apply(chin) - motion.apply(chin)).norm(), 0.05);
}

TEST(RigidMotion, ComposesAndInverts) {
  const RigidMotion a = randomMotion(8);
  const RigidMotion b = randomMotion(9);
  const Eigen::Vector3d p(1.0, 2.0, 3.0);
  EXPECT_LT((b.after(a).apply(p) - b.apply(a.apply(p))).norm(), 1e-10);
  EXPECT_LT((a.inverse().apply(a.apply(p)) - p).norm(), 1e-10);
}

/// A face with a 7-marker jig on a nodding head, with camera noise.
struct NoddingHead {
  static constexpr std::size_t kFaceMarkers = 6;
  MotionClip still, seen;
  std::vector<MarkerIndex> jig;

  explicit NoddingHead(double noise_mm) {
    still = SyntheticMotion(41, kFaceMarkers).clip(120.0, 360);
    const MarkerPositions jig_pose = randomPose(42, 7);
    still.positions_mm.conservativeResize(Eigen::NoChange, 3 * (kFaceMarkers + 7));
    for (std::size_t i = 0; i < 7; ++i) {
      still.marker_names.push_back(defaultLayout().jig_names[i]);
      jig.emplace_back(kFaceMarkers + i);
      const Eigen::RowVector3d place = jig_pose.row(static_cast<Eigen::Index>(i)) + Eigen::RowVector3d(0.0, 180.0, 0.0);
      still.positions_mm.middleCols<3>(static_cast<Eigen::Index>(3 * (kFaceMarkers + i))).rowwise() = place;
    }
    seen = still;
    std::mt19937 random(43);
    std::normal_distribution<double> normal(0.0, noise_mm);
    for (std::size_t frame = 0; frame < still.frameCount(); ++frame) {
      const double t = still.timeOf(FrameIndex(frame));
      const RigidMotion nod{
          Eigen::AngleAxisd(0.15 * std::sin(4.0 * t), Eigen::Vector3d(1.0, 0.3, 0.1).normalized()).toRotationMatrix(),
          Eigen::Vector3d(20.0 * std::sin(2.0 * t), 5.0, 300.0)};
      const MarkerPositions pose = moved(still.pose(FrameIndex(frame)), nod);
      for (Eigen::Index i = 0; i < pose.size(); ++i) {
        seen.positions_mm(static_cast<Eigen::Index>(frame), i) =
            pose.reshaped<Eigen::RowMajor>()[i] + (noise_mm > 0.0 ? normal(random) : 0.0);
      }
    }
  }
  [[nodiscard]] double faceError(const MotionClip& clip) const {
    const auto columns = static_cast<Eigen::Index>(3 * kFaceMarkers);
    const PositionMatrix error = clip.positions_mm.leftCols(columns) - still.positions_mm.leftCols(columns);
    return std::sqrt(error.squaredNorm() / static_cast<double>(error.size() / 3));
  }
};

TEST(RemoveHeadMotion, GivesTheStillFaceBack) {
  const NoddingHead head(0.0);
  const HeadMotion result = removeHeadMotion(head.seen, head.still.pose(FrameIndex(0)), head.jig);
  EXPECT_LT(head.faceError(result.still), 1e-6);
  EXPECT_EQ(result.frames_without_fit, 0U);
  EXPECT_LT(result.fit_rms_mm, 1e-6);
}

TEST(RemoveHeadMotion, SmoothingTakesTheCamerasNoiseOffTheHeadsPath) {
  constexpr double kNoiseMm = 0.2;
  const NoddingHead head(kNoiseMm);
  const MarkerPositions reference = head.still.pose(FrameIndex(0));
  const double each_frame = head.faceError(removeHeadMotion(head.seen, reference, head.jig).still);
  const double smoothed = head.faceError(removeHeadMotion(head.seen, reference, head.jig, {{}, 0.1}).still);
  // What the head's path adds to the face markers' own noise.
  const double own_noise = kNoiseMm * std::sqrt(3.0);
  const auto added = [&](double total) { return std::sqrt(total * total - own_noise * own_noise); };
  EXPECT_LT(added(smoothed), 0.6 * added(each_frame)) << each_frame << " " << smoothed;
}

TEST(RemoveHeadMotion, AFrameWithoutEnoughMarkersIsNan) {
  NoddingHead head(0.0);
  for (std::size_t i = 0; i < 5; ++i) {
    head.seen.positions_mm.block(100, static_cast<Eigen::Index>(3 * (NoddingHead::kFaceMarkers + i)), 10, 3)
        .setConstant(kNan);
  }
  for (const double smoothing_s : {0.0, 0.1}) {
    const HeadMotion result = removeHeadMotion(head.seen, head.still.pose(FrameIndex(0)), head.jig, {{}, smoothing_s});
    EXPECT_EQ(result.frames_without_fit, 10U);
    EXPECT_FALSE(result.reference_from_world[105]);
    EXPECT_TRUE(result.still.positions_mm.row(105).array().isNaN().all());
    EXPECT_TRUE(result.still.positions_mm.row(110).allFinite());
  }
}

TEST(MedianAlignedPose, IsTheStillHead) {
  NoddingHead head(0.0);
  const MarkerPositions reference = medianAlignedPose(head.seen, head.jig);
  const HeadMotion result = removeHeadMotion(head.seen, reference, head.jig);
  EXPECT_LT(result.fit_rms_mm, 1e-6);
  head.seen.positions_mm.setConstant(kNan);
  EXPECT_THROW(medianAlignedPose(head.seen, head.jig), InputError);
}

TEST(MedianPose, PassesOverWhatWasNotSeen) {
  MotionClip clip{25.0, {"A", "B"}, PositionMatrix(4, 6)};
  clip.positions_mm << 1, 0, 0, kNan, kNan, kNan,  //
      2, 0, 0, kNan, kNan, kNan,                   //
      9, 0, 0, kNan, kNan, kNan,                   //
      kNan, kNan, kNan, kNan, kNan, kNan;
  const std::vector<FrameIndex> frames{FrameIndex(0), FrameIndex(1), FrameIndex(2), FrameIndex(3)};
  const MarkerPositions pose = medianPose(clip, frames);
  EXPECT_EQ(pose(0, 0), 2.0);
  EXPECT_TRUE(std::isnan(pose(1, 2)));
  EXPECT_EQ(medianPose(clip, std::span(frames).first(2))(0, 0), 1.5);
}

TEST(RemoveHeadMotion, StillsTheRealSpeaker) {
  const std::vector<MotionClip> takes = realTakes(20);
  if (takes.empty()) GTEST_SKIP() << "no real capture at " << realTakesFolder();
  std::vector<MarkerIndex> stable;
  for (std::size_t i = 0; i < defaultLayout().markers.size(); ++i) {
    if (defaultLayout().markers[i].stable) stable.emplace_back(i);
  }
  double fit_sum_mm = 0;
  for (const MotionClip& take : takes) {
    const HeadMotion result = removeHeadMotion(take, medianAlignedPose(take, stable), stable);
    std::size_t untracked = 0;
    for (Eigen::Index frame = 0; frame < take.positions_mm.rows(); ++frame) {
      if (take.positions_mm.row(frame).array().isNaN().all()) ++untracked;
    }
    EXPECT_EQ(result.frames_without_fit, untracked);
    EXPECT_LT(result.fit_rms_mm, 1.5);
    fit_sum_mm += result.fit_rms_mm;
  }
  // Tracker noise of 0.16 mm and what FaceMesh bends when the head turns: 0.44 mm over all takes.
  EXPECT_LT(fit_sum_mm / static_cast<double>(takes.size()), 0.6);
}

}  // namespace
}  // namespace mouthpiece
