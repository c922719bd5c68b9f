#pragma once

#include <filesystem>

#include "motion/marker_layout.h"
#include "motion/motion_clip.h"

namespace mouthpiece {

struct ArkitTakeOptions {
  std::filesystem::path head;     ///< GLB with ARKit's shapes, or a .face that was fitted to one
  std::filesystem::path anchors;  ///< of a GLB; empty: the anchors or landmarks file beside it
  double frame_rate_hz = 0;       ///< 0: the file's time code
};

struct ArkitTake {
  MotionClip motion;
  bool left_head_out = false;  ///< the file turns the head
};

/// Live Link Face's CSV as markers: its weights move the head's shapes, and the layout's markers ride on the head's
/// skin. The head is still, as a corpus would make it again. Throws InputError.
ArkitTake readArkitTake(const std::filesystem::path& csv, const MarkerLayout& layout, const ArkitTakeOptions& options);

}  // namespace mouthpiece
