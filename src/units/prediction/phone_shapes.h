#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "motion/lip_gauge.h"
#include "motion/motion_clip.h"
#include "phonetics/labels/speech_labels.h"
#include "units/prediction/trajectory_model.h"

namespace mouthpiece {

/// What selection needs to know of a take's motion without loading it: the first components of the speaking face at a
/// few times of each phone, as captured and as predicted from the take's own labels.
struct PhoneShapes {
  static constexpr Eigen::Index kPoints = 5;  ///< at 10, 30, 50, 70, 90 % of the phone
  static constexpr Eigen::Index kMostComponents = 8;
  using Matrix = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  Matrix captured;                 ///< phones x (points * components), mm, components side by side; NaN: not seen
  Matrix predicted;                ///< the same
  std::vector<float> tightest_mm;  ///< one a phone: least lip opening in it and 20 ms around it; NaN: not seen

  [[nodiscard]] std::size_t phoneCount() const { return tightest_mm.size(); }
  [[nodiscard]] Eigen::Index componentCount() const { return captured.cols() / kPoints; }
};

/// A phone of PhoneShapes, in numbers to compute with.
struct PhoneShape {
  using Numbers = std::array<float, PhoneShapes::kPoints * PhoneShapes::kMostComponents>;
  using Row = Eigen::Map<const Eigen::RowVectorXf>;

  Eigen::Index size = 0;  ///< points * components
  Numbers captured_numbers, predicted_numbers;

  [[nodiscard]] Row captured() const { return {captured_numbers.data(), size}; }
  [[nodiscard]] Row predicted() const { return {predicted_numbers.data(), size}; }
};

/// PhoneShapes of a take in half the memory: 16-bit integers, to 1/65,534 of the take's range (about a micrometre).
/// Those of a large corpus are most of what a line needs in memory.
class PackedShapes {
 public:
  PackedShapes() = default;
  explicit PackedShapes(const PhoneShapes& shapes) : PackedShapes(shapes, 0, shapes.phoneCount()) {}
  /// Of `count` phones from `first` on alone, which are the first ones here; the numbers are those of all of them.
  PackedShapes(const PhoneShapes& shapes, std::size_t first, std::size_t count);

  [[nodiscard]] PhoneShape unpacked(std::size_t phone) const;
  [[nodiscard]] float tightestMm(std::size_t phone) const { return tightest_mm_[phone]; }

 private:
  std::vector<std::int16_t> numbers_;  ///< of each phone: captured, predicted
  std::vector<float> tightest_mm_;
  float mm_per_step_ = 0;
  std::uint32_t size_ = 0;   ///< points * components
  bool is_all_seen_ = true;  ///< no number is kUnseen
};

/// The least distance of two markers in a phone and 20 ms around it, as exact as labels are, mm; NaN: never seen.
double tightestOpening(const MotionClip& motion, MarkerIndex upper, MarkerIndex lower, const TimeSpan& span);

/// Components that PhoneShapes hold.
Eigen::Index shapeComponents(const TrajectoryModel& model);

/// The times of all points of all phones, rising. A silence is looked at where it is nearest to speech: in its last
/// 300 ms when the line begins with it, otherwise in its first.
std::vector<Seconds> shapeTimes(const SpeechLabels& labels);

/// phones x (points * components): the model's prediction for `labels`.
PhoneShapes::Matrix predictedShapes(const TrajectoryModel& model, const SpeechLabels& labels);

/// What the model predicts for a line, made once for all who ask: which fragments are chosen, and what they are moved
/// by.
struct PredictedLine {
  PredictedLine(const TrajectoryModel& model, const SpeechLabels& labels, LinePrediction::Keeps keeps);
  LinePrediction at_times;
  PhoneShapes::Matrix shapes;  ///< predictedShapes()
};

/// `neutral_mm`, the columns of `motion` and `lips` in the model's order.
PhoneShapes phoneShapes(const TrajectoryModel& model, const SpeechLabels& labels, const MotionClip& motion,
                        const MarkerPositions& neutral_mm, const LipGauge& lips);

}  // namespace mouthpiece
