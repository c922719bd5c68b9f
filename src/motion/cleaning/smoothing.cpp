
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "base/errors.h"
#include "base/statistics.h"
#include "motion/cleaning/repairs.h"

namespace mouthpiece {
namespace {

/// Variance of the start position, velocity, acceleration before anything was seen, in units of the noise: as good as
/// unknown, and still far from losing the digits of what is known.
constexpr double kUnknown = 1e8;
/// No sample is moved further than noise explains (1 % of it is larger): the tip of a quick closure stays.
constexpr double kFarthestInNoises = 2.5;
constexpr double kMostOverMedian = 2.0;
/// A path of fewer samples is left as it is.
constexpr Eigen::Index kFewestSamples = 5;
/// Restlessness is searched on this grid: jerk noise per frame over measurement noise, as deviations.
constexpr double kSmallestRestlessness = 1e-3;
constexpr double kLargestRestlessness = 1e2;
constexpr int kRestlessnessSteps = 13;  // a factor of 2.6 each: the result hardly depends on it
/// A path is as restless as the filter is surprised: over so many frames, at most so many times.
constexpr Eigen::Index kSurpriseFrames = 5;
constexpr double kMostSurprise = 100;

/// Position, velocity, acceleration in units of one frame; white jerk.
Eigen::Matrix3d stepMatrix() { return Eigen::Matrix3d{{1.0, 1.0, 0.5}, {0.0, 1.0, 1.0}, {0.0, 0.0, 1.0}}; }
Eigen::Matrix3d jerkCovariance() {
  return Eigen::Matrix3d{
      {1.0 / 20.0, 1.0 / 8.0, 1.0 / 6.0}, {1.0 / 8.0, 1.0 / 3.0, 1.0 / 2.0}, {1.0 / 6.0, 1.0 / 2.0, 1.0}};
}

/// Kalman filter and smoother for measurements of noise one; NaN: not measured. Covariances depend only on which frames
/// were measured, so one run serves the three coordinates of a marker.
class JerkSmoother {
 public:
  using States = Eigen::Matrix3d;  ///< rows: position, velocity, acceleration; columns: x y z

  JerkSmoother(const Eigen::Ref<const PositionMatrix>& measured, double restlessness)
      : measured_(measured), noise_(restlessness * restlessness * jerkCovariance()) {}

  /// From now on the jerk before frame t is so many times as strong, a deviation for each frame.
  void setStrengths(Eigen::VectorXd strengths) { strengths_ = std::move(strengths); }

  /// Runs the filter; the measurements' -2 log-likelihood.
  double filter() {
    const Eigen::Matrix3d step = stepMatrix();
    predicted_.clear();
    filtered_.clear();
    predicted_covariance_.clear();
    filtered_covariance_.clear();
    surprise_.setOnes(measured_.rows());
    double cost = 0;
    States state = States::Zero();
    Eigen::Matrix3d covariance = kUnknown * Eigen::Matrix3d::Identity();
    int seen = 0;
    for (Eigen::Index frame = 0; frame < measured_.rows(); ++frame) {
      if (frame > 0) {
        state = step * state;
        const double strength = strengths_.size() > 0 ? strengths_[frame] : 1.0;
        covariance = step * covariance * step.transpose() + strength * strength * noise_;
      }
      predicted_.push_back(state);
      predicted_covariance_.push_back(covariance);
      if (measured_.row(frame).allFinite()) {
        const Eigen::RowVector3d innovation = measured_.row(frame) - state.row(0);
        const double variance = covariance(0, 0) + 1.0;
        const Eigen::Vector3d gain = covariance.col(0) / variance;
        state += gain * innovation;
        covariance -= gain * covariance.row(0);
        covariance = 0.5 * (covariance + covariance.transpose().eval());
        // The first three only fix the start.
        if (++seen > 3) surprise_[frame] = innovation.squaredNorm() / variance / 3.0;
        if (seen > 3) cost += innovation.squaredNorm() / variance + 3.0 * std::log(variance);
      }
      filtered_.push_back(state);
      filtered_covariance_.push_back(covariance);
    }
    return cost;
  }

  /// After filter(): squared innovations over what was expected of them, 1 in the mean where the model holds.
  [[nodiscard]] const Eigen::VectorXd& surprise() const { return surprise_; }

  /// After filter(): positions, frames x 3.
  [[nodiscard]] PositionMatrix smooth() const {
    PositionMatrix positions(measured_.rows(), 3);
    States state = filtered_.back();
    positions.row(positions.rows() - 1) = state.row(0);
    for (std::size_t frame = filtered_.size() - 1; frame-- > 0;) {
      // Gain C = P F^T (F P F^T + Q)^-1.
      const Eigen::Matrix3d gain =
          predicted_covariance_[frame + 1].ldlt().solve(stepMatrix() * filtered_covariance_[frame]).transpose();
      state = filtered_[frame] + gain * (state - predicted_[frame + 1]);
      positions.row(signedIndex(frame)) = state.row(0);
    }
    return positions;
  }

 private:
  Eigen::Ref<const PositionMatrix> measured_;
  Eigen::Matrix3d noise_;
  Eigen::VectorXd strengths_, surprise_;
  std::vector<States> predicted_, filtered_;
  std::vector<Eigen::Matrix3d> predicted_covariance_, filtered_covariance_;
};

/// The restlessness on the grid under which the marker's path is likeliest.
double likeliestRestlessness(const PositionMatrix& path) {
  double best = kLargestRestlessness;
  double best_cost = std::numeric_limits<double>::infinity();
  for (int i = 0; i < kRestlessnessSteps; ++i) {
    const double t = asReal(i) / (kRestlessnessSteps - 1);
    const double restlessness = kSmallestRestlessness * std::pow(kLargestRestlessness / kSmallestRestlessness, t);
    const double cost = JerkSmoother(path, restlessness).filter();
    if (cost < best_cost) {
      best_cost = cost;
      best = restlessness;
    }
  }
  return best;
}

/// How much stronger than likeliest the jerk is around each frame: the mean surprise there where it is over 1.
Eigen::VectorXd strengthsFor(const Eigen::VectorXd& surprise) {
  Eigen::VectorXd strengths(surprise.size());
  for (Eigen::Index frame = 0; frame < surprise.size(); ++frame) {
    const Eigen::Index first = std::max<Eigen::Index>(0, frame - kSurpriseFrames / 2);
    const Eigen::Index count = std::min(surprise.size(), frame + kSurpriseFrames / 2 + 1) - first;
    strengths[frame] = std::clamp(surprise.segment(first, count).mean(), 1.0, kMostSurprise);
  }
  return strengths;
}

/// The path with its noise taken off; what was not seen is estimated too.
PositionMatrix smoothedPath(const PositionMatrix& path, double noise_mm) {
  // Around the first seen sample, so that the unknown start is near, and in units of the noise.
  Eigen::Index first = 0;
  while (!path.row(first).allFinite()) ++first;
  const Eigen::RowVector3d origin = path.row(first);
  const PositionMatrix scaled = (path.rowwise() - origin) / noise_mm;
  JerkSmoother smoother(scaled, likeliestRestlessness(scaled));
  smoother.filter();
  // Lips stop within a frame or two when they meet: one restlessness for all would carry them on into each other.
  smoother.setStrengths(strengthsFor(smoother.surprise()));
  smoother.filter();
  return (noise_mm * smoother.smooth()).rowwise() + origin;
}

/// A marker that moves fast passes some of its motion for noise, so none counts as more than twice the median.
std::vector<double> noiseOfMarkers(const MotionClip& clip, const SmoothingOptions& options) {
  if (options.noise_mm > 0.0) return std::vector<double>(clip.markerCount(), options.noise_mm);
  std::vector<double> noise = estimateMarkerNoise(clip);
  const double most = kMostOverMedian * median(noise, 0);
  for (double& each : noise) each = std::min(each, most);
  return noise;
}

}  // namespace

SmoothedMotion smoothMotion(const MotionClip& clip, const SmoothingOptions& options) {
  MOUTHPIECE_EXPECT(options.noise_mm >= 0.0);
  SmoothedMotion result{clip, options.noise_mm, noiseOfMarkers(clip, options), 0.0};
  if (result.noise_mm <= 0.0) result.noise_mm = median(result.marker_noise_mm, 0);
  double squared_change = 0;
  double samples = 0;
  for (Eigen::Index column = 0; column + 2 < clip.positions_mm.cols(); column += 3) {
    const PositionMatrix path = clip.positions_mm.middleCols<3>(column);
    const auto seen = (path.array() == path.array()).rowwise().all().eval();
    const double noise_mm = result.marker_noise_mm[unsignedIndex(column / 3)];
    if (seen.count() < kFewestSamples || noise_mm <= 0.0) continue;
    const PositionMatrix smooth = smoothedPath(path, noise_mm);
    const double farthest = kFarthestInNoises * noise_mm;
    for (Eigen::Index frame = 0; frame < path.rows(); ++frame) {
      if (!seen[frame]) continue;
      const Eigen::RowVector3d change = (smooth.row(frame) - path.row(frame)).cwiseMin(farthest).cwiseMax(-farthest);
      result.clip.positions_mm.block<1, 3>(frame, column) += change;
      squared_change += change.squaredNorm();
      samples += 3.0;
    }
  }
  if (samples > 0) result.rms_change_mm = std::sqrt(squared_change / samples);
  return result;
}

}  // namespace mouthpiece
