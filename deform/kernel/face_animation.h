#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <numeric>
#include <span>
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

/// The same, each frame made when it is asked for: a line of any length takes no room.
struct FrameMaker {
  double frame_rate_hz = 0;
  Eigen::Index frame_count = 0;
  Eigen::Index width = 0;                    ///< 3 * vertices
  std::vector<std::uint32_t> vertices = {};  ///< as FaceAnimation's
  /// Positions of the vertices in a frame, x y z side by side, the mesh's unit; `out` has `width` of them.
  std::function<void(Eigen::Index frame, std::span<float> out)> make;

  /// The given frames, side by side.
  [[nodiscard]] FaceAnimation frames(std::span<const Eigen::Index> which) const {
    FaceAnimation animation{frame_rate_hz, {}, vertices};
    animation.positions.resize(static_cast<Eigen::Index>(which.size()), width);
    for (Eigen::Index row = 0; row < animation.positions.rows(); ++row)
      make(which[static_cast<std::size_t>(row)],
           {animation.positions.row(row).data(), static_cast<std::size_t>(width)});
    return animation;
  }
  [[nodiscard]] FaceAnimation all() const {
    std::vector<Eigen::Index> which(static_cast<std::size_t>(frame_count));
    std::iota(which.begin(), which.end(), Eigen::Index{0});
    return frames(which);
  }
};

}  // namespace mouthpiece
