#pragma once

#include <Eigen/Core>

#include "base/byte_reader.h"

namespace mouthpiece {

/// Parts of a weights' file (docs/theory/vowel_network.md). Both throw InputError where the bytes end too early or a
/// number is not finite.

/// In half precision, row after row.
Eigen::MatrixXf readHalfMatrix(ByteReader& reader, std::uint32_t rows, std::uint32_t columns);
/// In single precision.
Eigen::RowVectorXf readFloats(ByteReader& reader, Eigen::Index count);

/// The softmax of every column of `scores`, as rows.
Eigen::MatrixXf softmaxOfColumns(const Eigen::MatrixXf& scores);

}  // namespace mouthpiece
