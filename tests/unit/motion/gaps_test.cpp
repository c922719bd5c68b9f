#include "motion/cleaning/repairs.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "motion/cleaning/rigid.h"
#include "motion/marker_layout.h"
#include "synthetic_motion.h"

namespace mouthpiece {
namespace {

constexpr double kNotSeen = std::numeric_limits<double>::quiet_NaN();
constexpr double kShortGapToleranceMm = 0.3;  // gaps of 100 ms
constexpr double kLongGapToleranceMm = 1.0;   // gaps of 250 to 300 ms

void cut(MotionClip& clip, std::size_t marker, std::size_t first, std::size_t count) {
  clip.positions_mm
      .block(static_cast<Eigen::Index>(first), static_cast<Eigen::Index>(3 * marker), static_cast<Eigen::Index>(count),
             3)
      .setConstant(kNotSeen);
}

/// Markers that move together, as on a face: mixtures of a few movements, with noise.
MotionClip faceLikeClip(double noise_mm, MotionClip* truth = nullptr) {
  const MotionClip movements = SyntheticMotion(51, 2, 12.0).clip(120.0, 480);
  std::mt19937 random(52);
  std::normal_distribution<double> normal(0.0, 1.0);
  MotionClip clip{120.0, {}, PositionMatrix::Zero(480, 60)};
  for (Eigen::Index column = 0; column < 60; ++column) {
    for (Eigen::Index k = 0; k < 6; ++k)
      clip.positions_mm.col(column) += 0.4 * normal(random) * movements.positions_mm.col(k);
  }
  clip.marker_names.assign(20, "M");
  if (truth != nullptr) *truth = clip;
  for (double& value : clip.positions_mm.reshaped()) value += noise_mm * normal(random);
  return clip;
}

TEST(FindGaps, ListsEveryRun) {
  MotionClip clip = SyntheticMotion(1, 3).clip(100.0, 20);
  cut(clip, 0, 0, 2);
  cut(clip, 0, 19, 1);
  cut(clip, 2, 0, 20);
  const std::vector<Gap> gaps = findGaps(clip);
  ASSERT_EQ(gaps.size(), 3U);
  EXPECT_EQ(gaps[0].last.value, 2U);
  EXPECT_EQ(gaps[1].first.value, 19U);
  EXPECT_EQ(gaps[1].last.value, 20U);
  EXPECT_EQ(gaps[2].marker.value, 2U);
  EXPECT_EQ(gaps[2].last.value, 20U);
}

TEST(FillShortGaps, FillsTheShortAndLeavesTheLong) {
  MotionClip clip = faceLikeClip(0.1);
  cut(clip, 3, 100, 12);
  cut(clip, 5, 200, 37);   // 308 ms
  cut(clip, 7, 0, 6);      // nothing before
  cut(clip, 9, 475, 5);    // nothing behind
  cut(clip, 11, 300, 36);  // 300 ms
  const FilledMotion result = fillShortGaps(clip);
  ASSERT_EQ(result.report.filled.size(), 2U);
  EXPECT_EQ(result.report.filled[0].marker.value, 3U);
  EXPECT_EQ(result.report.filled[1].marker.value, 11U);
  EXPECT_EQ(result.report.left.size(), 3U);
  EXPECT_TRUE(result.clip.positions_mm.middleCols<3>(9).allFinite());
  EXPECT_FALSE(result.clip.isSeen(FrameIndex(215), MarkerIndex(5)));
  for (Eigen::Index i = 0; i < clip.positions_mm.size(); ++i) {
    const double before = clip.positions_mm.data()[i];
    if (std::isnan(before)) continue;
    ASSERT_EQ(result.clip.positions_mm.data()[i], before) << "a seen sample was touched";
  }
}

/// Gaps of `frames` at 120 Hz, as few at a time as on a face: the filled samples' distance from the truth, rms.
double gapErrorMm(std::size_t frames) {
  MotionClip truth;
  MotionClip clip = faceLikeClip(0.1, &truth);
  std::mt19937 random(53);
  for (int i = 0; i < 30; ++i) cut(clip, random() % 20, 10 + random() % (460 - frames), frames);
  const FilledMotion result = fillShortGaps(clip);
  double squared = 0;
  double count = 0;
  for (const Gap& gap : result.report.filled) {
    for (std::size_t frame = gap.first.value; frame < gap.last.value; ++frame) {
      squared += (result.clip.position(FrameIndex(frame), gap.marker) - truth.position(FrameIndex(frame), gap.marker))
                     .squaredNorm();
      ++count;
    }
  }
  EXPECT_GT(count, 200.0);
  return std::sqrt(squared / count);
}

TEST(FillShortGaps, IsRightToAThirdOfAMillimetre) { EXPECT_LT(gapErrorMm(12), kShortGapToleranceMm); }

TEST(FillShortGaps, IsRightToAMillimetreOverThreeTenthsOfASecond) { EXPECT_LT(gapErrorMm(30), kLongGapToleranceMm); }

/// Head motion taken off by the layout's stable markers, frame by frame.
MotionClip laidOnFirstFrame(const MotionClip& clip) {
  const auto stableOnly = [&](std::size_t frame) {
    MarkerPositions pose = clip.pose(FrameIndex(frame));
    for (std::size_t i = 0; i < defaultLayout().markers.size(); ++i) {
      if (!defaultLayout().markers[i].stable) pose.row(static_cast<Eigen::Index>(i)).setConstant(std::nan(""));
    }
    return pose;
  };
  MotionClip still = clip;
  for (std::size_t frame = 0; frame < clip.frameCount(); ++frame) {
    const auto motion = fitRigidMotion(stableOnly(frame), stableOnly(0));
    for (std::size_t marker = 0; marker < clip.markerCount(); ++marker) {
      auto sample =
          still.positions_mm.block<1, 3>(static_cast<Eigen::Index>(frame), static_cast<Eigen::Index>(3 * marker));
      sample.setConstant(std::nan(""));
      if (motion) sample = motion->apply(clip.position(FrameIndex(frame), MarkerIndex(marker))).transpose();
    }
  }
  return still;
}

TEST(FillShortGaps, FillsTheRealSpeakersGaps) {
  const std::vector<MotionClip> takes = realTakes(30);
  if (takes.empty()) GTEST_SKIP() << "no real capture at " << realTakesFolder();
  std::mt19937 random(54);
  double squared = 0;
  double count = 0;
  for (const MotionClip& take : takes) {
    const MotionClip still = laidOnFirstFrame(take);
    if (!still.positions_mm.allFinite()) continue;
    MotionClip clip = still;
    const std::size_t first = 5 + random() % 60;
    const std::size_t marker = random() % 66;
    cut(clip, marker, first, 3);  // 120 ms
    const FilledMotion result = fillShortGaps(clip);
    for (std::size_t frame = first; frame < first + 3; ++frame) {
      squared += (result.clip.position(FrameIndex(frame), MarkerIndex(marker)) -
                  still.position(FrameIndex(frame), MarkerIndex(marker)))
                     .squaredNorm();
      ++count;
    }
  }
  EXPECT_LT(std::sqrt(squared / count), kShortGapToleranceMm);
}

TEST(FillShortGaps, WorksWithoutOtherMarkers) {
  MotionClip clip = SyntheticMotion(55, 1).clip(120.0, 240);
  const PositionMatrix truth = clip.positions_mm;
  cut(clip, 0, 100, 6);
  const FilledMotion result = fillShortGaps(clip);
  EXPECT_LT((result.clip.positions_mm - truth).cwiseAbs().maxCoeff(), 0.1);
}

TEST(FillShortGaps, TakesAClipWithoutAnything) {
  MotionClip clip = SyntheticMotion(56, 2).clip(120.0, 10);
  clip.positions_mm.setConstant(kNotSeen);
  EXPECT_EQ(fillShortGaps(clip).report.left.size(), 2U);
  clip.positions_mm.resize(0, 6);
  EXPECT_TRUE(fillShortGaps(clip).report.left.empty());
}

TEST(EstimateNoise, FindsTheNoiseUnderTheMovement) {
  for (const double noise_mm : {0.05, 0.1, 0.3}) {
    EXPECT_NEAR(estimateNoise(faceLikeClip(noise_mm)), noise_mm, 0.1 * noise_mm);
  }
  EXPECT_EQ(estimateNoise(SyntheticMotion(1, 1).clip(25.0, 3)), 0.0);
}

}  // namespace
}  // namespace mouthpiece
