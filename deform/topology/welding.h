#pragma once

#include <cstdint>
#include <vector>

#include "deform/mesh/face_mesh.h"

namespace mouthpiece {

/// A mesh whose triangles stand apart, as flat-shaded ones do, or whose parts do, as a GLB's, sewn together again: what
/// hangs on its shape (sides of the lips, normals, binding) is asked of the sewn mesh, and what it says goes to all
/// vertices that stand in one place.
struct Welding {
  FaceMesh mesh;  ///< sewn; the same triangles in the same order and parts, no colours or texture
  std::vector<std::uint32_t> welded_of;  ///< of each vertex of the given mesh: its vertex in `mesh`
  std::vector<std::uint32_t> given_of;   ///< of each vertex of `mesh`: the first given one

  /// Nothing was sewn: `mesh` is empty and the given one will do.
  [[nodiscard]] bool isNothing() const { return given_of.empty(); }

  /// Positions of `mesh`'s vertices from those of the given mesh, and back.
  [[nodiscard]] VertexPositions weldedFromGiven(const VertexPositions& given) const;
  void givenFromWelded(const VertexPositions& welded, VertexPositions& given) const;
};

/// Sews edges in the same place together: all, where most of the mesh's edges are its border; else those of different
/// parts (hair rooted in skin aside), for within a part doubled edges are seams, or lips that touch. Where more than
/// two triangles share an edge's place, each is sewn to the one that bounds the same solid with it: lips that touch
/// stay apart.
Welding weldSplitTriangles(const FaceMesh& mesh);

}  // namespace mouthpiece
