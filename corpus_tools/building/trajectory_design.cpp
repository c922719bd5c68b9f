#include "corpus_tools/building/trajectory_design.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "base/errors.h"
#include "base/matrix_solvers.h"

namespace mouthpiece {
namespace {

double speechWeight(const LayoutMarker& marker) {
  if (marker.region == "lip") return 2;
  if (marker.region == "chin" || marker.region == "cheek" || marker.region == "nose") return 1;
  if (marker.region == "jaw") return 0.4;  // the outline that the camera sees, not a fixed place of the skin
  return 0;
}

double ridgeFactor(const std::string& feature) {
  if (feature.starts_with("length viseme ") || feature.starts_with("phone ")) return 1;
  if (feature.starts_with("length phone ")) return 3;
  if (feature.starts_with("left2 ") || feature.starts_with("right2 ")) return 6;
  const bool has_neighbour =
      feature.find(" left ") != std::string::npos || feature.find(" right ") != std::string::npos;
  if (feature.starts_with("left ") || feature.starts_with("right ") || has_neighbour) return 3;
  return 0.05;  // visemes and silences
}

}  // namespace

SpeechColumns speechColumns(const Corpus& corpus) {
  SpeechColumns columns;
  columns.weights.resize(signedIndex(3 * corpus.layout.markers.size()));
  columns.lips = LipGauge(corpus.layout);
  for (std::size_t marker = 0; marker < corpus.layout.markers.size(); ++marker) {
    const LayoutMarker& own = corpus.layout.markers[marker];
    const auto column = signedIndex(3 * marker);
    const double weight = speechWeight(own);
    columns.weights.segment(column, 3).setConstant(weight);
    if (own.region == "lip") columns.lip_norm += weight * weight;
  }
  columns.lip_norm = std::sqrt(columns.lip_norm);
  return columns;
}

double FitTake::tightestOpening(const TimeSpan& span) const {
  constexpr Seconds kAround = 0.020;
  const Seconds spacing = times.size() > 1 ? times[1] - times[0] : 0.0;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t row = 0; row < times.size(); ++row) {
    const bool near = times[row] >= span.start - kAround - spacing && times[row] <= span.end + kAround + spacing;
    const auto at = signedIndex(row);
    if (near && seen(at) > 0) least = std::min(least, openings(at));
  }
  return least;
}

std::optional<FitTake> fitTake(const Corpus& corpus, std::size_t index, const SpeechColumns& columns,
                               double fit_rate_hz) {
  const MotionClip motion = motionOf(corpus, TakeIndex(index));
  const auto stride = static_cast<Eigen::Index>(std::max(1.0, std::round(motion.frame_rate_hz / fit_rate_hz)));
  const Eigen::Index rows = (motion.positions_mm.rows() + stride - 1) / stride;
  FitTake take;
  take.index = index;
  PositionMatrix positions(rows, motion.positions_mm.cols());
  take.seen.resize(rows);
  for (Eigen::Index row = 0; row < rows; ++row) {
    positions.row(row) = motion.positions_mm.row(row * stride);
    take.times.push_back(asReal(row * stride) / motion.frame_rate_hz);
    bool seen = true;
    for (Eigen::Index column = 0; column < positions.cols(); ++column) {
      const bool finite = std::isfinite(positions(row, column));
      seen = seen && (finite || !(columns.weights(column) > 0));
      if (!finite) positions(row, column) = 0;
    }
    take.seen(row) = seen ? 1 : 0;
  }
  constexpr double kLeastRows = 10;
  if (take.seen.sum() < std::max(kLeastRows, 0.5 * asReal(rows))) return std::nullopt;
  take.openings = Eigen::VectorXd::Zero(rows);
  if (columns.lips.hasLips()) {
    const std::vector<double> openings = columns.lips.overFrames(&LipGauge::opening, positions);
    take.openings = Eigen::Map<const Eigen::VectorXd>(openings.data(), rows).cwiseProduct(take.seen);
  }
  const Eigen::RowVectorXd mean = take.seen.transpose() * positions / std::max(1.0, take.seen.sum());
  const Eigen::Map<const Eigen::RowVectorXd> neutral(corpus.neutral_pose_mm.data(), corpus.neutral_pose_mm.size());
  take.mean = mean - neutral;
  take.displacements = (take.seen.asDiagonal() * (positions.rowwise() - mean)).cast<float>();
  return take;
}

FitTakes fitTakes(const Corpus& corpus, const SpeechColumns& columns, double fit_rate_hz, double most_frames) {
  double frames = 0;
  for (const CorpusTake& take : corpus.takes) frames += take.labels.duration() * fit_rate_hz;
  const auto every = static_cast<std::size_t>(std::max(1.0, std::ceil(frames / most_frames)));
  FitTakes kept{{}, every == 1};
  for (std::size_t i = 0; i < corpus.takes.size(); i += every) {
    if (std::optional<FitTake> take = fitTake(corpus, i, columns, fit_rate_hz)) kept.takes.push_back(std::move(*take));
  }
  return kept;
}

SegmentFeatures::SegmentFeatures(const Corpus& corpus, const std::vector<std::size_t>& takes, std::size_t most,
                                 const SilenceTiming& timing)
    : timing_(timing) {
  std::vector<std::size_t> segments;  // that have each
  for (const std::size_t take : takes) {
    for (const SpeechSegment& segment : predictionSegments(corpus.takes[take].labels, timing_)) {
      for (const SegmentFeature& feature : segment.features) {
        const auto [known, is_new] = numbers_.try_emplace(feature.name, count());
        if (is_new) names_.push_back(feature.name);
        segments.resize(names_.size());
        ++segments[unsignedIndex(known->second)];
      }
    }
  }
  if (names_.size() <= most) return;
  std::vector<std::size_t> order(names_.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return segments[a] > segments[b]; });
  order.resize(most);
  std::sort(order.begin(), order.end());
  std::vector<std::string> names;
  numbers_.clear();
  for (const std::size_t feature : order) {
    numbers_[names_[feature]] = signedIndex(names.size());
    names.push_back(std::move(names_[feature]));
  }
  names_ = std::move(names);
}

TakeSegments SegmentFeatures::of(const SpeechLabels& labels) const {
  TakeSegments take{predictionSegments(labels, timing_), {}};
  for (SpeechSegment& segment : take.segments) {
    SparseRow& share = take.shares.emplace_back();
    for (const SegmentFeature& feature : segment.features) {
      if (const auto known = numbers_.find(feature.name); known != numbers_.end())
        share.emplace_back(known->second, feature.weight);
    }
    segment.features = {};  // names are long
  }
  return take;
}

Eigen::VectorXd SegmentFeatures::ridgeFactors() const {
  Eigen::VectorXd factors(count());
  for (Eigen::Index i = 0; i < count(); ++i) factors(i) = ridgeFactor(name(i));
  return factors;
}

DesignRows designRows(const FitTake& take, const TakeSegments& segments, Eigen::Index features,
                      const ComponentDynamics& dynamics) {
  constexpr double kNothing = 1e-5;
  const Eigen::MatrixXd weights = segmentWeights(segments.segments, dynamics.time_constant, dynamics.lead, take.times);
  DesignRows design;
  design.rows.resize(take.times.size());
  design.mean = Eigen::VectorXd::Zero(features);
  design.seen = take.seen;
  const double frames = std::max(1.0, take.seen.sum());
  for (std::size_t row = 0; row < take.times.size(); ++row) {
    const auto at = signedIndex(row);
    if (!(take.seen(at) > 0)) continue;
    SparseRow& entries = design.rows[row];
    for (Eigen::Index segment = 0; segment < weights.cols(); ++segment) {
      const double weight = weights(at, segment);
      if (std::abs(weight) < kNothing) continue;
      for (const auto& [feature, share] : segments.shares[unsignedIndex(segment)]) {
        entries.emplace_back(feature, weight * share);
        design.mean(feature) += weight * share / frames;
      }
    }
  }
  return design;
}

Eigen::MatrixXd DesignRows::times(const Eigen::MatrixXd& targets) const {
  const Eigen::RowVectorXd level = mean.transpose() * targets;
  Eigen::MatrixXd values = Eigen::MatrixXd::Zero(signedIndex(rows.size()), targets.cols());
  for (std::size_t row = 0; row < rows.size(); ++row) {
    const auto at = signedIndex(row);
    if (!(seen(at) > 0)) continue;
    values.row(at) = -level;
    for (const auto& [feature, weight] : rows[row]) values.row(at) += weight * targets.row(feature);
  }
  return values;
}

NormalEquations::NormalEquations(Eigen::Index features, Eigen::Index components)
    : normal_(Eigen::MatrixXd::Zero(features, features)), right_(Eigen::MatrixXd::Zero(features, components)) {}

void NormalEquations::add(const DesignRows& design, const Eigen::MatrixXd& values) {
  for (std::size_t row = 0; row < design.rows.size(); ++row) {
    for (const auto& [a, weight_a] : design.rows[row]) {
      right_.row(a) += weight_a * values.row(signedIndex(row));
      for (const auto& [b, weight_b] : design.rows[row]) {
        if (b <= a) normal_(a, b) += weight_a * weight_b;
      }
    }
  }
  // Centring takes n m m' off; the values are centred already, so the right side needs nothing.
  std::vector<Eigen::Index> used;
  for (Eigen::Index i = 0; i < design.mean.size(); ++i) {
    if (design.mean(i) != 0) used.push_back(i);
  }
  const double frames = design.seen.sum();
  for (std::size_t i = 0; i < used.size(); ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      normal_(used[i], used[j]) -= frames * design.mean(used[i]) * design.mean(used[j]);
    }
  }
}

Eigen::MatrixXd NormalEquations::solve(const Eigen::MatrixXd& ridge) const {
  MOUTHPIECE_EXPECT(ridge.rows() == normal_.rows() && ridge.cols() == normal_.cols());
  return solveSymmetric(normal_ + ridge, right_);
}

}  // namespace mouthpiece
