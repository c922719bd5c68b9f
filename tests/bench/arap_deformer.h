#pragma once

#include <memory>
#include <span>

#include "deform/mesh/face_mesh.h"
#include "deform/surface/control_surface.h"

namespace mouthpiece {

/// CGAL's as-rigid-as-possible deformation (Sorkine and Alexa 2007; its Surface_mesh_deformation with spokes and rims,
/// 5 iterations) of a head's skin: what our deformer is compared with. The vertex nearest to each marker is a control.
class ArapDeformer {
 public:
  /// `moving`: the region of interest; the rest of the skin is held.
  ArapDeformer(const FaceMesh& mesh, const MarkerPositions& marker_rest, std::span<const std::uint32_t> moving);
  ~ArapDeformer();

  /// `markers`: x y z side by side, the mesh's unit. Starts from the frame before. Writes the region of interest into
  /// `out`, which begins as the mesh at rest.
  void deform(std::span<const double> markers, VertexPositions& out);

  [[nodiscard]] std::size_t vertexCount() const;

 private:
  struct Data;
  std::unique_ptr<Data> data_;
};

}  // namespace mouthpiece
