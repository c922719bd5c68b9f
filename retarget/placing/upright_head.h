#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "deform/mesh/face_mesh.h"
#include "retarget/placing/shape_anchors.h"

namespace mouthpiece {

/// The turn that stands a head upright (Y up, looking along +Z) and that its shapes tell: the jaw opens downwards and
/// lies below the eyes, which blink, and what it moves lies at the front. A head that the file's own axes fit, or the
/// same turned by right angles, is turned by these, as is one without lids that blink. `skin`: vertices of the head's
/// skin.
Eigen::Matrix3f uprightFromGiven(const FaceMesh& mesh, const std::vector<std::uint32_t>& skin,
                                 const TellingShapes& shapes);

}  // namespace mouthpiece
