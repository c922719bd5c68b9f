// What any interpolation by equation (1) obeys, whatever its centres: random ones, the seed in the trace.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <numeric>
#include <random>

#include "base/errors.h"
#include "base/index.h"
#include "base/rbf.h"

namespace mouthpiece {
namespace {

using Matrix = RbfInterpolant::Matrix;

constexpr unsigned kSeeds = 12;
constexpr double kTolerance = 1e-6;  ///< of values about 1: what LU leaves of a well-spread system

Matrix randomMatrix(std::mt19937& random, Eigen::Index rows, Eigen::Index columns, double size) {
  std::uniform_real_distribution<double> any(-size, size);
  return Matrix::NullaryExpr(rows, columns, [&] { return any(random); });
}

std::vector<RbfOptions> allKinds() {
  return {{RbfKernel::kInverseMultiquadric, RbfPolynomial::kNone, 20, 0},
          {RbfKernel::kInverseMultiquadric, RbfPolynomial::kLinear, 20, 0},
          {RbfKernel::kBiharmonic, RbfPolynomial::kConstant, 1, 0},
          {RbfKernel::kBiharmonic, RbfPolynomial::kLinear, 1, 0},
          {RbfKernel::kTriharmonic, RbfPolynomial::kLinear, 1, 0}};
}

struct Problem {
  Matrix centers, values, queries;
};

/// Centres no nearer to each other than kLeastDistance, so that every kernel can be solved to many digits.
Problem problem(unsigned seed, Eigen::Index dimension) {
  constexpr double kLeastDistance = 6;
  std::mt19937 random(seed);
  const Eigen::Index count = 12 + dimension * 6;
  Matrix centers(count, dimension);
  for (Eigen::Index i = 0; i < count;) {
    centers.row(i) = randomMatrix(random, 1, dimension, 100);
    const bool is_apart =
        i == 0 || (centers.topRows(i).rowwise() - centers.row(i)).rowwise().norm().minCoeff() > kLeastDistance;
    i += is_apart ? 1 : 0;
  }
  return {centers, randomMatrix(random, count, 2, 1), randomMatrix(random, 20, dimension, 120)};
}

/// Calls check(problem, options) for random problems of one to three dimensions and every kind.
template <typename Check>
void forEachProblem(const Check& check) {
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    for (const RbfOptions& options : allKinds()) {
      SCOPED_TRACE(testing::Message() << "seed " << seed << ", kernel " << static_cast<int>(options.kernel));
      check(problem(seed, 1 + seed % 3), options);
    }
  }
}

double largest(const Matrix& difference) { return difference.cwiseAbs().maxCoeff(); }

TEST(RbfLaws, TheOrderOfTheCentresDoesNotMatter) {
  forEachProblem([](const Problem& p, const RbfOptions& options) {
    std::vector<Eigen::Index> order(unsignedIndex(p.centers.rows()));
    std::iota(order.begin(), order.end(), Eigen::Index{0});
    std::shuffle(order.begin(), order.end(), std::mt19937(9));
    const Matrix plain = RbfInterpolant::fit(p.centers, p.values, options).evaluate(p.queries);
    const Matrix shuffled =
        RbfInterpolant::fit(p.centers(order, Eigen::all), p.values(order, Eigen::all), options).evaluate(p.queries);
    EXPECT_LT(largest(plain - shuffled), kTolerance);
  });
}

TEST(RbfLaws, AWeightedSumOfValuesIsTheSumOfTheInterpolants) {
  forEachProblem([](const Problem& p, const RbfOptions& options) {
    std::mt19937 random(3);
    const Matrix other = randomMatrix(random, p.values.rows(), p.values.cols(), 1);
    const auto at = [&](const Matrix& values) {
      return RbfInterpolant::fit(p.centers, values, options).evaluate(p.queries);
    };
    EXPECT_LT(largest(at(0.5 * p.values - 2.0 * other) - (0.5 * at(p.values) - 2.0 * at(other))), kTolerance);
  });
}

TEST(RbfLaws, ColumnsAreFittedEachByItself) {
  forEachProblem([](const Problem& p, const RbfOptions& options) {
    const Matrix both = RbfInterpolant::fit(p.centers, p.values, options).evaluate(p.queries);
    const Matrix second = RbfInterpolant::fit(p.centers, p.values.rightCols(1), options).evaluate(p.queries);
    EXPECT_LT(largest(both.rightCols(1) - second), kTolerance);
  });
}

/// Kernels look at distances only; polynomials of degree one go along with any rigid motion.
TEST(RbfLaws, MovingSpaceRigidlyMovesNothingElse) {
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    const Problem p = problem(seed, 3);
    const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.3 * seed, Eigen::Vector3d(1, seed, -2).normalized()).matrix();
    const auto moved = [&](const Matrix& points) -> Matrix {
      return (points * turn.transpose()).rowwise() + Eigen::RowVector3d(500, -300, 10);
    };
    for (const RbfOptions& options : allKinds()) {
      EXPECT_LT(largest(RbfInterpolant::fit(p.centers, p.values, options).evaluate(p.queries) -
                        RbfInterpolant::fit(moved(p.centers), p.values, options).evaluate(moved(p.queries))),
                kTolerance);
    }
  }
}

/// Space and shape twice as large: the same values at places twice as far.
TEST(RbfLaws, ScalingSpaceAndShapeChangesNothing) {
  forEachProblem([](const Problem& p, const RbfOptions& options) {
    RbfOptions wide = options;
    wide.shape *= 2;
    EXPECT_LT(largest(RbfInterpolant::fit(p.centers, p.values, options).evaluate(p.queries) -
                      RbfInterpolant::fit(2 * p.centers, p.values, wide).evaluate(2 * p.queries)),
              kTolerance);
  });
}

TEST(RbfLaws, AddingAPolynomialOfItsDegreeAddsJustThat) {
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    const Problem p = problem(seed, 1 + seed % 3);
    std::mt19937 random(seed);
    const Matrix slopes = randomMatrix(random, p.centers.cols(), 2, 0.02);
    const auto polynomial = [&](const Matrix& points) -> Matrix {
      return (points * slopes).rowwise() + Eigen::RowVector2d(0.5, -3);
    };
    for (const RbfOptions& options : allKinds()) {
      if (options.polynomial != RbfPolynomial::kLinear) continue;
      const Matrix plain = RbfInterpolant::fit(p.centers, p.values, options).evaluate(p.queries);
      const Matrix lifted =
          RbfInterpolant::fit(p.centers, p.values + polynomial(p.centers), options).evaluate(p.queries);
      EXPECT_LT(largest(lifted - plain - polynomial(p.queries)), kTolerance);
    }
  }
}

TEST(RbfLaws, AFinerFitOfItsOwnValuesIsItself) {
  forEachProblem([](const Problem& p, const RbfOptions& options) {
    // What an interpolant says at its centres, fitted again, says the same everywhere.
    const RbfInterpolant first = RbfInterpolant::fit(p.centers, p.values, options);
    const RbfInterpolant second = RbfInterpolant::fit(p.centers, first.evaluate(p.centers), options);
    EXPECT_LT(largest(first.evaluate(p.centers) - p.values), kTolerance);
    EXPECT_LT(largest(first.evaluate(p.queries) - second.evaluate(p.queries)), kTolerance);
  });
}

TEST(RbfLaws, MoreRegularisationMissesTheValuesByMore) {
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    const Problem p = problem(seed, 3);
    double before = -1;
    for (const double regularization : {0.0, 1e-3, 1e-2, 1e-1, 1.0, 10.0}) {
      RbfOptions options = allKinds()[1];
      options.regularization = regularization;
      const double miss =
          (RbfInterpolant::fit(p.centers, p.values, options).evaluate(p.centers) - p.values).squaredNorm();
      EXPECT_GE(miss, before - kTolerance) << regularization;
      before = miss;
    }
    EXPECT_GT(before, 0.1) << "a strong one must give up the values";
  }
}

TEST(RbfLaws, CoincidentCentresAreFoundWhereverTheyStand) {
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    Problem p = problem(seed, 1 + seed % 3);
    std::mt19937 random(seed);
    const auto count = static_cast<unsigned>(p.centers.rows());
    const auto one = static_cast<Eigen::Index>(random() % count), other = static_cast<Eigen::Index>((one + 1) % count);
    p.centers.row(one) = p.centers.row(other);
    for (const RbfOptions& options : allKinds())
      EXPECT_THROW((void)RbfInterpolant::fit(p.centers, p.values, options), InputError);
  }
}

}  // namespace
}  // namespace mouthpiece
