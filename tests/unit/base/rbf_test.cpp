#include "base/rbf.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "base/errors.h"

namespace mouthpiece {
namespace {

using Matrix = RbfInterpolant::Matrix;

constexpr double kLandmarkToleranceMm = 1e-6;  // the promise of `retarget fit`

/// Points on the front of an ellipsoid the size of a head, half a metre from the origin as a capture may have them.
Matrix facePoints(unsigned seed, Eigen::Index count) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> across(-1.0, 1.0);
  Matrix points(count, 3);
  for (Eigen::Index i = 0; i < count; ++i) {
    const double x = across(random);
    const double y = across(random);
    points.row(i) << 300.0 + 75.0 * x, -450.0 + 100.0 * y, 120.0 + 60.0 * std::sqrt(2.0 - x * x - y * y);
  }
  return points;
}

Matrix smoothlyMoved(const Matrix& points) {
  Matrix moved = points;
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    const Eigen::RowVector3d p = points.row(i);
    moved.row(i) =
        1.1 * p + Eigen::RowVector3d(5.0 * std::sin(p.y() / 40.0), 0.05 * p.x(), 3.0 * std::cos(p.x() / 30.0));
  }
  return moved;
}

std::vector<RbfOptions> exactOptions() {
  std::vector<RbfOptions> options;
  for (const double shape_mm : {10.0, 40.0, 100.0, 200.0}) {
    options.push_back({RbfKernel::kInverseMultiquadric, RbfPolynomial::kLinear, shape_mm, 0.0});
    options.push_back({RbfKernel::kInverseMultiquadric, RbfPolynomial::kNone, shape_mm, 0.0});
  }
  options.push_back({RbfKernel::kBiharmonic, RbfPolynomial::kConstant, 1.0, 0.0});
  options.push_back({RbfKernel::kBiharmonic, RbfPolynomial::kLinear, 1.0, 0.0});
  options.push_back({RbfKernel::kTriharmonic, RbfPolynomial::kLinear, 1.0, 0.0});
  return options;
}

/// The closed form against fits to all other centres.
TEST(RbfInterpolant, LeavesCentresOutAsFitsWithoutThemDo) {
  constexpr double kToleranceMm = 1e-4;
  const Matrix centers = facePoints(6, 40), values = smoothlyMoved(centers);
  std::vector<RbfOptions> all = exactOptions();
  // The other kernels' regularisation is relative to a mean over all centres, so that one less changes it a little.
  all.push_back({RbfKernel::kInverseMultiquadric, RbfPolynomial::kLinear, 40.0, 0.1});
  for (const RbfOptions& options : all) {
    const Matrix errors = RbfInterpolant::leaveOneOutErrors(centers, values, options);
    for (Eigen::Index i = 0; i < centers.rows(); ++i) {
      Matrix other_centers(centers.rows() - 1, 3), other_values = other_centers;
      other_centers << centers.topRows(i), centers.bottomRows(centers.rows() - 1 - i);
      other_values << values.topRows(i), values.bottomRows(centers.rows() - 1 - i);
      const Matrix there = RbfInterpolant::fit(other_centers, other_values, options).evaluate(centers.row(i));
      EXPECT_LT((values.row(i) - there - errors.row(i)).norm(), kToleranceMm)
          << "centre " << i << " kernel " << static_cast<int>(options.kernel) << " shape " << options.shape;
    }
  }
}

TEST(RbfInterpolant, MeetsEveryCentre) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const Matrix centers = facePoints(seed, 66);
    const Matrix values = smoothlyMoved(centers);
    for (const RbfOptions& options : exactOptions()) {
      const Matrix back = RbfInterpolant::fit(centers, values, options).evaluate(centers);
      EXPECT_LT((back - values).cwiseAbs().maxCoeff(), kLandmarkToleranceMm)
          << "seed " << seed << " kernel " << static_cast<int>(options.kernel) << " shape " << options.shape;
    }
  }
}

TEST(RbfInterpolant, ReproducesLinearMaps) {
  const Matrix centers = facePoints(3, 66);
  const Eigen::Matrix3d linear{{1.2, 0.1, -0.3}, {0.0, 0.8, 0.2}, {0.1, -0.1, 1.5}};
  const Eigen::RowVector3d offset(10, -20, 30);
  const auto map = [&](const Matrix& points) -> Matrix { return (points * linear).rowwise() + offset; };
  const Matrix points = facePoints(99, 300) * 1.3;
  for (RbfOptions options : exactOptions()) {
    options.polynomial = RbfPolynomial::kLinear;
    const RbfInterpolant interpolant = RbfInterpolant::fit(centers, map(centers), options);
    EXPECT_LT((interpolant.evaluate(points) - map(points)).cwiseAbs().maxCoeff(), 1e-5) << options.shape;
    EXPECT_LT((interpolant.jacobian(points.row(0)) - linear.transpose()).cwiseAbs().maxCoeff(), 1e-6);
  }
}

TEST(RbfInterpolant, ReproducesConstantsWithTheConstantTerm) {
  const Matrix centers = facePoints(4, 30);
  const Matrix values = Matrix::Constant(30, 2, -7.25);
  const RbfInterpolant interpolant =
      RbfInterpolant::fit(centers, values, {RbfKernel::kInverseMultiquadric, RbfPolynomial::kConstant, 30.0, 0.0});
  EXPECT_LT((interpolant.evaluate(facePoints(5, 50)).array() + 7.25).abs().maxCoeff(), 1e-9);
}

TEST(RbfInterpolant, FollowsATimeSeries) {
  Matrix times(40, 1);
  for (Eigen::Index i = 0; i < 40; ++i) times(i, 0) = 100.0 + static_cast<double>(i) / 25.0;
  const Matrix values = times.unaryExpr([](double t) { return 5.0 * std::sin(6.0 * t); });
  const RbfInterpolant interpolant =
      RbfInterpolant::fit(times, values, {RbfKernel::kInverseMultiquadric, RbfPolynomial::kLinear, 0.06, 0.0});
  Matrix between = times.middleRows(5, 30);
  between.array() += 0.013;
  const Matrix expected = between.unaryExpr([](double t) { return 5.0 * std::sin(6.0 * t); });
  // About 1 Hz of 5 mm sampled at 25 Hz, away from the ends.
  EXPECT_LT((interpolant.evaluate(between) - expected).cwiseAbs().maxCoeff(), 0.01);
}

TEST(RbfInterpolant, HasTheJacobianOfItsValues) {
  const Matrix centers = facePoints(6, 66);
  const Matrix values = smoothlyMoved(centers);
  constexpr double kStepMm = 0.05;  // wide enough that rounding (1e-8 mm at shape 200) does not show
  for (const RbfOptions& options : exactOptions()) {
    const RbfInterpolant interpolant = RbfInterpolant::fit(centers, values, options);
    const Eigen::RowVector3d point(310.0, -440.0, 190.0);
    const Eigen::MatrixXd jacobian = interpolant.jacobian(point);
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::RowVector3d step = kStepMm * Eigen::RowVector3d::Unit(axis);
      const Eigen::RowVectorXd slope =
          (interpolant.evaluate(point + step) - interpolant.evaluate(point - step)) / (2.0 * kStepMm);
      EXPECT_LT((jacobian.col(axis).transpose() - slope).cwiseAbs().maxCoeff(), 1e-5);
    }
  }
}

TEST(RbfInterpolant, RegularisationTradesExactnessForSmallerWeights) {
  const Matrix centers = facePoints(7, 66);
  std::mt19937 random(8);
  std::normal_distribution<double> noise(0.0, 1.0);
  const Matrix values = smoothlyMoved(centers).unaryExpr([&](double x) { return x + noise(random); });
  for (RbfOptions options : exactOptions()) {
    options.polynomial = RbfPolynomial::kLinear;
    double previous_miss = 0.0;
    for (const double strength : {1e-3, 1e-1, 10.0}) {
      options.regularization = strength;
      const Matrix back = RbfInterpolant::fit(centers, values, options).evaluate(centers);
      const double miss = (back - values).norm() / std::sqrt(static_cast<double>(values.size()));
      EXPECT_GT(miss, previous_miss) << static_cast<int>(options.kernel) << " " << options.shape << " " << strength;
      previous_miss = miss;
    }
    // What remains at last is what no linear map explains: the noise and the smooth part's 4 mm.
    EXPECT_LT(previous_miss, 5.0);
  }
}

TEST(RbfInterpolant, RefusesCentresThatCannotBeSolved) {
  Matrix twice = facePoints(9, 20);
  twice.row(19) = twice.row(3);
  const Matrix values = Matrix::Ones(20, 3);
  EXPECT_THROW(RbfInterpolant::fit(twice, values, {}), InputError);

  Matrix flat = facePoints(10, 20);
  flat.col(2) = 0.3 * flat.col(0) - 0.1 * flat.col(1);
  EXPECT_THROW(RbfInterpolant::fit(flat, values, {}), InputError);
  EXPECT_THROW(RbfInterpolant::fit(facePoints(11, 3), Matrix::Ones(3, 1), {}), InputError);
  EXPECT_NO_THROW(
      RbfInterpolant::fit(flat, values, {RbfKernel::kInverseMultiquadric, RbfPolynomial::kConstant, 20.0, 0.0}));

  Matrix with_nan = facePoints(12, 20);
  with_nan(0, 0) = std::nan("");
  EXPECT_THROW(RbfInterpolant::fit(with_nan, values, {}), InternalError);
}

}  // namespace
}  // namespace mouthpiece
