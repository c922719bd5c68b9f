#include "hearing/tags/weight_reader.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>

namespace mouthpiece {
namespace {

/// Half precision: a sign, five bits of exponent, ten of fraction.
float floatFromHalf(std::uint16_t half) {
  const int exponent = (half >> 10U) & 0x1FU;
  const int fraction = half & 0x3FFU;
  if (exponent == 0x1F) return std::numeric_limits<float>::quiet_NaN();
  const float size = exponent == 0 ? std::ldexp(static_cast<float>(fraction), -24)
                                   : std::ldexp(static_cast<float>(fraction + 1024), exponent - 25);
  return (half & 0x8000U) != 0 ? -size : size;
}

float readHalf(ByteReader& reader) {
  const float value = floatFromHalf(reader.readU16());
  if (!std::isfinite(value)) reader.fail("a weight is not finite; expected numbers");
  return value;
}

}  // namespace

Eigen::MatrixXf readHalfMatrix(ByteReader& reader, std::uint32_t rows, std::uint32_t columns) {
  const std::size_t bytes = std::size_t{2} * rows * columns;
  if (reader.remaining() < bytes) {
    reader.fail(fmt::format("found {} bytes; expected {} x {} weights", reader.remaining(), rows, columns));
  }
  Eigen::MatrixXf matrix(rows, columns);
  for (std::uint32_t row = 0; row < rows; ++row) {
    for (std::uint32_t column = 0; column < columns; ++column) matrix(row, column) = readHalf(reader);
  }
  return matrix;
}

Eigen::RowVectorXf readFloats(ByteReader& reader, Eigen::Index count) {
  Eigen::RowVectorXf values(count);
  for (float& value : values) {
    value = reader.readF32();
    if (!std::isfinite(value)) reader.fail("a number is not finite");
  }
  return values;
}

Eigen::MatrixXf softmaxOfColumns(const Eigen::MatrixXf& scores) {
  Eigen::MatrixXf result(scores.cols(), scores.rows());
  for (Eigen::Index k = 0; k < scores.cols(); ++k) {
    const Eigen::ArrayXf powers = (scores.col(k).array() - scores.col(k).maxCoeff()).exp();
    result.row(k) = (powers / powers.sum()).matrix().transpose();
  }
  return result;
}

}  // namespace mouthpiece
