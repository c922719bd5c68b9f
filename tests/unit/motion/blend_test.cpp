#include "motion/blend.h"

#include <gtest/gtest.h>

#include <algorithm>
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

constexpr double kRounding = 1e-12;
constexpr TimeSpan kSpan{0.4, 0.7};

/// Times at `rate_hz` over a second, and two smooth curves of two channels there.
struct TwoCurves {
  std::vector<Seconds> times;
  PositionMatrix first, second;

  explicit TwoCurves(double rate_hz = 100) {
    for (int i = 0; i <= static_cast<int>(rate_hz); ++i) times.push_back(i / rate_hz);
    first.resize(std::ssize(times), 2);
    second.resize(std::ssize(times), 2);
    for (Eigen::Index i = 0; i < first.rows(); ++i) {
      const Seconds t = times[static_cast<std::size_t>(i)];
      first.row(i) << 3 * std::sin(5 * t), 2 - t;
      second.row(i) << 8 + std::cos(7 * t), t * t;
    }
  }
  [[nodiscard]] PositionMatrix blended(BlendKind kind) const { return blendRows(first, second, times, kSpan, kind); }
};

TEST(BlendLaws, TheWeightsOfBothAddUpToOne) {
  const TwoCurves curves;
  for (const BlendKind kind : kKinds) {
    EXPECT_LT((blendRows(curves.first, curves.first, curves.times, kSpan, kind) - curves.first).cwiseAbs().maxCoeff(),
              kRounding)
        << blendKindName(kind) << ": of one curve with itself";
    const PositionMatrix back = blendRows(curves.second, curves.first, curves.times, kSpan, kind);
    const PositionMatrix sum = curves.first + curves.second;
    const PositionMatrix both = curves.blended(kind) + back;
    EXPECT_LT((both - sum).cwiseAbs().maxCoeff(), kRounding) << blendKindName(kind);
  }
}

TEST(BlendLaws, LiesBetweenTheTwo) {
  const TwoCurves curves;
  for (const BlendKind kind : kKinds) {
    const PositionMatrix blended = curves.blended(kind);
    EXPECT_GE((blended - curves.first.cwiseMin(curves.second)).minCoeff(), -kRounding) << blendKindName(kind);
    EXPECT_LE((blended - curves.first.cwiseMax(curves.second)).maxCoeff(), kRounding) << blendKindName(kind);
  }
}

TEST(BlendLaws, IsEachFragmentToTheBitOutsideAndAtTheEnds) {
  const TwoCurves curves;
  for (const BlendKind kind : kKinds) {
    const PositionMatrix blended = curves.blended(kind);
    for (Eigen::Index i = 0; i < blended.rows(); ++i) {
      const Seconds time = curves.times[static_cast<std::size_t>(i)];
      if (time > kSpan.start && time < kSpan.end) continue;
      EXPECT_EQ(blended.row(i), (time <= kSpan.start ? curves.first : curves.second).row(i)) << time;
    }
  }
}

TEST(BlendLaws, IsLinearInBoth) {
  const TwoCurves curves;
  for (const BlendKind kind : kKinds) {
    const PositionMatrix scaled = blendRows(3 * curves.first, 3 * curves.second, curves.times, kSpan, kind);
    EXPECT_LT((scaled - 3 * curves.blended(kind)).cwiseAbs().maxCoeff(), 10 * kRounding);
    const PositionMatrix shifted =
        blendRows((curves.first.array() + 5).matrix(), (curves.second.array() + 5).matrix(), curves.times, kSpan, kind);
    EXPECT_LT((shifted.array() - 5 - curves.blended(kind).array()).abs().maxCoeff(), 10 * kRounding);
  }
}

/// The largest change of velocity from one step to the next, per second of step: finite where velocity does not jump.
double largestTurn(const PositionMatrix& rows, double rate_hz) {
  const Eigen::Index count = rows.rows() - 2;
  return (rows.bottomRows(count) - 2 * rows.middleRows(1, count) + rows.topRows(count)).cwiseAbs().maxCoeff() * rate_hz;
}

TEST(BlendLaws, VelocityDoesNotJumpWhereTheKindSaysSo) {
  for (const BlendKind kind : kKinds) {
    // At ten times the rate a bend turns a tenth as far in a step, a jump as far as ever.
    const double coarse = largestTurn(TwoCurves(400).blended(kind), 400);
    const double fine = largestTurn(TwoCurves(4000).blended(kind), 4000);
    const bool jumps = kind == BlendKind::kLinear || kind == BlendKind::kExponential;
    if (jumps) {
      EXPECT_GT(fine, 0.8 * coarse) << blendKindName(kind);
    } else {
      EXPECT_LT(fine, 0.2 * coarse) << blendKindName(kind);
    }
  }
}

TEST(BlendLaws, AllButTheExponentialAreTheSameBackwards) {
  for (const BlendKind kind : kKinds) {
    double most = 0;
    for (int i = 0; i <= 100; ++i)
      most = std::max(most, std::abs(blendWeight(kind, i / 100.0) + blendWeight(kind, 1 - i / 100.0) - 1));
    EXPECT_EQ(most < kRounding, kind != BlendKind::kExponential) << blendKindName(kind);
  }
}

/// The page's formulas at places of their own, and no jump at either end.
TEST(BlendLaws, WeightsAreTheFormulasOfTheirKinds) {
  for (const double u : {0.1, 0.37, 0.5, 0.81}) {
    EXPECT_NEAR(blendWeight(BlendKind::kSmooth, u), 1 - (10 * u * u * u - 15 * u * u * u * u + 6 * std::pow(u, 5)),
                1e-12);
    EXPECT_NEAR(blendWeight(BlendKind::kLinear, u), 1 - u, 1e-12);
    EXPECT_NEAR(blendWeight(BlendKind::kCosine, u), std::pow(std::cos(u * std::acos(0.0)), 2), 1e-12);
    EXPECT_NEAR(blendWeight(BlendKind::kExponential, u), (std::exp(5 * (1 - u)) - 1) / (std::exp(5.0) - 1), 1e-12);
  }
  for (const BlendKind kind : kKinds) {
    EXPECT_NEAR(blendWeight(kind, 1e-9), 1, 1e-7) << blendKindName(kind);
    EXPECT_NEAR(blendWeight(kind, 1 - 1e-9), 0, 1e-7) << blendKindName(kind);
  }
}

}  // namespace
}  // namespace mouthpiece
