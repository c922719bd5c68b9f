#include "motion/cleaning/repairs.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "motion/marker_layout.h"
#include "motion/formats/motion_file.h"
#include "synthetic_motion.h"

namespace mouthpiece {
namespace {

/// Ten markers, 15 mm apart, that move smoothly by some millimetres.
MotionClip quietClip() {
  MotionClip clip = SyntheticMotion(71, 10).clip(120.0, 360);
  for (Eigen::Index marker = 0; marker < 10; ++marker) {
    clip.positions_mm.col(3 * marker).array() += 15.0 * static_cast<double>(marker);
  }
  return clip;
}

void exchange(MotionClip& clip, Eigen::Index a, Eigen::Index b, Eigen::Index first, Eigen::Index count) {
  const PositionMatrix kept = clip.positions_mm.block(first, 3 * a, count, 3);
  clip.positions_mm.block(first, 3 * a, count, 3) = clip.positions_mm.block(first, 3 * b, count, 3).eval();
  clip.positions_mm.block(first, 3 * b, count, 3) = kept;
}

TEST(RepairSwaps, GivesExchangedMarkersTheirNamesBack) {
  const MotionClip truth = quietClip();
  MotionClip clip = truth;
  exchange(clip, 2, 3, 100, 40);
  exchange(clip, 6, 8, 200, 160);  // to the end
  const RepairedSwaps repaired = repairSwaps(clip);
  EXPECT_EQ(repaired.clip.positions_mm, truth.positions_mm);
  ASSERT_EQ(repaired.swaps.size(), 3U);
  EXPECT_EQ(repaired.swaps[0].frame.value, 100U);
  EXPECT_EQ(repaired.swaps[0].first.value, 2U);
  EXPECT_EQ(repaired.swaps[1].frame.value, 140U);
  EXPECT_EQ(repaired.swaps[2].second.value, 8U);
}

TEST(RepairSwaps, SeesASwapAcrossAGap) {
  const MotionClip truth = quietClip();
  MotionClip clip = truth;
  exchange(clip, 4, 5, 120, 240);
  clip.positions_mm.block(114, 12, 6, 6).setConstant(std::nan(""));
  const RepairedSwaps repaired = repairSwaps(clip);
  ASSERT_EQ(repaired.swaps.size(), 1U);
  EXPECT_EQ(repaired.clip.positions_mm.bottomRows(240), truth.positions_mm.bottomRows(240));
}

TEST(HideSpikes, HidesAnExcursionAndNothingElse) {
  MotionClip clip = quietClip();
  clip.positions_mm(50, 3) += 8.0;
  clip.positions_mm.block(150, 9, 4, 1).array() += 25.0;
  const HiddenSpikes hidden = hideSpikes(clip);
  ASSERT_EQ(hidden.spikes.size(), 2U);
  EXPECT_EQ(hidden.spikes[0].marker.value, 1U);
  EXPECT_EQ(hidden.spikes[0].first.value, 50U);
  EXPECT_NEAR(hidden.spikes[0].distance_mm, 8.0, 0.5);
  EXPECT_EQ(hidden.spikes[1].first.value, 150U);
  EXPECT_EQ(hidden.spikes[1].last.value, 154U);
  EXPECT_EQ((hidden.clip.positions_mm.array().isNaN()).count(), 3 * 5);
}

TEST(Outliers, LeaveTheRealSpeakerAlone) {
  const std::vector<MotionClip> takes = realTakes(60);
  if (takes.empty()) GTEST_SKIP() << "no real capture at " << realTakesFolder();
  for (const MotionClip& take : takes) {
    EXPECT_TRUE(repairSwaps(take).swaps.empty());
    EXPECT_TRUE(hideSpikes(take).spikes.empty());
  }
}

}  // namespace
}  // namespace mouthpiece
