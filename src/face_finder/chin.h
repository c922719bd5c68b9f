#pragma once

#include <Eigen/Core>

#include "deform/topology/mirror_plane.h"

namespace mouthpiece {

/// The lowest point of the chin on the profile through `seen`: where the profile has turned from the front to the
/// underside, as it is seen from below in front, down and half as much forward. `seen`: a place near it.
Eigen::Vector3f chinOnProfile(const FaceSkin& skin, const FaceFrame& face, const Eigen::Vector3f& seen);

}  // namespace mouthpiece
