#include "motion/time_warp.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "base/errors.h"

namespace mouthpiece {
namespace {

TEST(TimeWarp, MeetsItsKnots) {
  const std::vector<TimeKnot> knots{{0.1, 1.0}, {0.3, 1.1}, {0.35, 1.7}, {1.0, 2.0}};
  const TimeWarp warp(knots);
  for (const TimeKnot& knot : knots) {
    EXPECT_EQ(warp.targetFromSource(knot.source), knot.target);
    EXPECT_EQ(warp.sourceFromTarget(knot.target), knot.source);
  }
  EXPECT_DOUBLE_EQ(warp.targetFromSource(0.2), 1.05);
}

TEST(TimeWarp, RunsOnAtItsOwnSpeedOutside) {
  const TimeWarp warp({{1.0, 5.0}, {2.0, 5.5}});
  EXPECT_DOUBLE_EQ(warp.targetFromSource(0.25), 4.25);
  EXPECT_DOUBLE_EQ(warp.targetFromSource(3.0), 6.5);
  EXPECT_DOUBLE_EQ(warp.sourceFromTarget(6.5), 3.0);
}

TEST(TimeWarp, OneKnotShifts) {
  const TimeWarp warp({{1.0, 3.0}});
  EXPECT_DOUBLE_EQ(warp.targetFromSource(0.0), 2.0);
  EXPECT_DOUBLE_EQ(warp.targetFromSource(9.0), 11.0);
}

TEST(TimeWarp, InvertsItself) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> step(0.001, 0.5);
  std::vector<TimeKnot> knots{{0.0, 0.0}};
  for (int i = 0; i < 40; ++i) {
    knots.push_back({knots.back().source + step(random), knots.back().target + step(random)});
  }
  const TimeWarp warp(knots);
  Seconds previous = -1.0;
  for (Seconds time = -0.5; time < knots.back().source + 0.5; time += 0.0037) {
    const Seconds target = warp.targetFromSource(time);
    EXPECT_GT(target, previous);
    previous = target;
    EXPECT_NEAR(warp.sourceFromTarget(target), time, 1e-9);
  }
}

TEST(TimeWarp, RefusesKnotsThatDoNotRise) {
  EXPECT_THROW(TimeWarp({}), InputError);
  EXPECT_THROW(TimeWarp({{0, 0}, {1, 0}}), InputError);
  EXPECT_THROW(TimeWarp({{0, 0}, {0, 1}}), InputError);
  EXPECT_THROW(TimeWarp({{0, 0}, {-1, 1}}), InputError);
  EXPECT_THROW(TimeWarp({{0, std::numeric_limits<double>::quiet_NaN()}}), InputError);
  EXPECT_THROW(TimeWarp({{0, 0}, {1, std::numeric_limits<double>::infinity()}}), InputError);
}

}  // namespace
}  // namespace mouthpiece
