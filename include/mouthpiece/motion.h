#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "mouthpiece/labels.h"

namespace mouthpiece {

/// Marker positions over time, the head still: right-handed, millimetres, X to the subject's left, Y up, Z out of the
/// face. Frame k is at k / frame_rate_hz.
struct Motion {
  double frame_rate_hz = 0;
  std::vector<std::string> marker_names;
  std::vector<double> positions_mm;  ///< frame after frame: x y z of each marker

  [[nodiscard]] std::size_t frameCount() const {
    return marker_names.empty() ? 0 : positions_mm.size() / (3 * marker_names.size());
  }
  /// x y z of each marker in one frame.
  [[nodiscard]] std::span<const double> frame(std::size_t index) const {
    return std::span(positions_mm).subspan(3 * marker_names.size() * index, 3 * marker_names.size());
  }
};

inline constexpr std::size_t kArkitShapes = 52;

/// One frame of a performance. The spans look into what the frame came from, until its next frame is asked for.
struct Frame {
  std::size_t index = 0;
  Seconds time = 0;
  std::span<const double> markers_mm;       ///< x y z of each marker, as Motion has them
  std::array<float, kArkitShapes> arkit{};  ///< weights of ARKit's shapes, 0 to 1, in the order of arkitName()
  std::span<const float> vertices;          ///< x y z of each vertex of the face, its mesh's unit; empty: no face
};

}  // namespace mouthpiece
