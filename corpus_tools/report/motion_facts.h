#pragma once

#include <string>
#include <vector>

#include "motion/formats/c3d_file.h"
#include "motion/motion_clip.h"

namespace mouthpiece {

/// What `corpus info take.c3d` prints: rate, frames, markers with the share of frames they were seen in, events.
std::string motionFactsText(const MotionClip& clip, const std::vector<MotionEvent>& events);
std::string motionFactsJson(const MotionClip& clip, const std::vector<MotionEvent>& events);

}  // namespace mouthpiece
