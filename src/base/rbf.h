#pragma once

#include <Eigen/Core>

namespace mouthpiece {

/// Radial basis functions phi(r) of eq. (1); c is RbfOptions::shape, in the unit of the coordinates.
enum class RbfKernel {
  kInverseMultiquadric,  ///< 1 / sqrt(r^2 + c^2), the paper's
  kBiharmonic,           ///< r
  kTriharmonic,          ///< r^3
};

/// The polynomial p_m of eq. (1).
enum class RbfPolynomial { kNone, kConstant, kLinear };

struct RbfOptions {
  RbfKernel kernel = RbfKernel::kInverseMultiquadric;
  RbfPolynomial polynomial = RbfPolynomial::kLinear;
  double shape = 1.0;
  double regularization =
      0.0;  ///< added to the diagonal, relative to phi(0) (or to the mean |phi|); 0 interpolates exactly
};

/// f: R^d -> R^k with f(c_i) = y_i: a weighted sum of radial functions at the centres plus a polynomial (EDGE eq. 1).
class RbfInterpolant {
 public:
  using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  /// centers: n x d, values: n x k, one factorisation for all k columns. Throws InputError when two centres coincide
  /// or (for kLinear) all lie in one plane, InternalError for NaN.
  static RbfInterpolant fit(const Matrix& centers, const Matrix& values, const RbfOptions& options);

  /// n x k: at each centre its value less what fit() to all the others makes of it, by one factorisation (S. Rippa, An
  /// algorithm for selecting a good value for the parameter c, Adv. Comput. Math. 11, 1999, here with polynomial and
  /// regularisation). Errors as fit().
  static Matrix leaveOneOutErrors(const Matrix& centers, const Matrix& values, const RbfOptions& options);

  /// m x d points -> m x k values.
  [[nodiscard]] Matrix evaluate(const Matrix& points) const;
  /// Jacobian k x d at one point (1 x d).
  [[nodiscard]] Eigen::MatrixXd jacobian(const Eigen::RowVectorXd& point) const;

 private:
  Matrix centers_, weights_, polynomial_weights_;
  Eigen::RowVectorXd origin_;
  double scale_ = 1;
  RbfOptions options_;
};

}  // namespace mouthpiece
