#include "motion/cleaning/repairs.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "motion/cleaning/rigid.h"
#include "synthetic_motion.h"

namespace mouthpiece {
namespace {

MotionClip withNoise(MotionClip clip, double noise_mm) {
  std::mt19937 random(61);
  std::normal_distribution<double> normal(0.0, noise_mm);
  for (double& value : clip.positions_mm.reshaped()) value += normal(random);
  return clip;
}

double rmsDifference(const PositionMatrix& a, const PositionMatrix& b) {
  return std::sqrt((a - b).squaredNorm() / static_cast<double>(a.size()));
}

TEST(SmoothMotion, HalvesTheNoise) {
  const MotionClip truth = SyntheticMotion(62, 10, 8.0).clip(120.0, 480);
  for (const double noise_mm : {0.1, 0.3}) {
    const SmoothedMotion result = smoothMotion(withNoise(truth, noise_mm));
    EXPECT_NEAR(result.noise_mm, noise_mm, 0.1 * noise_mm);
    EXPECT_LT(rmsDifference(result.clip.positions_mm, truth.positions_mm), 0.5 * noise_mm);
    EXPECT_LT(result.rms_change_mm, 1.1 * noise_mm);
  }
}

TEST(SmoothMotion, LeavesCleanMotionAsItIs) {
  const MotionClip truth = SyntheticMotion(63, 5, 8.0).clip(120.0, 240);
  EXPECT_LT(rmsDifference(smoothMotion(truth).clip.positions_mm, truth.positions_mm), 0.01);
}

TEST(SmoothMotion, KeepsAQuickClosure) {
  // Lips that close for 60 ms and open again, 10 mm, in 0.1 mm of noise.
  MotionClip truth{120.0, {"LIP_LO_MID"}, PositionMatrix::Zero(240, 3)};
  for (Eigen::Index frame = 0; frame < 240; ++frame) {
    const double t = (static_cast<double>(frame) - 120.0) / 120.0;
    truth.positions_mm(frame, 1) = -10.0 + 10.0 * std::exp(-std::pow(t / 0.03, 2.0));
  }
  const SmoothedMotion result = smoothMotion(withNoise(truth, 0.1), {0.1});
  // Three times the noise: its own part, and what the smoother may take off the tip.
  EXPECT_NEAR(result.clip.positions_mm(120, 1), 0.0, 0.3);
}

TEST(SmoothMotion, DoesNotCarryALipOnWhenItIsStopped) {
  // Slow speech, and once a second a lip that is stopped by the other within a frame and leaves as suddenly.
  MotionClip truth{120.0, {"LIP_LO_MID"}, PositionMatrix::Zero(1200, 3)};
  for (Eigen::Index frame = 0; frame < 1200; ++frame) {
    const double t = static_cast<double>(frame % 120 - 60) / 120.0;
    truth.positions_mm(frame, 1) = -std::max(0.0, 6.0 + std::sin(2 * t) - 9.0 * std::exp(-std::pow(t / 0.08, 2.0)));
  }
  constexpr double kNoise = 0.06;
  const SmoothedMotion result = smoothMotion(withNoise(truth, kNoise), {kNoise});
  double beyond = 0;
  for (Eigen::Index closure = 0; closure < 10; ++closure)
    beyond += result.clip.positions_mm.col(1).segment(120 * closure + 40, 40).maxCoeff() / 10;
  EXPECT_LT(beyond, 1.3 * kNoise) << "mm further than where it was stopped";
}

TEST(SmoothMotion, LeavesGapsOpen) {
  MotionClip clip = withNoise(SyntheticMotion(64, 2).clip(120.0, 200), 0.1);
  clip.positions_mm.block(50, 0, 20, 3).setConstant(std::numeric_limits<double>::quiet_NaN());
  clip.positions_mm.middleCols<3>(3).bottomRows(197).setConstant(std::numeric_limits<double>::quiet_NaN());
  const SmoothedMotion result = smoothMotion(clip);
  for (Eigen::Index i = 0; i < clip.positions_mm.size(); ++i) {
    ASSERT_EQ(std::isnan(clip.positions_mm.data()[i]), std::isnan(result.clip.positions_mm.data()[i]));
  }
  EXPECT_EQ(result.clip.positions_mm(1, 3), clip.positions_mm(1, 3)) << "three samples are too few to smooth";
}

TEST(SmoothMotion, MovesTheRealSpeakerByNoMoreThanHisNoise) {
  const std::vector<MotionClip> takes = realTakes(10);
  if (takes.empty()) GTEST_SKIP() << "no real capture at " << realTakesFolder();
  for (const MotionClip& take : takes) {
    const SmoothedMotion result = smoothMotion(take);
    EXPECT_LT(result.rms_change_mm, 1.2 * result.noise_mm);
    EXPECT_LT(result.noise_mm, 0.5);
  }
}

}  // namespace
}  // namespace mouthpiece
