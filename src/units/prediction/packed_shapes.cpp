#include "units/prediction/packed_shapes.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace mouthpiece {
namespace {

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

}  // namespace

PackedShapes::PackedShapes(const PhoneShapes& shapes)
    : tightest_mm_(shapes.tightest_mm), size_(static_cast<std::uint32_t>(shapes.captured.cols())) {
  const float largest = std::max(largestOf(shapes.captured), largestOf(shapes.predicted));
  mm_per_step_ = largest / kLargestStep;
  const float steps_per_mm = largest > kNothingMm ? kLargestStep / largest : 0.0F;
  numbers_.resize(2 * shapes.phoneCount() * size_);
  std::int16_t* next = numbers_.data();
  for (Eigen::Index phone = 0; phone < static_cast<Eigen::Index>(shapes.phoneCount()); ++phone) {
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
