#pragma once

#include "exports/shapes/principal_shapes.h"
#include "motion/motion_clip.h"

namespace mouthpiece {

/// ARKit's 52 weights that best reproduce marker motion: frames x 52, each in [0, 1]. What a shape does to the markers
/// of the default layout is learnt from a head that has them all (sample_data/arkit/face66_shapes.json); markers of
/// other names do not count. `neutral_mm`: the actor's neutral pose, in the motion's order of markers; null: the median
/// of the frames. Throws InputError when no marker is of the default layout.
RowMajorMatrixF arkitFromMarkers(const MotionClip& motion, const MarkerPositions* neutral_mm);

}  // namespace mouthpiece
