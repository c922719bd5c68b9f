#include "base/statistics.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace mouthpiece {
namespace {

std::vector<double> randomValues(unsigned seed, std::size_t count) {
  std::mt19937 random(seed);
  std::uniform_int_distribution<int> digits(-50, 50);  // few values, so that many are alike
  std::vector<double> values;
  for (std::size_t i = 0; i < count; ++i) values.push_back(digits(random) / 4.0);
  return values;
}

TEST(Statistics, TakesTheLaterOfTwoMiddleValues) {
  EXPECT_EQ(median({3, 1, 2}), 2);
  EXPECT_EQ(median({4, 1, 3, 2}), 3);
  EXPECT_EQ(median({7}), 7);
}

TEST(Statistics, InterpolatesAsNumpyDoes) {
  // numpy.quantile([1, 2, 4, 8], [0, 0.25, 0.5, 0.9, 1])
  const std::vector<double> values{8, 1, 4, 2};
  EXPECT_DOUBLE_EQ(interpolatedQuantile(values, 0), 1);
  EXPECT_DOUBLE_EQ(interpolatedQuantile(values, 0.25), 1.75);
  EXPECT_DOUBLE_EQ(interpolatedQuantile(values, 0.5), 3);
  EXPECT_DOUBLE_EQ(interpolatedQuantile(values, 0.9), 6.8);
  EXPECT_DOUBLE_EQ(interpolatedQuantile(values, 1), 8);
}

TEST(Statistics, AnswersForNoValues) {
  EXPECT_TRUE(std::isnan(median({})));
  EXPECT_TRUE(std::isnan(quantile({}, 0.5)));
  EXPECT_EQ(median({}, 5), 5);
  EXPECT_EQ(quantile({}, 0.9, 0), 0);
  EXPECT_EQ(interpolatedQuantile({}, 0.9, -1), -1);
}

TEST(Statistics, AgreesWithSorting) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    SCOPED_TRACE(seed);
    const std::vector<double> values = randomValues(seed, 1 + seed % 9);
    std::vector<double> sorted = values;
    std::sort(sorted.begin(), sorted.end());
    EXPECT_EQ(median(values), sorted[sorted.size() / 2]);
    for (const double share : {0.0, 0.05, 0.3, 0.5, 0.77, 0.95, 1.0}) {
      const auto below = static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1));
      EXPECT_EQ(quantile(values, share), sorted[below]);
      EXPECT_GE(interpolatedQuantile(values, share), sorted[below]);
      EXPECT_LE(interpolatedQuantile(values, share), sorted[std::min(below + 1, sorted.size() - 1)]);
    }
  }
}

TEST(Statistics, QuantilesRiseWithTheirShareAndIgnoreOrder) {
  std::vector<double> values = randomValues(7, 23);
  double before = *std::min_element(values.begin(), values.end());
  for (double share = 0; share <= 1; share += 0.01) {
    const double now = interpolatedQuantile(values, share);
    EXPECT_GE(now, before);
    before = now;
    std::reverse(values.begin(), values.end());
    EXPECT_EQ(interpolatedQuantile(values, share), now);
  }
}

}  // namespace
}  // namespace mouthpiece
