#include "exports/shapes/trajectories.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <utility>

#include "base/matrix_solvers.h"

namespace mouthpiece {
namespace {

using Eigen::MatrixXf;

/// More directions than asked for make the range finder's last ones good.
constexpr Eigen::Index kOversampling = 8;
/// Directions found at a time: two blocks are what a line of three seconds or more needs.
constexpr Eigen::Index kBlockCount = 32;

MatrixXf randomSigns(Eigen::Index rows, Eigen::Index columns) {
  std::mt19937 generator(20040601);  // NOLINT(cert-msc32-c,cert-msc51-cpp): the same shapes for the same animation
  MatrixXf signs(rows, columns);
  std::uint32_t bits = 0;
  for (Eigen::Index i = 0; i < signs.size(); ++i, bits >>= 1U) {
    if (i % 32 == 0) bits = static_cast<std::uint32_t>(generator());
    signs(i) = (bits & 1U) != 0U ? 1.0F : -1.0F;
  }
  return signs;
}

MatrixXf orthonormalColumns(const MatrixXf& columns) {
  const Eigen::HouseholderQR<MatrixXf> qr(columns);
  return qr.householderQ() * MatrixXf::Identity(columns.rows(), std::min(columns.rows(), columns.cols()));
}

float largestDistance(const MatrixXf& residual) {
  float largest = 0;
  for (Eigen::Index point = 0; point < residual.cols() / 3; ++point) {
    largest = std::max(largest, residual.middleCols<3>(3 * point).rowwise().squaredNorm().maxCoeff());
  }
  return std::sqrt(largest);
}

/// The fewest leading columns of `block` whose removal from a residual leaves every point within `tolerance`; all of
/// them together leave `left`, which is within it. `shapes`: block^T residual.
Eigen::Index sufficientCount(MatrixXf left, const MatrixXf& block, const MatrixXf& shapes, float tolerance) {
  Eigen::Index enough = block.cols();
  for (; enough > 1; --enough) {
    left.noalias() += block.col(enough - 1) * shapes.row(enough - 1);
    if (!(largestDistance(left) <= tolerance)) break;
  }
  return enough;
}

void append(MatrixXf& columns, const MatrixXf& more) {
  columns.conservativeResize(more.rows(), columns.cols() + more.cols());
  columns.rightCols(more.cols()) = more;
}

}  // namespace

MatrixXf leadingTrajectories(const MatrixXf& trajectories, Eigen::Index count) {
  const Eigen::Index rank = std::min({count + kOversampling, trajectories.rows(), trajectories.cols()});
  if (rank == 0) return MatrixXf(trajectories.rows(), 0);
  MatrixXf range = orthonormalColumns(trajectories * randomSigns(trajectories.cols(), rank));
  const MatrixXf through_channels = trajectories.transpose() * range;
  range = orthonormalColumns(trajectories * through_channels);
  const MatrixXf projected = range.transpose() * trajectories;
  const Eigen::MatrixXd directions = symmetricEigen((projected * projected.transpose()).cast<double>()).vectors;
  const MatrixXf rotation = directions.rowwise().reverse().leftCols(std::min(count, rank)).cast<float>();
  return range * rotation;
}

MatrixXf trajectoryBasis(const MatrixXf& trajectories, float tolerance) {
  const Eigen::Index most = std::min(trajectories.rows(), trajectories.cols());
  MatrixXf basis(trajectories.rows(), 0);
  MatrixXf residual = trajectories;
  while (basis.cols() < most && !(largestDistance(residual) <= tolerance)) {
    MatrixXf block = leadingTrajectories(residual, std::min(kBlockCount, most - basis.cols()));
    // Twice: once leaves what rounding makes of a small residual.
    for (int pass = 0; pass < 2; ++pass) block = orthonormalColumns(block - basis * (basis.transpose() * block));
    const MatrixXf shapes = block.transpose() * residual;
    MatrixXf left = residual - block * shapes;
    if (largestDistance(left) <= tolerance) {
      append(basis, block.leftCols(sufficientCount(std::move(left), block, shapes, tolerance)));
      return basis;
    }
    append(basis, block);
    residual = std::move(left);
  }
  return basis;
}

MatrixXf basisInAllFrames(const MatrixXf& basis, const MatrixXf& trajectories) {
  constexpr double kLeastShare = 1e-12;  // of the strongest trajectory's square: one that nothing follows stays finite
  const Eigen::Index others = trajectories.rows() - basis.rows();
  MatrixXf all(trajectories.rows(), basis.cols());
  all.topRows(basis.rows()) = basis;
  if (others == 0 || basis.cols() == 0) return all;
  const MatrixXf shapes = basis.transpose() * trajectories.topRows(basis.rows());
  const MatrixXf products = shapes * trajectories.bottomRows(others).transpose();
  Eigen::MatrixXd gram = (shapes * shapes.transpose()).cast<double>();
  gram.diagonal().array() += kLeastShare * gram.diagonal().maxCoeff();
  all.bottomRows(others) = solveSymmetric(std::move(gram), products.cast<double>()).transpose().cast<float>();
  return all;
}

}  // namespace mouthpiece
