#include "motion/cleaning/repairs.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "base/errors.h"
#include "base/statistics.h"

namespace mouthpiece {
namespace {

/// A regression needs this many frames before it is worth more than the neighbours in time alone.
constexpr std::size_t kFewestTrainingFrames = 12;
/// The regression never trusts a marker further than this: half of what trackers reach at best.
constexpr double kSmallestNoiseMm = 0.02;
/// Deviations are looked at over this many memories on each side of the gap.
constexpr double kReachInMemories = 5.0;

/// Columns x y z of several markers.
std::vector<Eigen::Index> columnsOf(const std::vector<MarkerIndex>& markers) {
  std::vector<Eigen::Index> columns;
  for (const MarkerIndex marker : markers) {
    for (Eigen::Index axis = 0; axis < 3; ++axis) columns.push_back(signedIndex(3 * marker.value) + axis);
  }
  return columns;
}

/// Where a marker is, as other markers tell it: mean + (others - mean) * weights.
class MarkerRegression {
 public:
  /// `frames`: all markers were seen in them.
  MarkerRegression(const MotionClip& clip, MarkerIndex marker, const std::vector<MarkerIndex>& others,
                   const std::vector<Eigen::Index>& frames, double noise_mm)
      : columns_(columnsOf(others)) {
    const Eigen::MatrixXd inputs = clip.positions_mm(frames, columns_);
    const Eigen::MatrixXd outputs = clip.positions_mm(frames, columnsOf({marker}));
    input_mean_ = inputs.colwise().mean();
    output_mean_ = outputs.colwise().mean();
    const Eigen::MatrixXd centred = inputs.rowwise() - input_mean_;
    // Inputs are as noisy as the output: in the mean their noise adds exactly this to the diagonal.
    const double ridge = asReal(frames.size()) * noise_mm * noise_mm;
    if (centred.rows() < centred.cols()) {
      Eigen::MatrixXd gram = centred * centred.transpose();
      gram.diagonal().array() += ridge;
      weights_ = centred.transpose() * gram.llt().solve(outputs.rowwise() - output_mean_);
    } else {
      Eigen::MatrixXd gram = centred.transpose() * centred;
      gram.diagonal().array() += ridge;
      weights_ = gram.llt().solve(centred.transpose() * (outputs.rowwise() - output_mean_));
    }
  }

  [[nodiscard]] Eigen::RowVector3d at(const MotionClip& clip, Eigen::Index frame) const {
    const Eigen::RowVectorXd inputs = clip.positions_mm(frame, columns_);
    return output_mean_ + (inputs - input_mean_) * weights_;
  }

 private:
  std::vector<Eigen::Index> columns_;
  Eigen::RowVectorXd input_mean_;
  Eigen::RowVector3d output_mean_;
  Eigen::MatrixXd weights_;
};

/// Fills the gaps of one clip. Gaps are filled from seen samples only, so their order does not matter.
class GapFiller {
 public:
  GapFiller(const MotionClip& clip, const GapFillOptions& options, double noise_mm)
      : clip_(clip), options_(options), noise_mm_(std::max(noise_mm, kSmallestNoiseMm)) {}

  /// The marker's places in the gap, one row a frame; nullopt when the frames around it tell nothing.
  [[nodiscard]] std::optional<PositionMatrix> fill(const Gap& gap) const {
    const std::vector<Eigen::Index> around = framesAround(gap);
    const std::optional<MarkerRegression> regression = regressionFor(gap, around);
    const auto predicted = [&](Eigen::Index frame) -> Eigen::RowVector3d {
      return regression ? regression->at(clip_, frame) : Eigen::RowVector3d::Zero();
    };
    PositionMatrix deviations(signedIndex(around.size()), 3);
    for (std::size_t i = 0; i < around.size(); ++i) {
      deviations.row(signedIndex(i)) =
          clip_.position(FrameIndex(unsignedIndex(around[i])), gap.marker).transpose() - predicted(around[i]);
    }
    PositionMatrix filled = bridged(around, deviations, gap);
    for (Eigen::Index i = 0; i < filled.rows(); ++i) {
      filled.row(i) += predicted(gap.first.row() + i);
    }
    if (!filled.allFinite()) return std::nullopt;
    return filled;
  }

 private:
  [[nodiscard]] std::size_t reachFrames() const {
    return static_cast<std::size_t>(std::ceil(std::max(2.0, kReachInMemories * options_.memory * clip_.frame_rate_hz)));
  }

  /// Frames near the gap that saw the marker.
  [[nodiscard]] std::vector<Eigen::Index> framesAround(const Gap& gap) const {
    const std::size_t first = gap.first.value - std::min(gap.first.value, reachFrames());
    const std::size_t last = std::min(clip_.frameCount(), gap.last.value + reachFrames());
    std::vector<Eigen::Index> frames;
    for (std::size_t frame = first; frame < last; ++frame) {
      if (clip_.isSeen(FrameIndex(frame), gap.marker)) frames.push_back(signedIndex(frame));
    }
    return frames;
  }

  /// Learns the marker from those that were seen in and around the gap.
  [[nodiscard]] std::optional<MarkerRegression> regressionFor(const Gap& gap,
                                                              const std::vector<Eigen::Index>& around) const {
    std::vector<MarkerIndex> others;
    for (std::size_t m = 0; m < clip_.markerCount(); ++m) {
      const MarkerIndex other(m);
      if (other == gap.marker || !clip_.isSeenThroughout(other, gap.first, gap.last)) continue;
      const bool sees_around = std::all_of(around.begin(), around.end(), [&](Eigen::Index frame) {
        return clip_.isSeen(FrameIndex(unsignedIndex(frame)), other);
      });
      if (sees_around) others.push_back(other);
    }
    std::vector<Eigen::Index> frames;
    for (std::size_t frame = 0; frame < clip_.frameCount(); ++frame) {
      const bool sees_all = clip_.isSeen(FrameIndex(frame), gap.marker) &&
                            std::all_of(others.begin(), others.end(),
                                        [&](MarkerIndex other) { return clip_.isSeen(FrameIndex(frame), other); });
      if (sees_all) frames.push_back(signedIndex(frame));
    }
    if (others.empty() || frames.size() < kFewestTrainingFrames) return std::nullopt;
    return MarkerRegression(clip_, gap.marker, others, frames, noise_mm_);
  }

  /// The deviations over the window as a sum of cosines (DCT-II), each with the strength that a Matern 5/2 process with
  /// the memory as its length gives its frequency: the likeliest coefficients for the seen frames, read off in the gap.
  [[nodiscard]] PositionMatrix bridged(const std::vector<Eigen::Index>& frames, const PositionMatrix& deviations,
                                       const Gap& gap) const {
    const Eigen::Index first = std::min(frames.front(), gap.first.row());
    const Eigen::Index last = std::max(frames.back() + 1, gap.last.row());
    const Eigen::Index length = last - first;
    const auto count = signedIndex(frames.size());
    const Eigen::RowVector3d mean = deviations.colwise().mean();
    const PositionMatrix centred = deviations.rowwise() - mean;
    const double variance = std::max(centred.squaredNorm() / asReal(3 * count), noise_mm_ * noise_mm_);
    const Eigen::VectorXd strengths = variance * cosineStrengths(length);
    Eigen::MatrixXd seen(count, length);
    for (Eigen::Index i = 0; i < count; ++i) {
      seen.row(i) = cosines(frames[unsignedIndex(i)] - first, length);
    }
    // c = S A^T (A S A^T + noise^2 I)^-1 y.
    Eigen::MatrixXd gram = seen * strengths.asDiagonal() * seen.transpose();
    gram.diagonal().array() += noise_mm_ * noise_mm_;
    const Eigen::MatrixXd coefficients = strengths.asDiagonal() * seen.transpose() * gram.llt().solve(centred);
    PositionMatrix result(signedIndex(gap.last.value - gap.first.value), 3);
    for (Eigen::Index row = 0; row < result.rows(); ++row) {
      result.row(row) = mean + cosines(gap.first.row() + row - first, length) * coefficients;
    }
    return result;
  }

  /// Row `frame` of the orthonormal inverse DCT of `length` frames.
  [[nodiscard]] static Eigen::RowVectorXd cosines(Eigen::Index frame, Eigen::Index length) {
    const auto n = asReal(length);
    const double phase = std::numbers::pi * (asReal(frame) + 0.5) / n;
    Eigen::RowVectorXd row =
        std::sqrt(2.0 / n) * (phase * Eigen::ArrayXd::LinSpaced(length, 0.0, n - 1.0)).cos().matrix().transpose();
    row[0] = std::sqrt(1.0 / n);
    return row;
  }

  /// Spectrum of a Matern 5/2 process of variance one at the cosines' frequencies: (1 + (w l)^2 / 5)^-3, scaled.
  [[nodiscard]] Eigen::VectorXd cosineStrengths(Eigen::Index length) const {
    const auto n = asReal(length);
    const double memory_frames = clip_.frame_rate_hz * options_.memory;
    const Eigen::ArrayXd w = std::numbers::pi / n * Eigen::ArrayXd::LinSpaced(length, 0.0, n - 1.0);
    const Eigen::ArrayXd shape = (1.0 + (w * memory_frames).square() / 5.0).pow(-3.0);
    return (shape * (n / shape.sum())).matrix();
  }

  const MotionClip& clip_;
  const GapFillOptions& options_;
  double noise_mm_;
};

}  // namespace

std::vector<Gap> findGaps(const MotionClip& clip) {
  std::vector<Gap> gaps;
  for (std::size_t m = 0; m < clip.markerCount(); ++m) {
    bool was_seen = true;
    for (std::size_t frame = 0; frame < clip.frameCount(); ++frame) {
      const bool is_seen = clip.isSeen(FrameIndex(frame), MarkerIndex(m));
      if (!is_seen && was_seen) gaps.push_back({MarkerIndex(m), FrameIndex(frame), FrameIndex(frame)});
      if (!is_seen) gaps.back().last = FrameIndex(frame + 1);
      was_seen = is_seen;
    }
  }
  return gaps;
}

namespace {

double noiseOfColumns(const PositionMatrix& x, Eigen::Index first_column, Eigen::Index columns) {
  std::vector<double> differences;
  for (Eigen::Index frame = 3; frame < x.rows(); ++frame) {
    for (Eigen::Index column = first_column; column < first_column + columns; ++column) {
      const double third =
          x(frame, column) - 3.0 * x(frame - 1, column) + 3.0 * x(frame - 2, column) - x(frame - 3, column);
      if (std::isfinite(third)) differences.push_back(std::abs(third));
    }
  }
  // White noise s gives third differences of deviation s sqrt(1 + 9 + 9 + 1), and a median of 0.6745 of that.
  return median(std::move(differences), 0) / (0.6745 * std::sqrt(20.0));
}

}  // namespace

double estimateNoise(const MotionClip& clip) { return noiseOfColumns(clip.positions_mm, 0, clip.positions_mm.cols()); }

std::vector<double> estimateMarkerNoise(const MotionClip& clip) {
  std::vector<double> noise;
  for (std::size_t marker = 0; marker < clip.markerCount(); ++marker) {
    noise.push_back(noiseOfColumns(clip.positions_mm, signedIndex(3 * marker), 3));
  }
  return noise;
}

FilledMotion fillShortGaps(const MotionClip& clip, const GapFillOptions& options) {
  MOUTHPIECE_EXPECT(clip.frame_rate_hz > 0.0 && options.memory > 0.0);
  FilledMotion result{clip, {}};
  result.report.noise_mm = estimateNoise(clip);
  const GapFiller filler(clip, options, result.report.noise_mm);
  for (const Gap& gap : findGaps(clip)) {
    const auto length = asReal(gap.last.value - gap.first.value);
    const bool has_both_sides = gap.first.value > 0 && gap.last.value < clip.frameCount();
    std::optional<PositionMatrix> places;
    // A hair more than the limit, so that 0.25 s at 120 Hz are 30 frames whatever the rounding.
    if (has_both_sides && length <= options.longest * clip.frame_rate_hz + 1e-6) places = filler.fill(gap);
    if (!places) {
      result.report.left.push_back(gap);
      continue;
    }
    result.clip.positions_mm.block(gap.first.row(), signedIndex(3 * gap.marker.value), places->rows(), 3) = *places;
    result.report.filled.push_back(gap);
  }
  return result;
}

}  // namespace mouthpiece
