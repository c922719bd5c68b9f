#pragma once

#include <Eigen/Core>
#include <string_view>
#include <vector>

#include "deform/mesh/triangles.h"

namespace mouthpiece {

struct FaceMesh;

/// The balls of a head's eyes in shapes. `moves` below: of each vertex of the mesh.
class ShapeEyes {
 public:
  /// `mesh` stands upright and must outlive it.
  explicit ShapeEyes(const FaceMesh& mesh);

  /// Turns the eye that ARKit's EyeLook... of that name turns; other shapes turn none.
  void look(std::string_view arkit, VertexPositions& moves) const;
  /// Lids slide over the balls: what a shape takes into one is brought out to its front again, as far as it lay before
  /// it.
  void slideLids(VertexPositions& moves) const;

  /// The vertices of one eye, and the middle of the ball that they lie on.
  struct Eyeball {
    std::vector<Eigen::Index> vertices;
    Eigen::RowVector3f middle = Eigen::RowVector3f::Zero();
    float radius = 0;  ///< of what lies in front, the cornea too
  };

 private:
  const FaceMesh& mesh_;
  Eyeball left_, right_;
};

}  // namespace mouthpiece
