#include "motion/blend.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace mouthpiece {
namespace {

constexpr BlendKind kKinds[] = {BlendKind::kSmooth, BlendKind::kLinear, BlendKind::kCosine, BlendKind::kExponential};

TEST(BlendWeight, FallsFromOneToZero) {
  for (const BlendKind kind : kKinds) {
    EXPECT_EQ(blendWeight(kind, 0.0), 1.0);
    EXPECT_EQ(blendWeight(kind, 1.0), 0.0);
    EXPECT_EQ(blendWeight(kind, -3.0), 1.0);
    EXPECT_EQ(blendWeight(kind, 7.0), 0.0);
    double previous = 1.0;
    for (double u = 0.01; u < 1.0; u += 0.01) {
      const double weight = blendWeight(kind, u);
      EXPECT_LT(weight, previous) << blendKindName(kind) << " at " << u;
      EXPECT_GT(weight, 0.0);
      previous = weight;
    }
  }
}

TEST(BlendWeight, SmoothHasNoVelocityOrAccelerationAtItsEnds) {
  constexpr double kStep = 1e-4;
  for (const double end : {0.0, 1.0}) {
    const double inside = end == 0.0 ? kStep : 1.0 - kStep;
    const double deeper = end == 0.0 ? 2.0 * kStep : 1.0 - 2.0 * kStep;
    const double at_end = blendWeight(BlendKind::kSmooth, end);
    EXPECT_NEAR((blendWeight(BlendKind::kSmooth, inside) - at_end) / kStep, 0.0, 1e-6);
    const double second =
        at_end - 2.0 * blendWeight(BlendKind::kSmooth, inside) + blendWeight(BlendKind::kSmooth, deeper);
    EXPECT_NEAR(second / (kStep * kStep), 0.0, 0.01);
  }
  EXPECT_DOUBLE_EQ(blendWeight(BlendKind::kSmooth, 0.5), 0.5);
  EXPECT_DOUBLE_EQ(blendWeight(BlendKind::kCosine, 0.5), 0.5);
  EXPECT_LT(blendWeight(BlendKind::kExponential, 0.5), 0.1);
}

TEST(BlendKindName, GoesThereAndBack) {
  for (const BlendKind kind : kKinds) EXPECT_EQ(blendKindFromName(blendKindName(kind)), kind);
  EXPECT_EQ(blendKindFromName("Smooth"), std::nullopt);
}

TEST(BlendRows, FollowsEquation2) {
  const std::vector<Seconds> times{0.0, 0.1, 0.2, 0.3, 0.4, 0.5};
  const PositionMatrix first = PositionMatrix::Constant(6, 3, 2.0);
  const PositionMatrix second = PositionMatrix::Constant(6, 3, 4.0);
  const PositionMatrix blended = blendRows(first, second, times, {0.1, 0.4}, BlendKind::kLinear);
  EXPECT_EQ(blended(0, 0), 2.0);
  EXPECT_EQ(blended(1, 1), 2.0);
  EXPECT_NEAR(blended(2, 2), 2.0 + 2.0 / 3.0, 1e-12);
  EXPECT_NEAR(blended(3, 0), 2.0 + 4.0 / 3.0, 1e-12);
  EXPECT_EQ(blended(4, 0), 4.0);
  EXPECT_EQ(blended(5, 0), 4.0);
}

TEST(BlendRows, ANanOutsideTheSpanDoesNotSpread) {
  const std::vector<Seconds> times{0.0, 1.0, 2.0};
  PositionMatrix first = PositionMatrix::Constant(3, 3, 1.0);
  PositionMatrix second = PositionMatrix::Constant(3, 3, 5.0);
  first.row(2).setConstant(std::numeric_limits<double>::quiet_NaN());
  second.row(0).setConstant(std::numeric_limits<double>::quiet_NaN());
  EXPECT_TRUE(blendRows(first, second, times, {0.5, 1.5}).allFinite());
}

TEST(BlendRows, AnEmptySpanSwitches) {
  const std::vector<Seconds> times{0.0, 1.0, 2.0};
  const PositionMatrix blended =
      blendRows(PositionMatrix::Zero(3, 3), PositionMatrix::Ones(3, 3), times, {1.0, 1.0}, BlendKind::kCosine);
  EXPECT_EQ(blended.col(0), Eigen::Vector3d(0, 1, 1));
}

}  // namespace
}  // namespace mouthpiece
