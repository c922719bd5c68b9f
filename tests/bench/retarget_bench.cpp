// Three seconds of 66 markers at 60 fps carried from the actor to the head (EDGE 6), all frames at once against marker
// by marker.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <random>

#include "retarget/warp/rbf_warp.h"

namespace {

using mouthpiece::MarkerPositions;
using mouthpiece::PositionMatrix;
using mouthpiece::RbfWarp;

constexpr Eigen::Index kMarkers = 66;
constexpr Eigen::Index kFrames = 180;

struct Setup {
  MarkerPositions actor{kMarkers, 3};
  PositionMatrix frames{kFrames, 3 * kMarkers};
  RbfWarp warp = fitted();

  RbfWarp fitted() {
    std::mt19937 random(1);
    std::uniform_real_distribution<double> place(-80, 80);
    std::normal_distribution<double> step(0, 2);
    for (Eigen::Index i = 0; i < actor.size(); ++i) actor.data()[i] = place(random);
    MarkerPositions target = 1.1 * actor;
    for (Eigen::Index i = 0; i < target.size(); ++i) target.data()[i] += step(random);
    for (Eigen::Index f = 0; f < kFrames; ++f) {
      for (Eigen::Index i = 0; i < actor.size(); ++i) frames(f, i) = actor.data()[i] + step(random);
    }
    return RbfWarp::fit(actor, target, {.shape_factor = 2});
  }
};

void markerByMarker(const Setup& setup) {
  for (Eigen::Index f = 0; f < kFrames; ++f) {
    for (Eigen::Index m = 0; m < kMarkers; ++m) {
      benchmark::DoNotOptimize(setup.warp.targetFromActor(setup.frames.block<1, 3>(f, 3 * m)));
    }
  }
}

/// Fastest of a few runs, seconds.
template <typename Work>
double fastest(const Work& work) {
  double best = 1e30;
  for (int i = 0; i < 10; ++i) {
    const auto start = std::chrono::steady_clock::now();
    work();
    best = std::min(best, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
  return best;
}

void retargetAllFrames(benchmark::State& state) {
  const Setup setup;
  const auto at_once = [&] { benchmark::DoNotOptimize(setup.warp.targetFromActorRelative(setup.frames, setup.actor)); };
  for (auto _ : state) at_once();
  state.counters["times_faster"] = fastest([&] { markerByMarker(setup); }) / fastest(at_once);
}
BENCHMARK(retargetAllFrames)->Unit(benchmark::kMillisecond);

void fitWarp(benchmark::State& state) {
  const Setup setup;
  const MarkerPositions target = setup.warp.targetFromActor(setup.actor);
  for (auto _ : state) benchmark::DoNotOptimize(RbfWarp::fit(setup.actor, target, {.shape_factor = 2}));
}
BENCHMARK(fitWarp)->Unit(benchmark::kMillisecond);

void fitWarpAndChooseShape(benchmark::State& state) {
  const Setup setup;
  const MarkerPositions target = setup.warp.targetFromActor(setup.actor);
  for (auto _ : state) benchmark::DoNotOptimize(RbfWarp::fit(setup.actor, target, {}));
}
BENCHMARK(fitWarpAndChooseShape)->Unit(benchmark::kMillisecond);

}  // namespace
