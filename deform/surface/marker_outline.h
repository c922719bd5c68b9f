#pragma once

#include <Eigen/Core>
#include <vector>

#include "motion/motion_clip.h"

namespace mouthpiece {

/// Which of `points` (x y) lie within what the markers span, seen from the front: their convex hull.
std::vector<bool> withinOutline(const MarkerPositions& markers, const Eigen::MatrixX2d& points);

}  // namespace mouthpiece
