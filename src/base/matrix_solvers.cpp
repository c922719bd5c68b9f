#include "base/matrix_solvers.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

namespace mouthpiece {

SymmetricEigen symmetricEigen(const Eigen::MatrixXd& matrix) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(matrix);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

Eigen::MatrixXd solveSymmetric(Eigen::MatrixXd matrix, const Eigen::MatrixXd& right) {
  return Eigen::LDLT<Eigen::Ref<Eigen::MatrixXd>>(matrix).solve(right);  // in its own memory
}

}  // namespace mouthpiece
