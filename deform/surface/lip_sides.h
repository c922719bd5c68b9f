#pragma once

#include <cstdint>
#include <vector>

#include "deform/surface/control_surface.h"
#include "deform/mesh/face_mesh.h"
#include "deform/mesh/mesh_graph.h"

namespace mouthpiece {

/// Bits for the two sides of an opening of the face: a vertex on one must not hang on the other.
enum SideBit : std::uint32_t {
  kUpperLip = 1,
  kLowerLip = 2,
  kUpperLidRight = 4,
  kLowerLidRight = 8,
  kUpperLidLeft = 16,
  kLowerLidLeft = 32,
};

/// Side bits of each triangle of the control mesh, from its points.
std::vector<std::uint32_t> triangleSides(const ControlMesh& control);

/// The sides a vertex is not on, and how it lies between the lips.
struct VertexSides {
  std::vector<std::uint32_t> forbidden;  ///< bits of the further side of each opening, by distance along the mesh
  std::vector<double> lower_share;       ///< way to the upper lip over the ways to both: 0 upper, 1 lower
};
VertexSides vertexSides(const FaceMesh& mesh, const ControlMesh& control, const std::vector<PartKind>& kinds,
                        const MeshGraph& graph);

/// The way over skin and lips from the middle of the upper lip's edge to the lower one's, over the straight way around
/// the nearer corner of the mouth: about 1 or more where the lips can part, about a half where they are one surface.
double wayBetweenLips(const FaceMesh& mesh, const ControlMesh& control, const std::vector<PartKind>& kinds,
                      const MeshGraph& graph);

/// The mesh's edges, with texture seams closed but never the lips.
MeshGraph graphOf(const FaceMesh& mesh, const ControlMesh& control);

}  // namespace mouthpiece
