#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/index.h"
#include "base/time.h"

namespace mouthpiece {

/// frames x (3 * markers), millimetres; x y z of each marker side by side. NaN: not seen.
using PositionMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// One pose: markers x 3, millimetres, right-handed, X to the subject's left, Y up, Z out of the face.
using MarkerPositions = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;

/// Marker positions over time; a sample the cameras did not see is NaN (all three axes), never zero.
/// Frame k is at k / frame_rate_hz.
struct MotionClip {
  double frame_rate_hz = 0;
  std::vector<std::string> marker_names;
  PositionMatrix positions_mm;

  [[nodiscard]] std::size_t frameCount() const { return static_cast<std::size_t>(positions_mm.rows()); }
  [[nodiscard]] std::size_t markerCount() const { return marker_names.size(); }
  [[nodiscard]] Seconds timeOf(FrameIndex frame) const { return static_cast<double>(frame.value) / frame_rate_hz; }
  [[nodiscard]] Seconds duration() const { return static_cast<double>(frameCount()) / frame_rate_hz; }
  [[nodiscard]] Eigen::Vector3d position(FrameIndex frame, MarkerIndex marker) const {
    return positions_mm.block<1, 3>(static_cast<Eigen::Index>(frame.value), static_cast<Eigen::Index>(3 * marker.value))
        .transpose();
  }
  [[nodiscard]] bool isSeen(FrameIndex frame, MarkerIndex marker) const { return position(frame, marker).allFinite(); }
  /// In every frame of [first, last).
  [[nodiscard]] bool isSeenThroughout(MarkerIndex marker, FrameIndex first, FrameIndex last) const;
  /// All markers of one frame.
  [[nodiscard]] MarkerPositions pose(FrameIndex frame) const;
  [[nodiscard]] std::optional<MarkerIndex> findMarker(std::string_view name) const;
};

/// The clip with just the markers in `names`, in that order; a marker the clip lacks becomes NaN throughout.
MotionClip selectMarkers(const MotionClip& clip, const std::vector<std::string>& names);

}  // namespace mouthpiece
