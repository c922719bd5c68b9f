#include "motion/cleaning/repairs.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <random>

#include "base/index.h"
#include "motion/formats/motion_file.h"
#include "motion/marker_layout.h"
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

/// A sample that is off by what the greatest acceleration explains is movement, a little more is a spike.
TEST(HideSpikes, TheGreatestAccelerationIsTheLimit) {
  for (const double rate : {60.0, 120.0, 250.0}) {
    const SpikeOptions options{.acceleration_mm_s2 = 30000, .allowance_mm = 0.7};
    const double reachable = 0.7 + 0.5 * 30000 / (rate * rate);
    for (const double beyond : {0.99, 1.01}) {
      MotionClip clip{rate, {"M"}, PositionMatrix::Zero(60, 3)};
      clip.positions_mm.col(0).setLinSpaced(60, 0, 40);  // on its way
      clip.positions_mm(30, 1) = beyond * reachable;
      const HiddenSpikes hidden = hideSpikes(clip, options);
      ASSERT_EQ(hidden.spikes.size(), beyond > 1 ? 1U : 0U) << rate << " Hz";
      if (hidden.spikes.empty()) continue;
      EXPECT_EQ(hidden.spikes[0].first.value, 30U);
      EXPECT_EQ(hidden.spikes[0].last.value, 31U);
      EXPECT_NEAR(hidden.spikes[0].distance_mm, beyond * reachable, 1e-9);
    }
  }
}

/// What never accelerates harder is never hidden, however fast it goes.
TEST(HideSpikes, LeavesWhatSkinCanDo) {
  constexpr double kHardest = 30000;
  for (unsigned seed = 1; seed <= 40; ++seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> any(0, 1);
    const double rate = 60 + 200 * any(random);
    MotionClip clip{rate, {"M"}, PositionMatrix::Zero(200, 3)};
    // Sines of random speed that together use up all of it.
    std::array<double, 4> shares{any(random), any(random), any(random), any(random)};
    const double sum = shares[0] + shares[1] + shares[2] + shares[3];
    for (const double share : shares) {
      const double omega = 6.2832 * (1 + 0.45 * rate * any(random)), phase = 6.2832 * any(random);
      for (Eigen::Index frame = 0; frame < 200; ++frame)
        clip.positions_mm(frame, 1) +=
            share / sum * kHardest / (omega * omega) * std::sin(omega * asReal(frame) / rate + phase);
    }
    EXPECT_TRUE(hideSpikes(clip, {.acceleration_mm_s2 = kHardest, .allowance_mm = 0}).spikes.empty())
        << "seed " << seed;
    clip.positions_mm *= 30;
    EXPECT_FALSE(hideSpikes(clip, {.acceleration_mm_s2 = kHardest, .allowance_mm = 0}).spikes.empty())
        << "seed " << seed;
  }
}

/// Spikes at all places but the ends, where there is no way around them; what is not seen further away does not matter.
TEST(HideSpikes, AreFoundAllAlongAClip) {
  for (std::size_t at = 1; at < 19; ++at) {
    MotionClip clip{120, {"A", "B"}, PositionMatrix::Zero(20, 6)};
    clip.positions_mm(signedIndex(at), 5) = 50;
    if (at > 3) clip.positions_mm.row(signedIndex(at) - 3).setConstant(std::nan(""));
    if (at < 17) clip.positions_mm.row(signedIndex(at) + 2).setConstant(std::nan(""));
    const HiddenSpikes hidden = hideSpikes(clip);
    ASSERT_EQ(hidden.spikes.size(), 1U) << at;
    EXPECT_EQ(hidden.spikes[0].marker.value, 1U);
    EXPECT_EQ(hidden.spikes[0].first.value, at);
    EXPECT_TRUE(hidden.clip.positions_mm.row(signedIndex(at)).tail<3>().array().isNaN().all());
    EXPECT_EQ(hidden.clip.positions_mm.row(signedIndex(at)).head<3>().norm(), 0);
  }
}

/// What is wild where a stretch of seen frames begins or ends is hidden, its good neighbours are not.
TEST(HideSpikes, BesideUnseenFramesAndTheEndsTakeNoNeighbourAlong) {
  for (unsigned seed = 1; seed <= 200; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    MotionClip clip = quietClip();
    const Eigen::Index marker = signedIndex(3 * (random() % 10)), length = signedIndex(1 + random() % 3),
                       gap = signedIndex(1 + random() % 60);
    const Eigen::Index from = signedIndex(40 + random() % 200);
    clip.positions_mm.block(from, marker, gap, 3).setConstant(std::nan(""));
    const std::array<Eigen::Index, 4> places{from - length, from + gap, 0, clip.positions_mm.rows() - length};
    const Eigen::Index wild = places[seed % 4];
    PositionMatrix expected = clip.positions_mm;
    expected.block(wild, marker, length, 3).setConstant(std::nan(""));
    clip.positions_mm.block(wild, marker, length, 3).rowwise() += Eigen::RowVector3d(40, -20, 30);
    const HiddenSpikes hidden = hideSpikes(clip);
    ASSERT_EQ(hidden.spikes.size(), 1U);
    EXPECT_EQ(hidden.spikes[0].first.row(), wild);
    EXPECT_EQ(hidden.spikes[0].last.row(), wild + length);
    EXPECT_NEAR(hidden.spikes[0].distance_mm, Eigen::RowVector3d(40, -20, 30).norm(), 5);
    EXPECT_EQ(hidden.clip.positions_mm.array().isNaN().count(), expected.array().isNaN().count());
    EXPECT_TRUE((hidden.clip.positions_mm.array().isNaN() == expected.array().isNaN()).all());
  }
}

/// How fast a marker goes does not matter, only how evenly.
TEST(HideSpikes, AtAnEdgeFollowWhatGoesFast) {
  for (const double off : {0.0, 25.0}) {
    for (const Eigen::Index at : {Eigen::Index{0}, Eigen::Index{39}}) {
      MotionClip clip{120, {"M"}, PositionMatrix::Zero(40, 3)};
      clip.positions_mm.col(0).setLinSpaced(40, 0, 39 * 9.0);
      clip.positions_mm(at, 2) += off;
      const HiddenSpikes hidden = hideSpikes(clip);
      ASSERT_EQ(hidden.spikes.size(), off > 0 ? 1U : 0U) << at;
      if (off > 0) {
        EXPECT_EQ(hidden.spikes[0].first.row(), at);
        EXPECT_NEAR(hidden.spikes[0].distance_mm, off, 1e-9);
      }
    }
  }
}

/// A spike one frame within the edge is that frame, not the good sample at the edge.
TEST(HideSpikes, BeforeTheLastSeenFrameLeaveThatFrame) {
  for (Eigen::Index length = 1; length <= 4; ++length) {
    for (const bool at_start : {false, true}) {
      MotionClip clip = quietClip();
      clip.positions_mm.block(200, 0, 30, 3).setConstant(std::nan(""));
      const Eigen::Index first = at_start ? 231 : 199 - length;
      clip.positions_mm.block(first, 1, length, 1).array() += 30;
      const HiddenSpikes hidden = hideSpikes(clip);
      ASSERT_EQ(hidden.spikes.size(), 1U) << length << at_start;
      EXPECT_EQ(hidden.spikes[0].first.row(), first);
      EXPECT_EQ(hidden.spikes[0].last.row(), first + length);
    }
  }
}

/// At an edge, too, what lasts as long as a spike may is one.
TEST(HideSpikes, AtAnEdgeLastAsLongAsSpikesMay) {
  const SpikeOptions options;
  const auto longest = static_cast<Eigen::Index>(std::floor(options.longest * 120));
  MotionClip clip{120, {"M"}, PositionMatrix::Zero(60, 3)};
  clip.positions_mm.bottomRows(longest).col(1).array() += 400;
  const HiddenSpikes hidden = hideSpikes(clip, options);
  ASSERT_EQ(hidden.spikes.size(), 1U);
  EXPECT_EQ(hidden.spikes[0].first.row(), 60 - longest);
  EXPECT_EQ(hidden.spikes[0].last.row(), 60);
}

/// Markers that were not seen for as long as may be are compared with where they were, no longer.
TEST(RepairSwaps, AcrossTheLongestGapAndNoLongerOne) {
  const SwapOptions options;
  const auto longest = static_cast<Eigen::Index>(std::lround(options.longest_gap * 120));
  for (const Eigen::Index unseen : {longest, longest + 1}) {
    MotionClip clip{120, {"A", "B"}, PositionMatrix::Zero(80, 6)};
    clip.positions_mm.middleCols(3, 3).array() += 30;
    clip.positions_mm.middleRows(20, unseen).setConstant(std::nan(""));
    const Eigen::Index rest = 60 - unseen;
    clip.positions_mm.bottomRows(rest).leftCols(3).setConstant(30);
    clip.positions_mm.bottomRows(rest).rightCols(3).setZero();
    EXPECT_EQ(repairSwaps(clip, options).swaps.size(), unseen == longest ? 1U : 0U);
  }
}

/// Of exchanges that are possible the one that shortens the steps most is made, however small the others' steps are.
TEST(RepairSwaps, TheClearestExchangeIsMade) {
  MotionClip truth{120, {"A", "B", "C", "D"}, PositionMatrix::Zero(40, 12)};
  for (Eigen::Index marker = 0; marker < 4; ++marker)
    truth.positions_mm.col(3 * marker).setConstant(20.0 * asReal(marker * marker));
  MotionClip clip = truth;
  exchange(clip, 0, 3, 10, 30);
  exchange(clip, 1, 2, 20, 20);
  const RepairedSwaps repaired = repairSwaps(clip);
  EXPECT_EQ(repaired.clip.positions_mm, truth.positions_mm);
  ASSERT_EQ(repaired.swaps.size(), 2U);
  EXPECT_EQ(repaired.swaps[0].first.value, 0U);
  EXPECT_EQ(repaired.swaps[0].second.value, 3U);
  EXPECT_EQ(repaired.swaps[1].frame.value, 20U);
  // Less than half of the steps saved, or less than 4 mm: no exchange.
  MotionClip near{120, {"A", "B"}, PositionMatrix::Zero(4, 6)};
  near.positions_mm.col(3).setConstant(1.9);
  exchange(near, 0, 1, 2, 2);
  EXPECT_TRUE(repairSwaps(near).swaps.empty()) << "3.8 mm saved";
  near.positions_mm *= 1.1;
  EXPECT_EQ(repairSwaps(near).swaps.size(), 1U) << "4.2 mm saved";
  near.positions_mm.bottomRows(2).col(1).setConstant(3);  // both also went 3 mm up
  near.positions_mm.bottomRows(2).col(4).setConstant(3);
  EXPECT_TRUE(repairSwaps(near).swaps.empty()) << "steps of 3.7 mm that would still be 3";
}

}  // namespace
}  // namespace mouthpiece
