#pragma once

#include "deform/surface/control_surface.h"
#include "deform/mesh/face_mesh.h"

namespace mouthpiece {

/// Lays the surface at rest along the skin of `mesh`: sets rest_slopes, and adds points on the skin where that is not
/// enough. Added points move as the surface through the other points does: they say where the face is, never how it
/// moves.
ControlMesh fittedToMesh(const ControlMesh& control, const FaceMesh& mesh);

}  // namespace mouthpiece
