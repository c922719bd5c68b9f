#include "motion/cleaning/rigid.h"

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

/// Markers that slipped, each its own way, among others that tremble: the fit is that of the others.
TEST(FitRigidMotion, RobustRoundsGiveWhatTheOthersSay) {
  for (unsigned seed = 1; seed <= 30; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    std::normal_distribution<double> tremble(0, 0.1);
    std::uniform_real_distribution<double> slip(-25, 25);
    const MarkerPositions pose = randomPose(seed, 14);
    MarkerPositions target = moved(pose, randomMotion(seed));
    for (double& value : target.reshaped()) value += tremble(random);
    for (const Eigen::Index slipped : {1, 5, 9})
      target.row(slipped) += Eigen::RowVector3d(slip(random), slip(random), 5 + std::abs(slip(random)));
    const std::vector<Eigen::Index> steady{0, 2, 3, 4, 6, 7, 8, 10, 11, 12, 13};
    const auto robust = fitRigidMotion(pose, target, {8});
    const auto of_the_others = fitRigidMotion(pose(steady, Eigen::all), target(steady, Eigen::all), {0});
    ASSERT_TRUE(robust && of_the_others);
    for (const Eigen::Index i : steady) {
      const Eigen::Vector3d p = pose.row(i).transpose();
      EXPECT_LT((robust->apply(p) - of_the_others->apply(p)).norm(), 0.15) << "about the trembling";
    }
  }
}

/// Three markers tell no outlier: they are fitted as they are, however many rounds are asked for.
TEST(FitRigidMotion, ThreeMarkersAreAllBelieved) {
  const MarkerPositions pose = randomPose(12, 3);
  MarkerPositions target = moved(pose, randomMotion(12));
  target.row(1) += Eigen::RowVector3d(9, -4, 2);
  const auto plain = fitRigidMotion(pose, target, {0}), robust = fitRigidMotion(pose, target, {9});
  ASSERT_TRUE(plain && robust);
  EXPECT_EQ(difference(*plain, *robust), 0);
}

}  // namespace
}  // namespace mouthpiece
