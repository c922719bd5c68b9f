#include "motion/cleaning/rigid.h"

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "base/errors.h"
#include "base/statistics.h"

namespace mouthpiece {
namespace {

/// Second largest spread of the markers, relative to the largest, below which they count as lying on one line.
constexpr double kLineTolerance = 1e-6;
/// Residuals are never judged finer than this: below lies the noise of any capture.
constexpr double kSmallestScaleMm = 0.05;
/// Median of |x| of a three-dimensional normal distribution with unit deviation in each axis.
constexpr double kMedianOfUnitResidual = 1.538;

struct Pairs {
  MarkerPositions source;
  MarkerPositions target;
};

Pairs pairsSeenInBoth(const MarkerPositions& source, const MarkerPositions& target) {
  MOUTHPIECE_EXPECT(source.rows() == target.rows());
  std::vector<Eigen::Index> rows;
  for (Eigen::Index i = 0; i < source.rows(); ++i) {
    if (source.row(i).allFinite() && target.row(i).allFinite()) rows.push_back(i);
  }
  return {source(rows, Eigen::all), target(rows, Eigen::all)};
}

/// Kabsch: the singular vectors of the weighted covariance, the last one turned if they would reflect.
std::optional<RigidMotion> fitWeighted(const Pairs& pairs, const Eigen::VectorXd& weights) {
  const double total = weights.sum();
  const Eigen::RowVector3d source_center = weights.transpose() * pairs.source / total;
  const Eigen::RowVector3d target_center = weights.transpose() * pairs.target / total;
  const MarkerPositions source = pairs.source.rowwise() - source_center;
  const MarkerPositions target = pairs.target.rowwise() - target_center;
  const Eigen::Matrix3d covariance = source.transpose() * weights.asDiagonal() * target;
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
  if (!(svd.singularValues()[1] > kLineTolerance * svd.singularValues()[0])) return std::nullopt;
  const double sign = (svd.matrixV() * svd.matrixU().transpose()).determinant() < 0.0 ? -1.0 : 1.0;
  RigidMotion motion;
  motion.rotation = svd.matrixV() * Eigen::Vector3d(1.0, 1.0, sign).asDiagonal() * svd.matrixU().transpose();
  motion.translation_mm = target_center.transpose() - motion.rotation * source_center.transpose();
  return motion;
}

Eigen::VectorXd residuals(const Pairs& pairs, const RigidMotion& motion) {
  return ((pairs.source * motion.rotation.transpose()).rowwise() + motion.translation_mm.transpose() - pairs.target)
      .rowwise()
      .norm();
}

/// Geman-McClure weights 1 / (1 + (r / 2s)^2)^2, s from the median residual.
Eigen::VectorXd robustWeights(const Eigen::VectorXd& residuals_mm) {
  const double middle_mm = interpolatedQuantile({residuals_mm.begin(), residuals_mm.end()}, 0.5);
  const double scale = 2.0 * std::max(kSmallestScaleMm, middle_mm / kMedianOfUnitResidual);
  return (1.0 + (residuals_mm.array() / scale).square()).square().inverse().matrix();
}

}  // namespace

std::optional<RigidMotion> fitRigidMotion(const MarkerPositions& source, const MarkerPositions& target,
                                          const RigidFitOptions& options) {
  const Pairs pairs = pairsSeenInBoth(source, target);
  if (pairs.source.rows() < 3) return std::nullopt;
  std::optional<RigidMotion> motion = fitWeighted(pairs, Eigen::VectorXd::Ones(pairs.source.rows()));
  // Three markers leave nothing to tell an outlier by.
  for (int round = 0; motion && round < options.robust_rounds && pairs.source.rows() > 3; ++round) {
    const std::optional<RigidMotion> better = fitWeighted(pairs, robustWeights(residuals(pairs, *motion)));
    if (!better) break;
    motion = better;
  }
  return motion;
}

}  // namespace mouthpiece
