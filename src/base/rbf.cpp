#include "base/rbf.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "base/errors.h"
#include "base/index.h"

namespace mouthpiece {
namespace {

using Matrix = RbfInterpolant::Matrix;

/// Centres nearer than this, relative to the radius of the whole set, count as one point.
constexpr double kCoincidenceTolerance = 1e-9;
/// Ratio of the smallest to the largest singular value of the centred coordinates below which they lie in one plane.
constexpr double kFlatnessTolerance = 1e-9;
/// How far the solution may miss the values, relative to the largest of them, before the system counts as singular.
constexpr double kResidualTolerance = 1e-6;
/// Rows of the kernel matrix made at a time when many points are evaluated: they stay in the cache.
constexpr Eigen::Index kEvaluationBlock = 256;

double kernelValue(RbfKernel kernel, double squared_distance, double shape) {
  switch (kernel) {
    case RbfKernel::kInverseMultiquadric:
      return 1.0 / std::sqrt(squared_distance + shape * shape);
    case RbfKernel::kBiharmonic:
      return std::sqrt(squared_distance);
    case RbfKernel::kTriharmonic:
      return squared_distance * std::sqrt(squared_distance);
  }
  return 0.0;
}

/// phi'(r) / r, which stays finite at r = 0 for the smooth kernels.
double kernelSlopeOverRadius(RbfKernel kernel, double squared_distance, double shape) {
  switch (kernel) {
    case RbfKernel::kInverseMultiquadric: {
      const double value = 1.0 / std::sqrt(squared_distance + shape * shape);
      return -value * value * value;
    }
    case RbfKernel::kBiharmonic:
      return squared_distance > 0.0 ? 1.0 / std::sqrt(squared_distance) : 0.0;
    case RbfKernel::kTriharmonic:
      return 3.0 * std::sqrt(squared_distance);
  }
  return 0.0;
}

/// n x m kernel values; both point sets and the shape in scaled coordinates.
Matrix kernelMatrix(const Eigen::Ref<const Matrix>& points, const Matrix& centers, const RbfOptions& options,
                    double scaled_shape) {
  Matrix squared = Matrix::Zero(points.rows(), centers.rows());
  for (Eigen::Index axis = 0; axis < points.cols(); ++axis) {
    const Eigen::RowVectorXd center_row = centers.col(axis).transpose();
    for (Eigen::Index i = 0; i < points.rows(); ++i) {
      squared.row(i).array() += (center_row.array() - points(i, axis)).square();
    }
  }
  if (options.kernel == RbfKernel::kInverseMultiquadric) {
    return (squared.array() + scaled_shape * scaled_shape).sqrt().inverse().matrix();
  }
  return squared.unaryExpr([&](double d2) { return kernelValue(options.kernel, d2, scaled_shape); });
}

Eigen::Index polynomialTermCount(RbfPolynomial polynomial, Eigen::Index dimension) {
  switch (polynomial) {
    case RbfPolynomial::kNone:
      return 0;
    case RbfPolynomial::kConstant:
      return 1;
    case RbfPolynomial::kLinear:
      return dimension + 1;
  }
  return 0;
}

Matrix polynomialMatrix(const Eigen::Ref<const Matrix>& points, Eigen::Index term_count) {
  Matrix terms(points.rows(), term_count);
  if (term_count > 0) terms.col(0).setOnes();
  if (term_count > 1) terms.rightCols(term_count - 1) = points;
  return terms;
}

/// A sweep along the first axis: O(n^2) at worst, nearly O(n log n) for time series.
void refuseCoincidentCenters(const Matrix& scaled_centers) {
  std::vector<Eigen::Index> order(unsignedIndex(scaled_centers.rows()));
  std::iota(order.begin(), order.end(), Eigen::Index{0});
  std::sort(order.begin(), order.end(),
            [&](Eigen::Index a, Eigen::Index b) { return scaled_centers(a, 0) < scaled_centers(b, 0); });
  for (std::size_t i = 0; i < order.size(); ++i) {
    for (std::size_t j = i + 1; j < order.size(); ++j) {
      if (scaled_centers(order[j], 0) - scaled_centers(order[i], 0) > kCoincidenceTolerance) break;
      if ((scaled_centers.row(order[i]) - scaled_centers.row(order[j])).norm() <= kCoincidenceTolerance) {
        throw InputError("found two interpolation centres at the same place; expected different places");
      }
    }
  }
}

void refuseFlatCenters(const Matrix& scaled_centers) {
  const Eigen::VectorXd singular_values = Eigen::JacobiSVD<Eigen::MatrixXd>(scaled_centers).singularValues();
  const bool spans_space = scaled_centers.rows() > scaled_centers.cols() &&
                           singular_values.minCoeff() > kFlatnessTolerance * singular_values.maxCoeff();
  if (!spans_space) {
    throw InputError("found interpolation centres that all lie in one plane (or line); expected them to span space");
  }
}

/// Regularisation keeps the sign of the kernel's definiteness: r alone is negative definite on the subspace that the
/// polynomial leaves, the other two positive.
double regularizationOnDiagonal(const Matrix& kernel, const RbfOptions& options, double scaled_shape) {
  switch (options.kernel) {
    case RbfKernel::kInverseMultiquadric:
      return options.regularization / scaled_shape;
    case RbfKernel::kBiharmonic:
      return -options.regularization * kernel.cwiseAbs().mean();
    case RbfKernel::kTriharmonic:
      return options.regularization * kernel.cwiseAbs().mean();
  }
  return 0.0;
}

/// [Phi + lambda P; P^T 0] of centres in scaled coordinates.
Eigen::MatrixXd saddleSystem(const Matrix& centers, const RbfOptions& options, double scaled_shape) {
  const Eigen::Index n = centers.rows(), terms = polynomialTermCount(options.polynomial, centers.cols());
  const Matrix kernel = kernelMatrix(centers, centers, options, scaled_shape);
  const Matrix polynomial = polynomialMatrix(centers, terms);
  Eigen::MatrixXd system = Eigen::MatrixXd::Zero(n + terms, n + terms);
  system.topLeftCorner(n, n) = kernel;
  system.topLeftCorner(n, n).diagonal().array() += regularizationOnDiagonal(kernel, options, scaled_shape);
  system.topRightCorner(n, terms) = polynomial;
  system.bottomLeftCorner(terms, n) = polynomial.transpose();
  return system;
}

/// Solves [Phi P; P^T 0] [weights; polynomial] = [values; 0] for all columns with one factorisation.
Eigen::MatrixXd solveSaddleSystem(const Eigen::MatrixXd& system, const Eigen::MatrixXd& right_side) {
  const Eigen::PartialPivLU<Eigen::MatrixXd> factors(system);
  Eigen::MatrixXd solution = factors.solve(right_side);
  // One step of refinement wins back the digits that an ill-conditioned kernel (large shape) loses.
  solution += factors.solve(right_side - system * solution);
  const double miss = (right_side - system * solution).cwiseAbs().maxCoeff();
  const double largest = std::max(right_side.cwiseAbs().maxCoeff(), 1e-300);
  if (!solution.allFinite() || !(miss <= kResidualTolerance * largest)) {
    throw InputError(
        "the interpolation centres make a singular system; expected them further apart or a smaller shape");
  }
  return solution;
}

}  // namespace

RbfInterpolant RbfInterpolant::fit(const Matrix& centers, const Matrix& values, const RbfOptions& options) {
  MOUTHPIECE_EXPECT(centers.rows() > 0 && centers.cols() > 0 && centers.rows() == values.rows());
  MOUTHPIECE_EXPECT(centers.allFinite() && values.allFinite());
  MOUTHPIECE_EXPECT(options.kernel != RbfKernel::kInverseMultiquadric || options.shape > 0.0);
  MOUTHPIECE_EXPECT(options.regularization >= 0.0);

  RbfInterpolant interpolant;
  interpolant.options_ = options;
  // Coordinates around zero with radius one: the polynomial and the kernel part of the system get the same size.
  interpolant.origin_ = centers.colwise().mean();
  interpolant.centers_ = centers.rowwise() - interpolant.origin_;
  const double radius = interpolant.centers_.rowwise().norm().maxCoeff();
  interpolant.scale_ = radius > 0.0 ? radius : 1.0;
  interpolant.centers_ /= interpolant.scale_;
  refuseCoincidentCenters(interpolant.centers_);
  if (options.polynomial == RbfPolynomial::kLinear) refuseFlatCenters(interpolant.centers_);

  const Eigen::Index n = centers.rows();
  const Eigen::Index terms = polynomialTermCount(options.polynomial, centers.cols());

  // Offsets from the mean lose fewer digits than positions far from the origin; the polynomial gives the mean back.
  const Eigen::RowVectorXd mean = terms > 0 ? Eigen::RowVectorXd(values.colwise().mean())
                                            : Eigen::RowVectorXd(Eigen::RowVectorXd::Zero(values.cols()));
  Eigen::MatrixXd right_side = Eigen::MatrixXd::Zero(n + terms, values.cols());
  right_side.topRows(n) = values.rowwise() - mean;
  const Eigen::MatrixXd solution =
      solveSaddleSystem(saddleSystem(interpolant.centers_, options, options.shape / interpolant.scale_), right_side);
  interpolant.weights_ = solution.topRows(n);
  interpolant.polynomial_weights_ = solution.bottomRows(terms);
  if (terms > 0) interpolant.polynomial_weights_.row(0) += mean;
  return interpolant;
}

/// With S the whole system, what the others miss at centre i is weight i / (S^-1)_ii: eliminating all rows but i leaves
/// 1 / (S^-1)_ii times weight i = value i less what they make of it.
Matrix RbfInterpolant::leaveOneOutErrors(const Matrix& centers, const Matrix& values, const RbfOptions& options) {
  const RbfInterpolant whole = fit(centers, values, options);
  const Eigen::MatrixXd system = saddleSystem(whole.centers_, options, options.shape / whole.scale_);
  const Eigen::VectorXd inverse = system.partialPivLu().inverse().diagonal().head(centers.rows());
  return whole.weights_.array().colwise() / inverse.array();
}

Matrix RbfInterpolant::evaluate(const Matrix& points) const {
  MOUTHPIECE_EXPECT(points.cols() == centers_.cols());
  Matrix values(points.rows(), weights_.cols());
  for (Eigen::Index first = 0; first < points.rows(); first += kEvaluationBlock) {
    const Eigen::Index count = std::min(kEvaluationBlock, points.rows() - first);
    const Matrix scaled = (points.middleRows(first, count).rowwise() - origin_) / scale_;
    values.middleRows(first, count).noalias() =
        kernelMatrix(scaled, centers_, options_, options_.shape / scale_) * weights_;
    if (polynomial_weights_.rows() > 0) {
      values.middleRows(first, count).noalias() +=
          polynomialMatrix(scaled, polynomial_weights_.rows()) * polynomial_weights_;
    }
  }
  return values;
}

Eigen::MatrixXd RbfInterpolant::jacobian(const Eigen::RowVectorXd& point) const {
  MOUTHPIECE_EXPECT(point.size() == centers_.cols());
  const Eigen::RowVectorXd scaled = (point - origin_) / scale_;
  Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(weights_.cols(), centers_.cols());
  for (Eigen::Index i = 0; i < centers_.rows(); ++i) {
    const Eigen::RowVectorXd offset = scaled - centers_.row(i);
    const double slope = kernelSlopeOverRadius(options_.kernel, offset.squaredNorm(), options_.shape / scale_);
    jacobian.noalias() += weights_.row(i).transpose() * (slope * offset);
  }
  if (polynomial_weights_.rows() > 1) {
    jacobian += polynomial_weights_.bottomRows(polynomial_weights_.rows() - 1).transpose();
  }
  return jacobian / scale_;
}

}  // namespace mouthpiece
