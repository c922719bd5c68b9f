#include "units/prediction/phone_shapes.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace mouthpiece {
namespace {

constexpr Seconds kSilenceLookedAt = 0.300;

constexpr std::int16_t kUnseen = std::numeric_limits<std::int16_t>::min();
constexpr float kLargestStep = std::numeric_limits<std::int16_t>::max();
constexpr float kNothingMm = 1e-20F;  ///< a range under this is none: its inverse must stay a number

float largestOf(const PhoneShapes::Matrix& values) {
  float largest = 0;
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    const float size = std::abs(values.data()[i]);
    if (size > largest) largest = size;  // NaN is not
  }
  return largest;
}

PhoneShapes::Matrix packed(const Eigen::MatrixXd& values, std::size_t phones, Eigen::Index components) {
  PhoneShapes::Matrix matrix(signedIndex(phones), PhoneShapes::kPoints * components);
  for (Eigen::Index row = 0; row < values.rows(); ++row) {
    matrix.block(row / PhoneShapes::kPoints, row % PhoneShapes::kPoints * components, 1, components) =
        values.row(row).leftCols(components).cast<float>();
  }
  return matrix;
}

}  // namespace

Eigen::Index shapeComponents(const TrajectoryModel& model) {
  return std::min(model.componentCount(), PhoneShapes::kMostComponents);
}

std::vector<Seconds> shapeTimes(const SpeechLabels& labels) {
  std::vector<Seconds> times;
  for (std::size_t i = 0; i < labels.phones.size(); ++i) {
    TimeSpan span = labels.phones[i].span;
    if (labels.phones[i].phone == Phone::kSil && i == 0) span.start = std::max(span.start, span.end - kSilenceLookedAt);
    if (labels.phones[i].phone == Phone::kSil && i > 0) span.end = std::min(span.end, span.start + kSilenceLookedAt);
    for (Eigen::Index point = 0; point < PhoneShapes::kPoints; ++point) {
      const double u = (asReal(point) + 0.5) / static_cast<double>(PhoneShapes::kPoints);
      times.push_back(span.start + u * span.duration());
    }
  }
  return times;
}

PredictedLine::PredictedLine(const TrajectoryModel& model, const SpeechLabels& labels, LinePrediction::Keeps keeps)
    : at_times(model, labels, keeps),
      shapes(packed(at_times.at(shapeTimes(labels)), labels.phones.size(), shapeComponents(model))) {}

PhoneShapes::Matrix predictedShapes(const TrajectoryModel& model, const SpeechLabels& labels) {
  return PredictedLine(model, labels, LinePrediction::Keeps::kNothing).shapes;
}

PhoneShapes phoneShapes(const TrajectoryModel& model, const SpeechLabels& labels, const MotionClip& motion,
                        const MarkerPositions& neutral_mm, const LipGauge& lips) {
  const Eigen::Map<const Eigen::RowVectorXd> neutral(neutral_mm.data(), neutral_mm.size());
  const std::vector<Seconds> times = shapeTimes(labels);
  const Eigen::Index components = shapeComponents(model);
  // A marker that the components do not look at may be missing.
  Eigen::MatrixXd values(motion.positions_mm.rows(), components);
  for (Eigen::Index frame = 0; frame < values.rows(); ++frame) {
    Eigen::RowVectorXd pose = motion.positions_mm.row(frame) - neutral;
    for (Eigen::Index column = 0; column < pose.size(); ++column) {
      if (std::isnan(pose(column)) && (model.analysis.row(column).array() == 0).all()) pose(column) = 0;
    }
    values.row(frame) = pose * model.analysis.leftCols(components);
  }
  Eigen::MatrixXd at_points(signedIndex(times.size()), components);
  const auto last = asReal(motion.frameCount() - 1);
  for (std::size_t i = 0; i < times.size(); ++i) {
    const double frame = std::clamp(times[i] * motion.frame_rate_hz, 0.0, last);
    const auto before = static_cast<Eigen::Index>(frame);
    const Eigen::Index after = std::min<Eigen::Index>(before + 1, values.rows() - 1);
    const double part = frame - asReal(before);
    at_points.row(signedIndex(i)) = (1 - part) * values.row(before) + part * values.row(after);
  }
  PhoneShapes shapes;
  shapes.captured = packed(at_points, labels.phones.size(), components);
  shapes.predicted = predictedShapes(model, labels);
  shapes.tightest_mm.assign(labels.phones.size(), std::numeric_limits<float>::quiet_NaN());
  if (!lips.hasLips()) return shapes;
  for (std::size_t i = 0; i < labels.phones.size(); ++i)
    shapes.tightest_mm[i] = asFloat(lips.tightest(motion, labels.phones[i].span));
  return shapes;
}

PackedShapes::PackedShapes(const PhoneShapes& shapes, std::size_t first, std::size_t count)
    : tightest_mm_(shapes.tightest_mm.begin() + signedIndex(first),
                   shapes.tightest_mm.begin() + signedIndex(first + count)),
      size_(static_cast<std::uint32_t>(shapes.captured.cols())) {
  const float largest = std::max(largestOf(shapes.captured), largestOf(shapes.predicted));
  mm_per_step_ = largest / kLargestStep;
  const float steps_per_mm = largest > kNothingMm ? kLargestStep / largest : 0.0F;
  numbers_.resize(2 * count * size_);
  std::int16_t* next = numbers_.data();
  for (Eigen::Index phone = signedIndex(first); phone < signedIndex(first + count); ++phone) {
    for (const PhoneShapes::Matrix* values : {&shapes.captured, &shapes.predicted}) {
      const float* row = values->data() + phone * values->cols();
      for (std::uint32_t i = 0; i < size_; ++i, ++next) {
        if (std::isnan(row[i])) {
          *next = kUnseen;
          is_all_seen_ = false;
          continue;
        }
        const float steps = row[i] * steps_per_mm;
        *next = static_cast<std::int16_t>(steps + (steps < 0 ? -0.5F : 0.5F));
      }
    }
  }
}

PhoneShape PackedShapes::unpacked(std::size_t phone) const {
  PhoneShape shape;
  shape.size = size_;
  const std::int16_t* from = numbers_.data() + 2 * phone * size_;
  for (PhoneShape::Numbers* numbers : {&shape.captured_numbers, &shape.predicted_numbers}) {
    for (std::uint32_t i = 0; i < size_; ++i) (*numbers)[i] = mm_per_step_ * static_cast<float>(from[i]);
    if (!is_all_seen_) {
      for (std::uint32_t i = 0; i < size_; ++i) {
        if (from[i] == kUnseen) (*numbers)[i] = std::numeric_limits<float>::quiet_NaN();
      }
    }
    from += size_;
  }
  return shape;
}

}  // namespace mouthpiece
