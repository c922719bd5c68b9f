#pragma once

#include <cstdint>
#include <vector>

#include "deform/mesh/face_mesh.h"

namespace mouthpiece {

/// Two vertices of skin that face each other over the slit of the mouth.
struct SlitPair {
  std::uint32_t upper, lower;
  std::size_t step;  ///< across the mouth, 0 to kSlitSteps - 1, from low to high x
};
inline constexpr std::size_t kSlitSteps = 40;

/// The slit as a shape tells it that opens the jaw: places that lie close together and go far apart. `jaw_moves`: of
/// each vertex, at weight 1. In the order of the steps, in each from the front to the back; few or none where the lips
/// are one surface. The mesh must stand upright (Y up, face +Z).
std::vector<SlitPair> lipSlit(const FaceMesh& mesh, const VertexPositions& jaw_moves);

/// Vertices of skin and lips, rising; `with_hair`: lashes, brows and beards too.
std::vector<std::uint32_t> skinVertices(const FaceMesh& mesh, bool with_hair);

}  // namespace mouthpiece
