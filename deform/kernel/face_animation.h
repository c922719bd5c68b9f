#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <functional>
#include <memory>
#include <numeric>
#include <span>
#include <utility>
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
  /// All frames in turn, some at once: `take` is told the first one's number and has a row of each for as long as it
  /// runs.
  void inBlocks(
      const std::function<void(Eigen::Index first, const decltype(FaceAnimation::positions)& rows)>& take) const {
    constexpr Eigen::Index kBlock = 64;
    decltype(FaceAnimation::positions) rows;
    for (Eigen::Index first = 0; first < frame_count; first += kBlock) {
      rows.resize(std::min(kBlock, frame_count - first), width);
      for (Eigen::Index row = 0; row < rows.rows(); ++row)
        make(first + row, {rows.row(row).data(), static_cast<std::size_t>(width)});
      take(first, rows);
    }
  }
};

/// The frames of what is held already.
inline FrameMaker framesOf(FaceAnimation animation) {
  const auto held = std::make_shared<const FaceAnimation>(std::move(animation));
  return {held->frame_rate_hz, held->positions.rows(), held->positions.cols(), held->vertices,
          [held](Eigen::Index frame, std::span<float> out) {
            std::copy_n(held->positions.row(frame).data(), out.size(), out.data());
          }};
}

/// Frames that will be gone through several times: held from the first on where they take little room, made anew each
/// time where a line is long.
inline FrameMaker heldIfShort(FrameMaker frames, double most_bytes = 256e6) {
  const double bytes = static_cast<double>(frames.frame_count) * static_cast<double>(frames.width) * sizeof(float);
  return bytes <= most_bytes ? framesOf(frames.all()) : frames;
}

}  // namespace mouthpiece
