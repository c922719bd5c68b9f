#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace mouthpiece {

/// The moving face, frame by frame.
struct FaceAnimation {
  double frame_rate_hz = 0;
  /// frames x (3 * vertices), the mesh's unit; x y z of each vertex side by side.
  Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> positions;
  /// The vertices that `positions` holds, rising; empty: all. The others rest.
  std::vector<std::uint32_t> vertices = {};
};

}  // namespace mouthpiece
