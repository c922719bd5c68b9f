#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "units/prediction/phone_shapes.h"

namespace mouthpiece {

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
  explicit PackedShapes(const PhoneShapes& shapes);

  [[nodiscard]] PhoneShape unpacked(std::size_t phone) const;
  [[nodiscard]] float tightestMm(std::size_t phone) const { return tightest_mm_[phone]; }

 private:
  std::vector<std::int16_t> numbers_;  ///< of each phone: captured, predicted
  std::vector<float> tightest_mm_;
  float mm_per_step_ = 0;
  std::uint32_t size_ = 0;   ///< points * components
  bool is_all_seen_ = true;  ///< no number is kUnseen
};

}  // namespace mouthpiece
