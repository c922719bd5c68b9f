// Resampling of warped motion: windows against one dense system, at the sizes of issue 2 (1,000 samples, 66 markers).
#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "motion/formats/motion_csv.h"
#include "motion/resample.h"

namespace mouthpiece {
namespace {

constexpr Eigen::Index kChannels = 198;

/// 120 Hz samples whose spacing swells and shrinks as a warp makes it.
std::vector<Seconds> sampleTimes(std::size_t count) {
  std::vector<Seconds> times{0.0};
  while (times.size() < count) {
    times.push_back(times.back() + (1.0 + 0.5 * std::sin(0.2 * static_cast<double>(times.size()))) / 120.0);
  }
  return times;
}

PositionMatrix motionAt(const std::vector<Seconds>& times) {
  PositionMatrix values(static_cast<Eigen::Index>(times.size()), kChannels);
  for (Eigen::Index row = 0; row < values.rows(); ++row) {
    for (Eigen::Index column = 0; column < kChannels; ++column) {
      values(row, column) = 5.0 * std::sin(20.0 * times[static_cast<std::size_t>(row)] + static_cast<double>(column));
    }
  }
  return values;
}

std::vector<Seconds> sixtyFramesPerSecond(const std::vector<Seconds>& times) {
  return frameTimes(0, static_cast<std::size_t>(times.back() * 60.0), 60.0);
}

double secondsOf(const auto& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

void resampleWindowedAgainstDense(benchmark::State& state) {
  const std::vector<Seconds> times = sampleTimes(static_cast<std::size_t>(state.range(0)));
  const std::vector<Seconds> queries = sixtyFramesPerSecond(times);
  const PositionMatrix values = motionAt(times);
  for (auto _ : state) benchmark::DoNotOptimize(MotionResampler(times, queries).apply(values));

  PositionMatrix windowed;
  PositionMatrix dense;
  double windowed_s = 1e9;
  double dense_s = 1e9;
  for (int repeat = 0; repeat < 3; ++repeat) {
    windowed_s = std::min(windowed_s, secondsOf([&] { windowed = MotionResampler(times, queries).apply(values); }));
    dense_s = std::min(dense_s, secondsOf([&] { dense = resampleDense(times, values, queries); }));
  }
  state.counters["dense_ms"] = 1e3 * dense_s;
  state.counters["times_faster"] = dense_s / windowed_s;
  state.counters["largest_difference_mm"] = (windowed - dense).cwiseAbs().maxCoeff();
}
BENCHMARK(resampleWindowedAgainstDense)->Arg(1000)->Unit(benchmark::kMillisecond);

/// A line of 3 s at 60 frames a second out of 120 Hz capture, with the warp.
void resampleThreeSecondLine(benchmark::State& state) {
  MotionClip clip{120.0, std::vector<std::string>(66, "M"), motionAt(frameTimes(0, 480, 120.0))};
  const TimeWarp warp({{0.5, 0.0}, {0.9, 0.5}, {1.4, 0.9}, {2.2, 1.9}, {3.5, 3.0}});
  const std::vector<Seconds> queries = frameTimes(0, 180, 60.0);
  for (auto _ : state) benchmark::DoNotOptimize(resampleWarped(clip, warp, queries));
}
BENCHMARK(resampleThreeSecondLine)->Unit(benchmark::kMillisecond);

void writeThreeSecondCsv(benchmark::State& state) {
  const MotionClip clip{60.0, std::vector<std::string>(66, "MARKER"), motionAt(frameTimes(0, 180, 60.0))};
  for (auto _ : state) benchmark::DoNotOptimize(writeMotionCsvText(clip));
}
BENCHMARK(writeThreeSecondCsv)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace mouthpiece
