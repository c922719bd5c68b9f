#include "motion/time_warp.h"

#include <gtest/gtest.h>

#include <algorithm>
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

constexpr Seconds kRounding = 1e-9;

/// `count` rising times from `start` on, 1 to 500 ms apart.
std::vector<Seconds> risingTimes(std::mt19937& random, Seconds start, std::size_t count) {
  std::uniform_real_distribution<double> step(0.001, 0.5);
  std::vector<Seconds> times{start};
  while (times.size() < count) times.push_back(times.back() + step(random));
  return times;
}

TimeWarp warpBetween(const std::vector<Seconds>& source, const std::vector<Seconds>& target) {
  std::vector<TimeKnot> knots;
  for (std::size_t i = 0; i < source.size(); ++i) knots.push_back({source[i], target[i]});
  return TimeWarp(knots);
}

/// Times within, at and beyond the knots.
std::vector<Seconds> probesOf(const TimeWarp& warp) {
  std::vector<Seconds> probes;
  const Seconds first = warp.knots().front().source - 1, last = warp.knots().back().source + 1;
  for (int i = 0; i <= 200; ++i) probes.push_back(first + (last - first) * i / 200);
  for (const TimeKnot& knot : warp.knots()) probes.push_back(knot.source);
  return probes;
}

TEST(TimeWarpLaws, TheIdentityMovesNoTime) {
  std::mt19937 random(6);
  for (int trial = 0; trial < 20; ++trial) {
    const std::vector<Seconds> times = risingTimes(random, -1, 1 + random() % 12);
    const TimeWarp warp = warpBetween(times, times);
    for (const Seconds time : probesOf(warp)) {
      EXPECT_NEAR(warp.targetFromSource(time), time, kRounding);
      EXPECT_NEAR(warp.sourceFromTarget(time), time, kRounding);
    }
  }
}

/// The second warp's knots, seen from the first's source, and the first's own: between them both are straight.
TEST(TimeWarpLaws, TwoWarpsInARowAreOne) {
  std::mt19937 random(7);
  for (int trial = 0; trial < 50; ++trial) {
    const std::size_t count = 2 + random() % 10;
    const TimeWarp first = warpBetween(risingTimes(random, 0, count), risingTimes(random, 3, count));
    const TimeWarp second = warpBetween(risingTimes(random, 3.1, count), risingTimes(random, -2, count));
    std::vector<Seconds> bends;
    for (const TimeKnot& knot : first.knots()) bends.push_back(knot.source);
    for (const TimeKnot& knot : second.knots()) bends.push_back(first.sourceFromTarget(knot.source));
    std::sort(bends.begin(), bends.end());
    bends.erase(std::unique(bends.begin(), bends.end(), [](Seconds a, Seconds b) { return b - a < kRounding; }),
                bends.end());
    std::vector<Seconds> ends;
    for (const Seconds bend : bends) ends.push_back(second.targetFromSource(first.targetFromSource(bend)));
    const TimeWarp both = warpBetween(bends, ends);
    for (const Seconds time : probesOf(both)) {
      EXPECT_NEAR(both.targetFromSource(time), second.targetFromSource(first.targetFromSource(time)), 1e-7)
          << "trial " << trial;
    }
  }
}

TEST(TimeWarpLaws, TheInverseSwapsTheColumns) {
  std::mt19937 random(8);
  for (int trial = 0; trial < 20; ++trial) {
    const std::vector<Seconds> source = risingTimes(random, 0, 8), target = risingTimes(random, -4, 8);
    const TimeWarp warp = warpBetween(source, target), inverse = warpBetween(target, source);
    for (const Seconds time : probesOf(warp)) EXPECT_EQ(warp.targetFromSource(time), inverse.sourceFromTarget(time));
  }
}

TEST(TimeWarpLaws, IsAsFastAsItsKnotsSay) {
  std::mt19937 random(9);
  for (int trial = 0; trial < 20; ++trial) {
    const TimeWarp warp = warpBetween(risingTimes(random, 0, 9), risingTimes(random, 1, 9));
    double slowest = 1, fastest = 1;  // beyond the knots time runs on as captured
    for (std::size_t i = 1; i < warp.knots().size(); ++i) {
      const TimeKnot &a = warp.knots()[i - 1], &b = warp.knots()[i];
      slowest = std::min(slowest, (b.target - a.target) / (b.source - a.source));
      fastest = std::max(fastest, (b.target - a.target) / (b.source - a.source));
    }
    std::vector<Seconds> probes = probesOf(warp);
    std::sort(probes.begin(), probes.end());
    for (std::size_t i = 1; i < probes.size(); ++i) {
      const Seconds step = probes[i] - probes[i - 1];
      const Seconds moved = warp.targetFromSource(probes[i]) - warp.targetFromSource(probes[i - 1]);
      EXPECT_GE(moved, slowest * step - kRounding);
      EXPECT_LE(moved, fastest * step + kRounding);
    }
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
