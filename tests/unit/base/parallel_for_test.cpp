#include "base/parallel_for.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <mutex>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace mouthpiece {
namespace {

TEST(ParallelFor, CallsEachIndexOnce) {
  for (const std::size_t threads : {0U, 1U, 2U, 7U, 64U}) {
    std::vector<std::atomic<int>> calls(1000);
    parallelFor(calls.size(), threads, [&](std::size_t i) { ++calls[i]; });
    for (const auto& count : calls) ASSERT_EQ(count, 1) << threads << " threads";
  }
  parallelFor(0, 4, [](std::size_t) { FAIL() << "nothing to do"; });
}

TEST(ParallelFor, GivesTheSameResultForAnyThreadCount) {
  const auto run = [](std::size_t threads) {
    std::vector<double> result(500);
    parallelFor(result.size(), threads, [&](std::size_t i) { result[i] = std::sin(static_cast<double>(i)) / 3.0; });
    return result;
  };
  EXPECT_EQ(run(1), run(3));
  EXPECT_EQ(run(1), run(16));
}

TEST(ParallelFor, RethrowsTheFailureOfTheLowestIndex) {
  for (int repeat = 0; repeat < 50; ++repeat) {
    try {
      parallelFor(200, 8, [](std::size_t i) {
        if (i >= 20) throw std::runtime_error(std::to_string(i));
      });
      FAIL() << "swallowed the failures";
    } catch (const std::runtime_error& error) {
      ASSERT_STREQ(error.what(), "20");
    }
  }
}

TEST(ParallelFor, StaysOnItsThreadWithinABodyThatIsOneOfSeveral) {
  std::vector<std::set<std::thread::id>> within(4), alone(1);
  const auto threadsOf = [](std::set<std::thread::id>& seen) {
    std::mutex mutex;
    parallelFor(50, 4, [&](std::size_t) {
      std::this_thread::sleep_for(std::chrono::microseconds(200));
      const std::scoped_lock lock(mutex);
      seen.insert(std::this_thread::get_id());
    });
  };
  parallelFor(within.size(), 2, [&](std::size_t i) { threadsOf(within[i]); });
  for (const auto& threads : within) EXPECT_EQ(threads.size(), 1U);
  parallelFor(1, 4, [&](std::size_t i) { threadsOf(alone[i]); });
  EXPECT_GT(alone[0].size(), 1U) << "a body that has all cores to itself may use them";
}

TEST(ParallelFor, OffersAtLeastOneThread) { EXPECT_GE(defaultThreadCount(), 1U); }

}  // namespace
}  // namespace mouthpiece
