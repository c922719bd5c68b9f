#pragma once

#include <optional>

#include "deform/mesh/face_mesh.h"
#include "retarget/rig/face_file.h"

namespace mouthpiece {

/// `head`, fitted as `face` and upright as fitFace() leaves it, with what its mouth lacks: a bag where the lips end at
/// the edge of a hole; teeth with their gums and a tongue from another fitted head, `donor`, warped by the markers that
/// both have and put behind the lips. Upper teeth go with the nose's tip, lower ones and the tongue with the chin's low
/// end, a bag with the rims. nullopt where nothing is missing.
std::optional<GrownMesh> withBorrowedMouth(const FaceMesh& head, const FaceFile& face, const FaceMesh& donor_mesh,
                                           const FaceFile& donor);

/// `whole`, that `head` with a mouth, its skin behind the rims a part of its own, "mouth_inside".
FaceMesh withInsideTold(const FaceMesh& whole, const FaceMesh& head, const FaceFile& face);

}  // namespace mouthpiece
