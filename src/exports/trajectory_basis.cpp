#include "exports/trajectory_basis.h"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>

namespace mouthpiece {
namespace {

using Eigen::Index;
using Eigen::MatrixXf;

/// More directions than asked for make the range finder's last ones good.
constexpr Index kOversampling = 8;
constexpr Index kFirstCount = 48;

MatrixXf randomSigns(Index rows, Index columns) {
  std::mt19937 generator(20040601);  // NOLINT(cert-msc32-c,cert-msc51-cpp): the same shapes for the same animation
  MatrixXf signs(rows, columns);
  std::uint32_t bits = 0;
  for (Index i = 0; i < signs.size(); ++i, bits >>= 1U) {
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
  for (Index point = 0; point < residual.cols() / 3; ++point) {
    largest = std::max(largest, residual.middleCols<3>(3 * point).rowwise().squaredNorm().maxCoeff());
  }
  return std::sqrt(largest);
}

/// The fewest leading columns of `basis` that keep every point within `tolerance`; -1: all of them are too few.
Index sufficientCount(const MatrixXf& trajectories, const MatrixXf& basis, float tolerance) {
  const MatrixXf shapes = basis.transpose() * trajectories;
  const auto fits = [&](Index count) {
    return largestDistance(trajectories - basis.leftCols(count) * shapes.topRows(count)) <= tolerance;
  };
  Index too_few = -1;
  Index enough = basis.cols();
  if (!fits(enough)) return -1;
  while (enough - too_few > 1) {
    const Index middle = (enough + too_few) / 2;
    (fits(middle) ? enough : too_few) = middle;
  }
  return enough;
}

}  // namespace

MatrixXf leadingTrajectories(const MatrixXf& trajectories, Index count) {
  const Index rank = std::min({count + kOversampling, trajectories.rows(), trajectories.cols()});
  if (rank == 0) return MatrixXf(trajectories.rows(), 0);
  MatrixXf range = orthonormalColumns(trajectories * randomSigns(trajectories.cols(), rank));
  const MatrixXf through_channels = trajectories.transpose() * range;
  range = orthonormalColumns(trajectories * through_channels);
  const MatrixXf projected = range.transpose() * trajectories;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver((projected * projected.transpose()).cast<double>());
  const MatrixXf rotation = solver.eigenvectors().rowwise().reverse().leftCols(std::min(count, rank)).cast<float>();
  return range * rotation;
}

MatrixXf trajectoryBasis(const MatrixXf& trajectories, float tolerance) {
  const Index most = std::min(trajectories.rows(), trajectories.cols());
  for (Index count = std::min(kFirstCount, most);; count = std::min(2 * count, most)) {
    MatrixXf basis = leadingTrajectories(trajectories, count);
    const Index needed = sufficientCount(trajectories, basis, tolerance);
    if (needed < 0 && count < most) continue;
    basis.conservativeResize(Eigen::NoChange, needed < 0 ? most : needed);
    return basis;
  }
}

}  // namespace mouthpiece
