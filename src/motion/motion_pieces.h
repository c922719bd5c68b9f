#pragma once

#include <functional>
#include <string>
#include <vector>

#include "motion/motion_clip.h"

namespace mouthpiece {

/// Motion whose frames come some at a time, in order, so that an hour need not be held.
struct MotionInPieces {
  double frame_rate_hz = 0;
  std::vector<std::string> marker_names;
  std::size_t frame_count = 0;
  using Take = std::function<void(std::size_t first_frame, const PositionMatrix& positions_mm)>;
  std::function<void(const Take&)> forEach;  ///< gives all of them

  [[nodiscard]] std::size_t markerCount() const { return marker_names.size(); }
};

/// `clip`, which must outlive it, at once.
MotionInPieces inOnePiece(const MotionClip& clip);

}  // namespace mouthpiece
