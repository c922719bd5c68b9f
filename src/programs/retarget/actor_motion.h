#pragma once

#include <string>
#include <vector>

#include "motion/marker_layout.h"
#include "motion/motion_clip.h"

namespace mouthpiece {

/// Motion that a face can take, and what was done to it, a line each.
struct ActorMotion {
  MotionClip motion;
  std::vector<std::string> notices;
};

/// Motion as the actor's neutral pose stands (`neutral_mm`: a row for each of `names`): a head that turns or moves is
/// held still by the layout's stable markers, a glitch of one marker is bridged, and markers that no frame shows are
/// left out. Throws InputError, which begins with `file`, for a face of another size, markers with each other's
/// names or far from where the actor has them, and gaps.
ActorMotion actorMotion(MotionClip motion, const std::vector<std::string>& names, const MarkerPositions& neutral_mm,
                        const MarkerLayout& layout, const std::string& file);

}  // namespace mouthpiece
