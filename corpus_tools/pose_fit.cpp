#include "corpus_tools/pose_fit.h"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

namespace mouthpiece {
namespace {

constexpr int kRobustRounds = 4;
constexpr int kShapeRounds = 8;

Eigen::VectorXd seenInBoth(const MarkerPositions& source, const MarkerPositions& target) {
  Eigen::VectorXd weights(source.rows());
  for (Eigen::Index i = 0; i < source.rows(); ++i) {
    weights[i] = source.row(i).allFinite() && target.row(i).allFinite() ? 1.0 : 0.0;
  }
  return weights;
}

/// Markers of weight 0 may be NaN and are not read.
Eigen::RowVector3d weightedMean(const MarkerPositions& points, const Eigen::VectorXd& weights) {
  Eigen::RowVector3d sum = Eigen::RowVector3d::Zero();
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    if (weights[i] > 0) sum += weights[i] * points.row(i);
  }
  return sum / weights.sum();
}

/// Kabsch (1976) by the singular values of the covariance; size after Umeyama (1991), eq. 42.
PoseFit fitWeighted(const MarkerPositions& source, const MarkerPositions& target, const Eigen::VectorXd& weights,
                    PoseScale scale) {
  const Eigen::RowVector3d source_mean = weightedMean(source, weights);
  const Eigen::RowVector3d target_mean = weightedMean(target, weights);
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  double source_variance = 0;
  for (Eigen::Index i = 0; i < source.rows(); ++i) {
    if (weights[i] <= 0) continue;
    const Eigen::RowVector3d from = source.row(i) - source_mean;
    covariance += weights[i] * (target.row(i) - target_mean).transpose() * from;
    source_variance += weights[i] * from.squaredNorm();
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d signs = Eigen::Vector3d::Ones();
  if (svd.matrixU().determinant() * svd.matrixV().determinant() < 0) signs[2] = -1;  // no mirror image
  PoseFit fit;
  if (scale == PoseScale::kFree && source_variance > 0) fit.scale = svd.singularValues().dot(signs) / source_variance;
  fit.target_from_source.linear() = svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
  fit.target_from_source.translation() =
      target_mean.transpose() - fit.scale * (fit.target_from_source.linear() * source_mean.transpose());
  return fit;
}

MarkerPositions moved(const MarkerPositions& shape, const PoseFit& fit) {
  return (fit.scale * (shape * fit.target_from_source.linear().transpose())).rowwise() +
         fit.target_from_source.translation().transpose();
}

MarkerPositions meanOfSeen(const std::vector<MarkerPositions>& shapes) {
  MarkerPositions sum = MarkerPositions::Zero(shapes.front().rows(), 3);
  Eigen::VectorXd counts = Eigen::VectorXd::Zero(sum.rows());
  for (const MarkerPositions& shape : shapes) {
    for (Eigen::Index i = 0; i < shape.rows(); ++i) {
      if (!shape.row(i).allFinite()) continue;
      sum.row(i) += shape.row(i);
      counts[i] += 1;
    }
  }
  for (Eigen::Index i = 0; i < sum.rows(); ++i) sum.row(i) /= counts[i];  // never seen: 0 / 0 is NaN
  return sum;
}

}  // namespace

std::size_t sharedMarkers(const MarkerPositions& source, const MarkerPositions& target) {
  return source.rows() == target.rows() ? static_cast<std::size_t>(seenInBoth(source, target).sum()) : 0;
}

PoseFit fitPose(const MarkerPositions& source, const MarkerPositions& target, double robust_scale_mm, PoseScale scale) {
  const Eigen::VectorXd seen = seenInBoth(source, target);
  Eigen::VectorXd weights = seen, lengths = Eigen::VectorXd::Zero(seen.size());
  PoseFit fit;
  for (int round = 0; round < kRobustRounds; ++round) {
    fit = fitWeighted(source, target, weights, scale);
    for (Eigen::Index i = 0; i < seen.size(); ++i) {
      if (seen[i] <= 0) continue;
      lengths[i] = (fit(source.row(i).transpose()) - target.row(i).transpose()).norm();
      weights[i] = 1 / (1 + std::pow(lengths[i] / robust_scale_mm, 2));
    }
  }
  fit.squared_residuals_mm2 = lengths.squaredNorm();
  fit.shared_markers = static_cast<std::size_t>(seen.sum());
  return fit;
}

MarkerPositions meanShape(const std::vector<MarkerPositions>& shapes, std::size_t least_markers, double robust_scale_mm,
                          PoseScale scale) {
  const auto fullest = std::max_element(shapes.begin(), shapes.end(), [](const auto& a, const auto& b) {
    return sharedMarkers(a, a) < sharedMarkers(b, b);
  });
  if (fullest == shapes.end() || sharedMarkers(*fullest, *fullest) < least_markers) return MarkerPositions(0, 3);
  MarkerPositions mean = *fullest;
  for (int round = 0; round < kShapeRounds; ++round) {
    std::vector<MarkerPositions> fitted;
    double scale_sum = 0;
    for (const MarkerPositions& shape : shapes) {
      if (sharedMarkers(shape, mean) < least_markers) continue;
      const PoseFit fit = fitPose(shape, mean, robust_scale_mm, scale);
      fitted.push_back(moved(shape, fit));
      scale_sum += fit.scale;
    }
    // Without the division the mean would shrink round by round: a least-squares size is a little too small.
    mean = meanOfSeen(fitted) / (scale_sum / static_cast<double>(fitted.size()));
  }
  return mean;
}

MarkerPositions pickMarkers(const MarkerPositions& pose, const std::vector<std::size_t>& markers) {
  MarkerPositions picked(static_cast<Eigen::Index>(markers.size()), 3);
  for (std::size_t i = 0; i < markers.size(); ++i) {
    picked.row(static_cast<Eigen::Index>(i)) = pose.row(static_cast<Eigen::Index>(markers[i]));
  }
  return picked;
}

}  // namespace mouthpiece
