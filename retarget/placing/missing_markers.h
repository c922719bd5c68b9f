#pragma once

#include <string>
#include <vector>

#include "deform/surface/control_surface.h"
#include "motion/motion_clip.h"

namespace mouthpiece {

/// Motion of a face's markers, in its order, with the pose that it is relative to.
struct CompletedMarkers {
  PositionMatrix positions_mm;  ///< frames x 3 * markers
  MarkerPositions neutral_mm;
};

/// `motion` in the order of a face's markers (the first of `control`'s points), though it may lack some: these go along
/// with those near them, a lip's with none of the other lip. `motion_neutral_mm`: the actor at rest, a row for each of
/// motion's markers; `face_neutral_mm`: the actor that the face was fitted to, a row for each of the face's. Throws
/// InputError that names a lip marker which no face can do without, or tells that too few are there.
CompletedMarkers completedMarkers(const MotionClip& motion, const MarkerPositions& motion_neutral_mm,
                                  const ControlMesh& control, const MarkerPositions& face_neutral_mm);

}  // namespace mouthpiece
