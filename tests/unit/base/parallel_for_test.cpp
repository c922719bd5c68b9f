#include "base/parallel_for.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <stdexcept>
#include <string>
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

TEST(ParallelFor, OffersAtLeastOneThread) { EXPECT_GE(defaultThreadCount(), 1U); }

}  // namespace
}  // namespace mouthpiece
