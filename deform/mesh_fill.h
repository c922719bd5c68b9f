#pragma once

#include "deform/control_surface.h"
#include "deform/face_mesh.h"

namespace mouthpiece {

/// Adds points on the skin of `mesh` where the surface through the markers lies far from it, until it is near everywhere. They
/// move as the surface through the other points does: they say where the face is, never how it moves.
ControlMesh filledToMesh(const ControlMesh& control, const FaceMesh& mesh);

}  // namespace mouthpiece
