#include "base/matrix_solvers.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace mouthpiece {
namespace {

constexpr double kExact = 1e-12;

/// Its upper half is anything, as only the lower one may be read.
Eigen::MatrixXd lowerHalf(const Eigen::MatrixXd& whole) {
  Eigen::MatrixXd half = Eigen::MatrixXd::Constant(whole.rows(), whole.cols(), 7);
  half.triangularView<Eigen::Lower>() = whole;
  return half;
}

Eigen::MatrixXd definite() {
  Eigen::MatrixXd root(40, 40);
  for (Eigen::Index i = 0; i < root.size(); ++i) root(i) = std::sin(static_cast<double>(i * i % 1009));
  return root * root.transpose() / 40 + Eigen::MatrixXd::Identity(40, 40);
}

TEST(MatrixSolvers, SolveFromTheLowerHalf) {
  const Eigen::MatrixXd matrix = definite(), wanted = matrix.leftCols(3);
  EXPECT_LT((solveSymmetric(lowerHalf(matrix), matrix * wanted) - wanted).cwiseAbs().maxCoeff(), kExact);
}

TEST(MatrixSolvers, EigenvectorsAreThoseOfRisingEigenvalues) {
  const Eigen::MatrixXd matrix = definite();
  const auto [values, vectors] = symmetricEigen(lowerHalf(matrix));
  EXPECT_LT((matrix * vectors - vectors * values.asDiagonal()).cwiseAbs().maxCoeff(), kExact);
  EXPECT_LT((vectors.transpose() * vectors - Eigen::MatrixXd::Identity(40, 40)).cwiseAbs().maxCoeff(), kExact);
  EXPECT_TRUE(std::is_sorted(values.begin(), values.end()));
}

}  // namespace
}  // namespace mouthpiece
