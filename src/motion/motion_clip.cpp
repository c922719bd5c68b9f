#include "motion/motion_clip.h"

#include <algorithm>
#include <limits>

#include "motion/motion_pieces.h"

namespace mouthpiece {

bool MotionClip::isSeenThroughout(MarkerIndex marker, FrameIndex first, FrameIndex last) const {
  for (std::size_t frame = first.value; frame < last.value; ++frame) {
    if (!isSeen(FrameIndex(frame), marker)) return false;
  }
  return true;
}

MarkerPositions MotionClip::pose(FrameIndex frame) const {
  const auto row = positions_mm.row(frame.row());
  return Eigen::Map<const MarkerPositions>(row.data(), signedIndex(markerCount()), 3);
}

std::optional<MarkerIndex> MotionClip::findMarker(std::string_view name) const {
  const auto found = std::find(marker_names.begin(), marker_names.end(), name);
  if (found == marker_names.end()) return std::nullopt;
  return MarkerIndex(unsignedIndex(found - marker_names.begin()));
}

MotionInPieces inOnePiece(const MotionClip& clip) {
  return {clip.frame_rate_hz, clip.marker_names, clip.frameCount(),
          [&clip](const MotionInPieces::Take& take) { take(0, clip.positions_mm); }};
}

MotionClip selectMarkers(const MotionClip& clip, const std::vector<std::string>& names) {
  MotionClip selected{clip.frame_rate_hz, names, {}};
  selected.positions_mm.setConstant(clip.positions_mm.rows(), signedIndex(3 * names.size()),
                                    std::numeric_limits<double>::quiet_NaN());
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto marker = clip.findMarker(names[i]);
    if (!marker) continue;
    selected.positions_mm.middleCols<3>(signedIndex(3 * i)) = clip.positions_mm.middleCols<3>(3 * marker->row());
  }
  return selected;
}

}  // namespace mouthpiece
