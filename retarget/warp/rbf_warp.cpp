#include "retarget/warp/rbf_warp.h"

#include <Eigen/LU>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "base/errors.h"

namespace mouthpiece {
namespace {

/// Tried when WarpOptions::shape_factor is 0. Wider kernels than the last make the system ill-conditioned at 66
/// markers.
constexpr std::array kShapeFactorCandidates{0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0};

/// Tried where the kernel is chosen, too: places clicked by hand, and those that were found from them, are millimetres
/// off, and a warp that meets each exactly stretches what lies between.
constexpr std::array kRegularizationCandidates{0.0, 0.001, 0.003, 0.01, 0.03, 0.1};

/// Another kernel than the paper's has to earn it: its leave-one-out error must be below this share.
constexpr double kClearlyBetter = 0.97;

double meanNearestNeighbourDistance(const MarkerPositions& points) {
  double sum = 0;
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    double nearest = std::numeric_limits<double>::infinity();
    for (Eigen::Index j = 0; j < points.rows(); ++j) {
      if (j != i) nearest = std::min(nearest, (points.row(i) - points.row(j)).norm());
    }
    sum += nearest;
  }
  return sum / asReal(points.rows());
}

RbfOptions kernelOptions(const WarpOptions& options, double spacing) {
  return {.kernel = options.kernel,
          .polynomial = RbfPolynomial::kLinear,
          .shape = options.shape_factor * spacing,
          .regularization = options.regularization};
}

struct Candidate {
  WarpOptions options;
  double rms = std::numeric_limits<double>::infinity();
  bool folds = true;

  /// `share`: by how much the error must be less.
  [[nodiscard]] bool isBetterThan(const Candidate& other, double share) const {
    return folds == other.folds ? rms < share * other.rms : other.folds;
  }
};

/// Whether the warp turns space inside out at a marker. A target that is the actor's mirror image is negative
/// everywhere: what counts is the sign in the markers' middle.
bool foldsAtMarkers(const MarkerPositions& source, const MarkerPositions& target, const RbfOptions& kernel) {
  const RbfInterpolant warp = RbfInterpolant::fit(source, target, kernel);
  const auto determinantAt = [&](const Eigen::RowVector3d& point) {
    return Eigen::Matrix3d(warp.jacobian(point)).determinant();
  };
  const double usual = determinantAt(source.colwise().mean());
  for (Eigen::Index i = 0; i < source.rows(); ++i) {
    if (!(determinantAt(source.row(i)) * usual > 0)) return true;
  }
  return false;
}

/// The shape factor, for kernels that have one, and where any kernel may be taken the regularisation with the least
/// leave-one-out error, of those that `options` leaves open; rather of those that do not fold.
Candidate bestOf(const MarkerPositions& source, const MarkerPositions& target, WarpOptions options) {
  const auto open = [](bool is_open, double given, std::span<const double> candidates) {
    return is_open ? std::vector<double>(candidates.begin(), candidates.end()) : std::vector<double>{given};
  };
  const bool has_shape = options.kernel == RbfKernel::kInverseMultiquadric;
  if (!has_shape && options.shape_factor == 0) options.shape_factor = 1;
  const double given = options.regularization;
  const double spacing = meanNearestNeighbourDistance(source);
  Candidate best;
  for (const double factor : open(options.shape_factor == 0, options.shape_factor, kShapeFactorCandidates)) {
    for (const double smooth : open(options.any_kernel && given == 0, given, kRegularizationCandidates)) {
      options.shape_factor = factor;
      options.regularization = smooth;
      Candidate next{options, leaveOneOutRms(source, target, options), false};
      if (!next.isBetterThan(best, 1)) continue;
      next.folds = foldsAtMarkers(source, target, kernelOptions(options, spacing));
      if (next.isBetterThan(best, 1)) best = next;
    }
  }
  return best;
}

WarpOptions chooseKernel(const MarkerPositions& source, const MarkerPositions& target, WarpOptions options) {
  if (!options.any_kernel && options.shape_factor > 0) return options;
  options.kernel = options.any_kernel ? RbfKernel::kInverseMultiquadric : options.kernel;
  Candidate best = bestOf(source, target, options);
  if (options.any_kernel) {
    for (const RbfKernel kernel : {RbfKernel::kBiharmonic, RbfKernel::kTriharmonic}) {
      options.kernel = kernel;
      const Candidate other = bestOf(source, target, options);
      if (other.isBetterThan(best, kClearlyBetter)) best = other;
    }
  }
  best.options.any_kernel = false;
  return best.options;
}

}  // namespace

std::span<const double> regularizationCandidates() { return kRegularizationCandidates; }

RbfWarp RbfWarp::fit(const MarkerPositions& actor_neutral_mm, const MarkerPositions& target,
                     const WarpOptions& options) {
  MOUTHPIECE_EXPECT(actor_neutral_mm.rows() == target.rows());
  if (actor_neutral_mm.rows() < 8) throw InputError("found fewer than 8 markers; expected enough to span a face");
  if (!actor_neutral_mm.allFinite() || !target.allFinite())
    throw InputError("found a marker without a place; expected finite numbers");

  const WarpOptions chosen = chooseKernel(actor_neutral_mm, target, options);
  RbfWarp warp(RbfInterpolant::fit(actor_neutral_mm, target,
                                   kernelOptions(chosen, meanNearestNeighbourDistance(actor_neutral_mm))),
               target);
  warp.options_ = chosen;
  warp.summary_.shape_factor = chosen.shape_factor;
  const Eigen::VectorXd errors = (warp.targetFromActor(actor_neutral_mm) - target).rowwise().norm();
  warp.summary_.landmark_max = errors.maxCoeff();
  warp.summary_.landmark_rms = std::sqrt(errors.squaredNorm() / asReal(errors.size()));
  return warp;
}

MarkerPositions RbfWarp::targetFromActor(const MarkerPositions& points_mm) const {
  return interpolant_.evaluate(points_mm);
}

PositionMatrix RbfWarp::targetFromActorRelative(const PositionMatrix& frames_mm,
                                                const MarkerPositions& actor_neutral_mm) const {
  const Eigen::Index markers = target_.rows();
  MOUTHPIECE_EXPECT(frames_mm.cols() == 3 * markers && actor_neutral_mm.rows() == markers);
  PositionMatrix result(frames_mm.rows(), 3 * markers);
  if (frames_mm.rows() == 0) return result;
  // x y z side by side, row after row: the same memory is (frames * markers) x 3 points.
  const Eigen::Map<const MarkerPositions> points(frames_mm.data(), frames_mm.rows() * markers, 3);
  const MarkerPositions mapped = interpolant_.evaluate(points);
  const MarkerPositions offset = target_ - interpolant_.evaluate(actor_neutral_mm);
  const Eigen::Map<const Eigen::RowVectorXd> offset_row(offset.data(), 3 * markers);
  result = Eigen::Map<const PositionMatrix>(mapped.data(), frames_mm.rows(), 3 * markers);
  result.rowwise() += offset_row;
  return result;
}

double leaveOneOutRms(const MarkerPositions& actor_neutral_mm, const MarkerPositions& target,
                      const WarpOptions& options) {
  MOUTHPIECE_EXPECT(options.shape_factor > 0);
  const RbfOptions kernel = kernelOptions(options, meanNearestNeighbourDistance(actor_neutral_mm));
  return RbfInterpolant::leaveOneOutErrors(actor_neutral_mm, target, kernel).norm() /
         std::sqrt(asReal(actor_neutral_mm.rows()));
}

Eigen::Matrix3d RbfWarp::jacobian(const Eigen::Vector3d& point_mm) const {
  return interpolant_.jacobian(point_mm.transpose());
}

}  // namespace mouthpiece
