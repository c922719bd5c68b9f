#pragma once

#include <optional>

#include "deform/mesh/face_mesh.h"
#include "retarget/rig/face_file.h"

namespace mouthpiece {

/// `head`, fitted as `face` and upright as fitFace() leaves it, with what its mouth lacks: a bag where the lips end at
/// the edge of a hole; teeth with their gums and a tongue from another fitted head, `donor`, warped by the markers that
/// both have and put behind the lips. The first vertices and parts are those of `head`; nullopt where nothing is
/// missing.
std::optional<FaceMesh> withBorrowedMouth(const FaceMesh& head, const FaceFile& face, const FaceMesh& donor_mesh,
                                          const FaceFile& donor);

}  // namespace mouthpiece
