#include "motion/resample.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "base/errors.h"
#include "base/index.h"
#include "motion/blend.h"

namespace mouthpiece {
namespace {

/// S(t): the smooth rising curve with S(time of sample i) = i, a monotone cubic (Fritsch and Carlson 1980). Where the
/// samples are even it is a straight line; where a warp changes their spacing, a smooth bend.
class IndexOfTime {
 public:
  explicit IndexOfTime(std::span<const Seconds> times) : times_(times) {
    slopes_.reserve(times.size());
    for (std::size_t i = 0; i < times.size(); ++i) {
      const bool is_end = i == 0 || i + 1 == times.size();
      slopes_.push_back(is_end ? 0.0 : innerSlope(times[i] - times[i - 1], times[i + 1] - times[i]));
    }
    if (times.size() < 2) return;
    slopes_.front() = 1.0 / (times[1] - times[0]);
    slopes_.back() = 1.0 / (times[times.size() - 1] - times[times.size() - 2]);
  }

  /// Outside the samples: the nearest end.
  [[nodiscard]] double at(Seconds time) const {
    if (time <= times_.front()) return 0.0;
    if (time >= times_.back()) return asReal(times_.size() - 1);
    const auto right = unsignedIndex(std::upper_bound(times_.begin(), times_.end(), time) - times_.begin());
    const std::size_t i = right - 1;
    const double spacing = times_[right] - times_[i];
    const double u = (time - times_[i]) / spacing;
    // Cubic Hermite from i to i + 1.
    const double rise =
        u * u * (3.0 - 2.0 * u) + spacing * u * (1.0 - u) * ((1.0 - u) * slopes_[i] - u * slopes_[right]);
    return asReal(i) + rise;
  }

 private:
  /// The weighted harmonic mean of 1/before and 1/after, which keeps the cubic rising.
  static double innerSlope(double before, double after) {
    const double weight_before = before + 2.0 * after;
    const double weight_after = 2.0 * before + after;
    return (weight_before + weight_after) / (weight_before * before + weight_after * after);
  }

  std::span<const Seconds> times_;
  std::vector<double> slopes_;
};

void expectTimes(std::span<const Seconds> sample_times, std::span<const Seconds> query_times,
                 const ResampleOptions& options) {
  MOUTHPIECE_EXPECT(!sample_times.empty());
  for (std::size_t i = 0; i < sample_times.size(); ++i) {
    MOUTHPIECE_EXPECT(std::isfinite(sample_times[i]) && (i == 0 || sample_times[i - 1] < sample_times[i]));
  }
  for (std::size_t i = 0; i < query_times.size(); ++i) {
    MOUTHPIECE_EXPECT(std::isfinite(query_times[i]) && (i == 0 || query_times[i - 1] <= query_times[i]));
  }
  MOUTHPIECE_EXPECT(options.shape > 0.0);
  MOUTHPIECE_EXPECT(options.window_samples > 2 * options.margin_samples + options.overlap_samples);
}

std::vector<double> indexPositions(std::span<const Seconds> sample_times, std::span<const Seconds> query_times) {
  const IndexOfTime index_of_time(sample_times);
  std::vector<double> positions;
  positions.reserve(query_times.size());
  for (const Seconds time : query_times) positions.push_back(index_of_time.at(time));
  return positions;
}

/// The samples and, beyond either end, mirrored ones (2 y0 - yk at -k): without them the interpolant's first and last
/// spacing would hang on how the far samples bend the polynomial.
struct MirroredSamples {
  Eigen::Index sample_count = 0;
  Eigen::Index mirrored_count = 0;  ///< at each end

  MirroredSamples(std::size_t count, const ResampleOptions& options)
      : sample_count(signedIndex(count)), mirrored_count(signedIndex(std::min(options.margin_samples, count - 1))) {}

  [[nodiscard]] Eigen::Index count() const { return sample_count + 2 * mirrored_count; }
  /// What entry `index` of count() is made of: the end sample twice and one inner sample taken off, or one sample.
  struct Parts {
    std::optional<Eigen::Index> end;
    Eigen::Index inner = 0;
  };
  [[nodiscard]] Parts partsOf(Eigen::Index index) const {
    const Eigen::Index sample = index - mirrored_count;
    if (sample < 0) return {0, -sample};
    if (sample >= sample_count) return {sample_count - 1, 2 * (sample_count - 1) - sample};
    return {std::nullopt, sample};
  }
};

/// positions x (count + terms): inverse multiquadrics at 0 ... count - 1, in units of the spacing and divided by their
/// value at the centre, then the polynomial 1, x (only 1 for a single centre), scaled to the size of the others.
Eigen::MatrixXd basisAt(std::span<const double> positions, double first_center, Eigen::Index count, double shape) {
  const Eigen::Index terms = count > 1 ? 2 : 1;
  Eigen::MatrixXd values(signedIndex(positions.size()), count + terms);
  const Eigen::ArrayXd x =
      Eigen::Map<const Eigen::ArrayXd>(positions.data(), signedIndex(positions.size())) - first_center;
  for (Eigen::Index i = 0; i < count; ++i) {
    values.col(i) = (((x - asReal(i)) / shape).square() + 1.0).sqrt().inverse().matrix();
  }
  values.col(count).setOnes();
  const double half = 0.5 * asReal(count - 1);
  if (terms > 1) values.col(count + 1) = ((x - half) / half).matrix();
  return values;
}

/// The symmetric system of the interpolation conditions and the side conditions on the weights.
Eigen::MatrixXd systemOf(Eigen::Index count, double shape) {
  std::vector<double> centers;
  for (Eigen::Index i = 0; i < count; ++i) centers.push_back(asReal(i));
  const Eigen::MatrixXd conditions = basisAt(centers, 0.0, count, shape);
  const Eigen::Index terms = conditions.cols() - count;
  Eigen::MatrixXd system = Eigen::MatrixXd::Zero(conditions.cols(), conditions.cols());
  system.topRows(count) = conditions;
  system.bottomLeftCorner(terms, count) = conditions.rightCols(terms).transpose();
  return system;
}

/// A window's factored system. In the index coordinate all windows of one length share it.
class WindowSystem {
 public:
  WindowSystem(Eigen::Index count, double shape) : count_(count), shape_(shape), factors_(systemOf(count, shape)) {}

  [[nodiscard]] Eigen::Index count() const { return count_; }
  /// positions x count: the rows that turn sample values into interpolated values, the first rows of A^-1 E^T.
  [[nodiscard]] Eigen::MatrixXd weightsAt(std::span<const double> positions, double first_center) const {
    const Eigen::MatrixXd basis = basisAt(positions, first_center, count_, shape_);
    return factors_.solve(basis.transpose()).topRows(count_).transpose();
  }

 private:
  Eigen::Index count_;
  double shape_;
  Eigen::PartialPivLU<Eigen::MatrixXd> factors_;
};

/// A run of (mirrored) samples with a system of its own, in index coordinates.
struct Window {
  Eigen::Index first = 0;
  Eigen::Index count = 0;
  double fade_in = -std::numeric_limits<double>::infinity();  ///< blended in from here, over the overlap
  double fade_out = std::numeric_limits<double>::infinity();
  double overlap = 1;

  [[nodiscard]] double weightAt(double position) const {
    // A window fades out with g while the next fades in with 1 - g: together they weigh one.
    if (position < fade_in + overlap) return 1.0 - blendWeight(BlendKind::kSmooth, (position - fade_in) / overlap);
    return blendWeight(BlendKind::kSmooth, (position - fade_out) / overlap);
  }
};

std::vector<Window> layWindows(const MirroredSamples& samples, const ResampleOptions& options) {
  const auto length = signedIndex(options.window_samples);
  const auto margin = signedIndex(options.margin_samples);
  const auto overlap = signedIndex(options.overlap_samples);
  std::vector<Window> windows;
  Window window;
  window.overlap = asReal(overlap);
  for (Eigen::Index first = 0;; first += length - 2 * margin - overlap) {
    window.first = first;
    window.count = std::min(length, samples.count() - first);
    const bool is_last = first + window.count == samples.count();
    const auto fade = asReal(first + length - margin - overlap - samples.mirrored_count);
    window.fade_out = is_last ? std::numeric_limits<double>::infinity() : fade;
    windows.push_back(window);
    if (is_last) return windows;
    window.fade_in = fade;
  }
}

/// Weights of a window's (mirrored) samples as weights of the samples themselves, and the first of these.
std::pair<Eigen::Index, PositionMatrix> foldMirrored(const MirroredSamples& samples, const Window& window,
                                                     const Eigen::MatrixXd& weights) {
  Eigen::Index lowest = samples.sample_count;
  Eigen::Index highest = -1;
  for (Eigen::Index i = 0; i < window.count; ++i) {
    const MirroredSamples::Parts parts = samples.partsOf(window.first + i);
    lowest = std::min({lowest, parts.inner, parts.end.value_or(parts.inner)});
    highest = std::max({highest, parts.inner, parts.end.value_or(parts.inner)});
  }
  PositionMatrix folded = PositionMatrix::Zero(weights.rows(), highest - lowest + 1);
  for (Eigen::Index i = 0; i < window.count; ++i) {
    const MirroredSamples::Parts parts = samples.partsOf(window.first + i);
    folded.col(parts.inner - lowest) += (parts.end ? -1.0 : 1.0) * weights.col(i);
    if (parts.end) folded.col(*parts.end - lowest) += 2.0 * weights.col(i);
  }
  return {lowest, std::move(folded)};
}

}  // namespace

MotionResampler::MotionResampler(std::span<const Seconds> sample_times, std::span<const Seconds> query_times,
                                 const ResampleOptions& options)
    : sample_count_(signedIndex(sample_times.size())), query_count_(signedIndex(query_times.size())) {
  expectTimes(sample_times, query_times, options);
  const std::vector<double> positions = indexPositions(sample_times, query_times);
  const MirroredSamples samples(sample_times.size(), options);
  std::optional<WindowSystem> system;
  for (const Window& window : layWindows(samples, options)) {
    const auto first = std::lower_bound(positions.begin(), positions.end(), window.fade_in);
    const auto last = std::upper_bound(first, positions.end(), window.fade_out + window.overlap);
    if (first == last) continue;
    if (!system || system->count() != window.count) system.emplace(window.count, options.shape);
    const auto own =
        std::span(positions).subspan(unsignedIndex(first - positions.begin()), unsignedIndex(last - first));
    Eigen::MatrixXd weights = system->weightsAt(own, asReal(window.first - samples.mirrored_count));
    for (Eigen::Index row = 0; row < weights.rows(); ++row) {
      weights.row(row) *= window.weightAt(own[unsignedIndex(row)]);
    }
    auto [first_sample, folded] = foldMirrored(samples, window, weights);
    blocks_.push_back({first - positions.begin(), first_sample, std::move(folded)});
  }
}

PositionMatrix MotionResampler::apply(const Eigen::Ref<const PositionMatrix>& values) const {
  MOUTHPIECE_EXPECT(values.rows() == sample_count_);
  PositionMatrix result = PositionMatrix::Zero(query_count_, values.cols());
  for (const Block& block : blocks_) {
    result.middleRows(block.first_query, block.weights.rows()).noalias() +=
        block.weights * values.middleRows(block.first_sample, block.weights.cols());
  }
  return result;
}

PositionMatrix resampleDense(std::span<const Seconds> sample_times, const Eigen::Ref<const PositionMatrix>& values,
                             std::span<const Seconds> query_times, const ResampleOptions& options) {
  expectTimes(sample_times, query_times, options);
  MOUTHPIECE_EXPECT(unsignedIndex(values.rows()) == sample_times.size());
  const MirroredSamples samples(sample_times.size(), options);
  const Eigen::MatrixXd system = systemOf(samples.count(), options.shape);
  Eigen::MatrixXd right_side = Eigen::MatrixXd::Zero(system.rows(), values.cols());
  for (Eigen::Index i = 0; i < samples.count(); ++i) {
    const MirroredSamples::Parts parts = samples.partsOf(i);
    right_side.row(i) = values.row(parts.inner);
    if (parts.end) right_side.row(i) = 2.0 * values.row(*parts.end) - values.row(parts.inner);
  }
  const Eigen::MatrixXd weights = Eigen::PartialPivLU<Eigen::MatrixXd>(system).solve(right_side);
  return basisAt(indexPositions(sample_times, query_times), -asReal(samples.mirrored_count), samples.count(),
                 options.shape) *
         weights;
}

}  // namespace mouthpiece
