#pragma once

#include <vector>

#include "deform/mesh/face_mesh.h"

namespace mouthpiece {

/// What each vertex belongs to. One that several parts share is skin or lips if one of them is, else the mouth's
/// inside.
std::vector<PartKind> vertexKinds(const FaceMesh& mesh);

}  // namespace mouthpiece
