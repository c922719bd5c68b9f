#pragma once

#include <array>
#include <vector>

#include "retarget/sample_head/canonical_face.h"

namespace mouthpiece {

/// Linear RGB a vertex of the finished model: skin with blush and brows, lips, lids, nostrils, the mouth's dark, teeth,
/// eyes. A pure function of places and channels, so that the same mesh always gets the same colours.
std::vector<std::array<float, 3>> paintFace(const ModelMesh& model);

/// Pushes the nostrils' openings in; vertices below 468 stay where they are.
void carveNostrils(ModelMesh& model);

}  // namespace mouthpiece
