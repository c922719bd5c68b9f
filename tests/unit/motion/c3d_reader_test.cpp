#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>

#include "base/errors.h"
#include "c3d_by_hand.h"
#include "motion/formats/c3d_file.h"
#include "motion/marker_layout.h"
#include "synthetic_motion.h"

namespace mouthpiece {
namespace {

MotionClip readByHand(const C3dByHand& file) { return readC3dBytes(file.bytes(), "by_hand.c3d"); }

void expectTheTwoPoints(const MotionClip& clip, double tolerance_mm, double mm_per_unit = 1.0) {
  ASSERT_EQ(clip.frameCount(), 3U);
  ASSERT_EQ(clip.marker_names, (std::vector<std::string>{"A", "B"}));
  EXPECT_EQ(clip.frame_rate_hz, 50.0);
  for (std::size_t frame = 0; frame < 3; ++frame) {
    const Eigen::Vector3d a(1.5 + static_cast<double>(frame), -2.25, 300.0);
    const Eigen::Vector3d b(-0.5 + static_cast<double>(frame), 40.0, 7.0);
    EXPECT_LT((clip.position(FrameIndex(frame), MarkerIndex(0)) - mm_per_unit * a).norm(), tolerance_mm);
    EXPECT_LT((clip.position(FrameIndex(frame), MarkerIndex(1)) - mm_per_unit * b).norm(), tolerance_mm);
  }
}

class C3dProcessors : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(IntelDecMips, C3dProcessors, testing::Values(84, 85, 86));

TEST_P(C3dProcessors, ReadsFloatPoints) {
  C3dByHand file;
  file.processor = GetParam();
  expectTheTwoPoints(readByHand(file), 1e-6);
}

TEST_P(C3dProcessors, ReadsIntegerPoints) {
  C3dByHand file;
  file.processor = GetParam();
  file.is_float = false;
  file.scale = 0.01F;
  expectTheTwoPoints(readByHand(file), 0.02);
}

TEST_P(C3dProcessors, SkipsAnalogValues) {
  for (const bool is_float : {true, false}) {
    C3dByHand file;
    file.processor = GetParam();
    file.is_float = is_float;
    file.scale = is_float ? -0.1F : 0.25F;
    file.analog_values_per_frame = 24;
    expectTheTwoPoints(readByHand(file), is_float ? 1e-6 : 1e-6);
  }
}

TEST_P(C3dProcessors, ANegativeResidualIsNotSeen) {
  for (const bool is_float : {true, false}) {
    C3dByHand file;
    file.processor = GetParam();
    file.is_float = is_float;
    file.scale = is_float ? -0.1F : 0.25F;
    file.points[1] = {0, 0, 0, -1};
    const MotionClip clip = readByHand(file);
    EXPECT_TRUE(clip.isSeen(FrameIndex(1), MarkerIndex(0)));
    EXPECT_TRUE(clip.positions_mm.middleCols(3, 3).array().isNaN().all());
  }
}

TEST(C3dReader, ConvertsUnits) {
  C3dByHand file;
  file.units = "m";
  expectTheTwoPoints(readByHand(file), 1e-3, 1000.0);
  file.units = "cm ";
  expectTheTwoPoints(readByHand(file), 1e-4, 10.0);
  file.units = "furlong";
  EXPECT_THROW(readByHand(file), InputError);
}

TEST(C3dReader, TakesParametersInAnyOrder) {
  C3dByHand file;
  file.groups_last = true;
  expectTheTwoPoints(readByHand(file), 1e-6);
  file.with_frames = false;
  file.first_frame = 101;
  file.last_frame = 103;
  expectTheTwoPoints(readByHand(file), 1e-6);
}

TEST(C3dReader, JoinsLabelParameters) {
  C3dByHand file;
  file.labels.clear();
  file.points.clear();
  for (int i = 0; i < 600; ++i) {
    file.labels.emplace_back("P").append(std::to_string(i));
    file.points.push_back({1.0 * i, 2.0, 3.0, 0.0});
  }
  const MotionClip clip = readByHand(file);
  ASSERT_EQ(clip.markerCount(), 600U);
  EXPECT_EQ(clip.marker_names[254], "P254");
  EXPECT_EQ(clip.marker_names[255], "P255");
  EXPECT_EQ(clip.marker_names[599], "P599");
  EXPECT_EQ(clip.position(FrameIndex(2), MarkerIndex(599)).x(), 601.0);
}

TEST(C3dReader, GivesEachPointANameOfItsOwn) {
  C3dByHand file;
  file.labels = {"A", "A", "", "unlabelled_3"};
  file.points.assign(5, {1.0, 2.0, 3.0, 0.0});
  const MotionClip clip = readByHand(file);
  EXPECT_EQ(clip.marker_names[0], "A");
  EXPECT_EQ(clip.marker_names[1], "unlabelled_2");
  EXPECT_EQ(std::set<std::string>(clip.marker_names.begin(), clip.marker_names.end()).size(), 5U);
}

TEST(C3dReader, CountsFramesBeyond65535) {
  C3dByHand file;
  file.points.resize(1);
  file.labels.resize(1);
  file.is_float = false;
  file.scale = 0.25F;
  file.frames_in_data = 70000;
  file.last_frame = 65535;
  file.trial_start = 1;
  file.trial_end = 70000;
  EXPECT_EQ(readByHand(file).frameCount(), 70000U);
  // Some writers let the 16 bits wrap instead.
  file.last_frame = 70000 - 65536;
  EXPECT_EQ(readByHand(file).frameCount(), 70000U);
}

TEST(C3dReader, AStaleTrialRangeDoesNotCount) {
  C3dByHand file;
  file.trial_start = 1;
  file.trial_end = 90000;
  expectTheTwoPoints(readByHand(file), 1e-6);
  file.trial_start = 101;
  file.trial_end = 250;
  expectTheTwoPoints(readByHand(file), 1e-6);
}

TEST(C3dReader, ReadsEveryRealTake) {
  const std::vector<MotionClip> takes = realTakes(1000);
  if (takes.empty()) GTEST_SKIP() << "no real capture at " << realTakesFolder();
  EXPECT_EQ(takes.size(), 296U);
  for (const MotionClip& take : takes) {
    EXPECT_EQ(take.frameCount(), 75U);
    EXPECT_EQ(take.frame_rate_hz, 25.0);
    EXPECT_EQ(take.marker_names, defaultLayout().markerNames());
    // The capture's README: outer eye corners 90 mm apart in the median.
    const auto right = take.findMarker("CANTHUS_OUT_R");
    const auto left = take.findMarker("CANTHUS_OUT_L");
    ASSERT_TRUE(right && left);
    EXPECT_NEAR((take.position(FrameIndex(40), *right) - take.position(FrameIndex(40), *left)).norm(), 90.0, 10.0);
  }
}

}  // namespace
}  // namespace mouthpiece
