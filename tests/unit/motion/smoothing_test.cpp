#include "motion/cleaning/repairs.h"

#include <gtest/gtest.h>

#include <algorithm>
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

/// The report counts what was done: the root of the mean square over all coordinates that were seen, and no coordinate
/// goes further than it says.
TEST(SmoothMotion, ReportsHowFarItMovedWhatWasSeen) {
  for (const double noise_mm : {0.0, 0.2}) {
    MotionClip clip = withNoise(SyntheticMotion(65, 4).clip(120.0, 200), 0.15);
    clip.positions_mm.block(20, 3, 30, 3).setConstant(std::numeric_limits<double>::quiet_NaN());
    clip.positions_mm(100, 7) += 5;  // no noise: it is not followed so far
    const SmoothedMotion result = smoothMotion(clip, {noise_mm});
    const PositionMatrix change = result.clip.positions_mm - clip.positions_mm;
    double sum = 0, samples = 0;
    for (Eigen::Index i = 0; i < change.size(); ++i) {
      if (std::isnan(change.data()[i])) continue;
      sum += change.data()[i] * change.data()[i];
      samples += 1;
      const auto marker = static_cast<std::size_t>(i % change.cols() / 3);
      EXPECT_LE(std::abs(change.data()[i]), 2.5 * result.marker_noise_mm[marker] + 1e-12);
    }
    EXPECT_EQ(samples, 200 * 12 - 30 * 3);
    EXPECT_NEAR(result.rms_change_mm, std::sqrt(sum / samples), 1e-12);
    EXPECT_GT(std::abs(change(100, 7)), 0.2) << "as far as it may";
    EXPECT_EQ(result.noise_mm == noise_mm, noise_mm > 0);
  }
}

/// It knows no direction of time but at its start, and no place: backwards, mirrored and elsewhere it does the same.
TEST(SmoothMotion, DoesTheSameElsewhereAndMirrored) {
  const MotionClip clip = withNoise(SyntheticMotion(66, 2).clip(120.0, 150), 0.1);
  const PositionMatrix here = smoothMotion(clip, {0.1}).clip.positions_mm;
  MotionClip other = clip;
  other.positions_mm = -clip.positions_mm.array() + 300;
  EXPECT_LT((smoothMotion(other, {0.1}).clip.positions_mm.array() - 300 + here.array()).abs().maxCoeff(), 1e-6);
  MotionClip larger = clip;
  larger.positions_mm *= 10;
  EXPECT_LT((smoothMotion(larger, {1.0}).clip.positions_mm - 10 * here).cwiseAbs().maxCoeff(), 1e-6)
      << "ten times the movement in ten times the noise";
}

/// A marker that moves fast passes some of its motion for noise: none counts as more than twice the median.
TEST(SmoothMotion, NoMarkerIsTwiceAsNoisyAsTheOthers) {
  MotionClip clip = withNoise(SyntheticMotion(67, 5, 0.1).clip(120.0, 300), 0.1);
  for (Eigen::Index frame = 0; frame < 300; ++frame)
    clip.positions_mm.block<1, 3>(frame, 3).array() += frame % 2 == 0 ? 3 : -3;
  std::vector<double> noise = smoothMotion(clip).marker_noise_mm;
  const double shaken = noise[1];
  std::sort(noise.begin(), noise.end());
  EXPECT_NEAR(shaken, 2 * noise[2], 1e-12);
  EXPECT_EQ(shaken, noise.back());
}

}  // namespace
}  // namespace mouthpiece
