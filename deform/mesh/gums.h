#pragma once

#include <span>
#include <vector>

#include "deform/mesh/face_mesh.h"

namespace mouthpiece {

enum class GumPiece { kUpperGum, kLowerGum, kTongue };

/// Splits gums that come in one piece with the tongue: for each of `gums`, a triangle of `mesh`, what it belongs to.
/// The tongue is what lies under one surface, the palate, together with its own underside, as far as it hangs together;
/// the rest goes with the row of teeth that is nearer. Heights along y.
std::vector<GumPiece> splitGums(const FaceMesh& mesh, std::span<const Triangle> gums,
                                std::span<const Triangle> upper_teeth, std::span<const Triangle> lower_teeth);

}  // namespace mouthpiece
