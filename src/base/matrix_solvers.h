#pragma once

#include <Eigen/Core>

namespace mouthpiece {

/// What is slow to compile of Eigen, compiled once (docs/decisions/0004-build-time.md).
struct SymmetricEigen {
  Eigen::VectorXd values;   ///< rising
  Eigen::MatrixXd vectors;  ///< of length 1, a column each
};

/// Of a symmetric matrix, of which the lower half is read.
SymmetricEigen symmetricEigen(const Eigen::MatrixXd& matrix);

/// matrix^-1 right by L D L^T, for a definite symmetric matrix of which the lower half is read. O(rows^3).
Eigen::MatrixXd solveSymmetric(Eigen::MatrixXd matrix, const Eigen::MatrixXd& right);

}  // namespace mouthpiece
