#include "corpus_tools/takes/pose_fit.h"

#include <algorithm>

namespace mouthpiece {
namespace {

constexpr int kShapeRounds = 8;
/// A size changes the fit's weights a little, they the size: settled after two rounds.
constexpr int kScaleRounds = 2;

bool seenInBoth(const MarkerPositions& source, const MarkerPositions& target, Eigen::Index row) {
  return source.row(row).allFinite() && target.row(row).allFinite();
}

MarkerPositions seenRows(const MarkerPositions& points, const MarkerPositions& other) {
  std::vector<Eigen::Index> rows;
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    if (seenInBoth(points, other, i)) rows.push_back(i);
  }
  return points(rows, Eigen::all);
}

/// The factor on `source` that, after its rotation, brings it nearest to `target`.
double bestScale(const MarkerPositions& source, const MarkerPositions& target, const RigidMotion& motion) {
  MarkerPositions from = seenRows(source, target) * motion.rotation.transpose();
  MarkerPositions to = seenRows(target, source);
  from.rowwise() -= from.colwise().mean().eval();
  to.rowwise() -= to.colwise().mean().eval();
  return from.cwiseProduct(to).sum() / from.squaredNorm();
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
  if (source.rows() != target.rows()) return 0;
  std::size_t shared = 0;
  for (Eigen::Index i = 0; i < source.rows(); ++i) shared += seenInBoth(source, target, i) ? 1U : 0U;
  return shared;
}

std::optional<PoseFit> fitPose(const MarkerPositions& source, const MarkerPositions& target, PoseScale scale,
                               const RigidFitOptions& options) {
  std::optional<RigidMotion> motion = fitRigidMotion(source, target, options);
  PoseFit fit;
  for (int round = 0; motion && scale == PoseScale::kFree && round < kScaleRounds; ++round) {
    fit.scale = bestScale(source, target, *motion);
    motion = fitRigidMotion(fit.scale * source, target, options);
  }
  if (!motion) return std::nullopt;
  fit.target_from_source = *motion;
  MarkerPositions residuals = fit.scale * seenRows(source, target);
  transform(residuals, *motion);
  residuals -= seenRows(target, source);
  fit.squared_residuals_mm2 = residuals.squaredNorm();
  fit.shared_markers = unsignedIndex(residuals.rows());
  return fit;
}

MarkerPositions meanShape(const std::vector<MarkerPositions>& shapes, std::size_t least_markers, PoseScale scale) {
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
      const std::optional<PoseFit> fit = fitPose(shape, mean, scale);
      if (!fit) continue;
      fitted.push_back(fit->scale * shape);
      transform(fitted.back(), fit->target_from_source);
      scale_sum += fit->scale;
    }
    if (fitted.empty()) return MarkerPositions(0, 3);  // all markers on one line
    // Without the division the mean would shrink round by round: a least-squares size is a little too small.
    mean = meanOfSeen(fitted) / (scale_sum / asReal(fitted.size()));
  }
  return mean;
}

MarkerPositions pickMarkers(const MarkerPositions& pose, const std::vector<std::size_t>& markers) {
  return pose(markers, Eigen::all);
}

void transform(MarkerPositions& pose, const RigidMotion& target_from_source) {
  pose = ((pose * target_from_source.rotation.transpose()).rowwise() + target_from_source.translation_mm.transpose())
             .eval();
}

void transform(MotionClip& clip, const RigidMotion& target_from_source) {
  // A row-major frames x (3 * markers) matrix is, read through, one row of three a marker.
  Eigen::Map<MarkerPositions> points(clip.positions_mm.data(), clip.positions_mm.size() / 3, 3);
  points =
      ((points * target_from_source.rotation.transpose()).rowwise() + target_from_source.translation_mm.transpose())
          .eval();
}

}  // namespace mouthpiece
