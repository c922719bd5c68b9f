#include "motion/resample.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "base/errors.h"
#include "motion/blend.h"

namespace mouthpiece {
namespace {

/// The basis of eq. (1) over some samples: an inverse multiquadric at each and the terms 1, t of the polynomial. Basis
/// functions are divided by their value at the centre, which changes their weights and not the interpolant.
class TimeBasis {
 public:
  TimeBasis(std::span<const Seconds> times, std::span<const double> shapes) : times_(times), shapes_(shapes) {
    // Centre and scale make the polynomial columns as large as the others.
    middle_ = 0.5 * (times.front() + times.back());
    half_length_ = times.size() > 1 ? 0.5 * (times.back() - times.front()) : 1.0;
  }

  [[nodiscard]] Eigen::Index sampleCount() const { return static_cast<Eigen::Index>(times_.size()); }
  /// One sample alone has no slope: only the constant.
  [[nodiscard]] Eigen::Index termCount() const { return sampleCount() > 1 ? 2 : 1; }
  [[nodiscard]] Eigen::Index size() const { return sampleCount() + termCount(); }

  /// times x size(): all basis functions at all times.
  [[nodiscard]] Eigen::MatrixXd evaluate(std::span<const Seconds> at) const {
    Eigen::MatrixXd values(static_cast<Eigen::Index>(at.size()), size());
    const Eigen::Map<const Eigen::ArrayXd> time(at.data(), static_cast<Eigen::Index>(at.size()));
    for (Eigen::Index i = 0; i < sampleCount(); ++i) {
      const auto k = static_cast<std::size_t>(i);
      values.col(i) = (((time - times_[k]) / shapes_[k]).square() + 1.0).rsqrt().matrix();
    }
    values.col(sampleCount()).setOnes();
    if (termCount() > 1) values.col(sampleCount() + 1) = ((time - middle_) / half_length_).matrix();
    return values;
  }

  /// The square system whose rows are the interpolation conditions and the side conditions on the weights.
  [[nodiscard]] Eigen::MatrixXd system() const {
    Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(size(), size());
    matrix.topRows(sampleCount()) = evaluate(times_);
    matrix.bottomLeftCorner(termCount(), sampleCount()) =
        matrix.topRightCorner(sampleCount(), termCount()).transpose();
    return matrix;
  }

 private:
  std::span<const Seconds> times_;
  std::span<const double> shapes_;
  double middle_ = 0;
  double half_length_ = 1;
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

/// c_i, in seconds. The shorter spacing: a function as wide as the longer one would make a dense neighbourhood nearly
/// singular, and overshoot there.
std::vector<double> shapesOf(std::span<const Seconds> times, double shape) {
  std::vector<double> shapes(times.size(), 1.0);
  for (std::size_t i = 0; i < times.size() && times.size() > 1; ++i) {
    const double before = i > 0 ? times[i] - times[i - 1] : std::numeric_limits<double>::infinity();
    const double after = i + 1 < times.size() ? times[i + 1] - times[i] : std::numeric_limits<double>::infinity();
    shapes[i] = shape * std::min(before, after);
  }
  return shapes;
}

std::vector<Seconds> clamped(std::span<const Seconds> query_times, TimeSpan range) {
  std::vector<Seconds> times(query_times.begin(), query_times.end());
  for (Seconds& time : times) time = std::clamp(time, range.start, range.end);
  return times;
}

/// queries x samples: the rows that turn sample values into interpolated values, E A^-1 without its side conditions.
Eigen::MatrixXd cardinalWeights(const TimeBasis& basis, std::span<const Seconds> queries) {
  const Eigen::PartialPivLU<Eigen::MatrixXd> transposed_system(basis.system().transpose());
  const Eigen::MatrixXd weights = transposed_system.solve(basis.evaluate(queries).transpose());
  MOUTHPIECE_EXPECT(weights.allFinite());
  return weights.topRows(basis.sampleCount()).transpose();
}

/// A run of samples with its own system. It is blended in over `fade_in` and out over `fade_out`.
struct Window {
  std::size_t first_sample = 0;
  std::size_t sample_count = 0;
  TimeSpan fade_in;
  TimeSpan fade_out;

  [[nodiscard]] double weightAt(Seconds time) const {
    // One window fades out with g as the next fades in with 1 - g: together they weigh one.
    if (time < fade_in.end) return 1.0 - blendWeight(BlendKind::kSmooth, (time - fade_in.start) / fade_in.duration());
    if (time > fade_out.start) return blendWeight(BlendKind::kSmooth, (time - fade_out.start) / fade_out.duration());
    return 1.0;
  }
};

std::vector<Window> layWindows(std::span<const Seconds> times, const ResampleOptions& options) {
  constexpr double kNever = std::numeric_limits<double>::infinity();
  const std::size_t hop = options.window_samples - 2 * options.margin_samples - options.overlap_samples;
  std::vector<Window> windows;
  TimeSpan fade_in{-kNever, -kNever};
  for (std::size_t first = 0;; first += hop) {
    Window window{first, std::min(options.window_samples, times.size() - first), fade_in, {kNever, kNever}};
    const bool is_last = first + window.sample_count == times.size();
    if (!is_last) {
      const std::size_t fade = first + options.window_samples - options.margin_samples - options.overlap_samples;
      window.fade_out = {times[fade], times[fade + options.overlap_samples]};
    }
    windows.push_back(window);
    if (is_last) return windows;
    fade_in = window.fade_out;
  }
}

}  // namespace

MotionResampler::MotionResampler(std::span<const Seconds> sample_times, std::span<const Seconds> query_times,
                                 const ResampleOptions& options)
    : sample_count_(static_cast<Eigen::Index>(sample_times.size())), query_count_(static_cast<Eigen::Index>(query_times.size())) {
  expectTimes(sample_times, query_times, options);
  const std::vector<double> shapes = shapesOf(sample_times, options.shape);
  const std::vector<Seconds> queries = clamped(query_times, {sample_times.front(), sample_times.back()});
  for (const Window& window : layWindows(sample_times, options)) {
    const auto first = std::lower_bound(queries.begin(), queries.end(), window.fade_in.start);
    const auto last = std::upper_bound(first, queries.end(), window.fade_out.end);
    if (first == last) continue;
    const TimeBasis basis(sample_times.subspan(window.first_sample, window.sample_count),
                          std::span(shapes).subspan(window.first_sample, window.sample_count));
    Block block{first - queries.begin(), static_cast<Eigen::Index>(window.first_sample),
                cardinalWeights(basis, std::span(first, last))};
    for (Eigen::Index row = 0; row < block.weights.rows(); ++row) {
      block.weights.row(row) *= window.weightAt(queries[static_cast<std::size_t>(block.first_query + row)]);
    }
    blocks_.push_back(std::move(block));
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
  MOUTHPIECE_EXPECT(static_cast<std::size_t>(values.rows()) == sample_times.size());
  const std::vector<double> shapes = shapesOf(sample_times, options.shape);
  const TimeBasis basis(sample_times, shapes);
  Eigen::MatrixXd right_side = Eigen::MatrixXd::Zero(basis.size(), values.cols());
  right_side.topRows(values.rows()) = values;
  const Eigen::MatrixXd weights = Eigen::PartialPivLU<Eigen::MatrixXd>(basis.system()).solve(right_side);
  return basis.evaluate(clamped(query_times, {sample_times.front(), sample_times.back()})) * weights;
}

}  // namespace mouthpiece
