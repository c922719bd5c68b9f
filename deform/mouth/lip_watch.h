#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "deform/mesh/face_mesh.h"

namespace mouthpiece {

/// A vertex of one lip that watches the place of the other which is nearest when the mouth is closed. The other lip's
/// shape around that place is taken along in the frame of its triangle.
struct LipWatch {
  std::uint32_t vertex;
  std::uint32_t corners[3];
  float weights[2];  ///< of the second and third at the place watched
  float bend[5];     ///< how the lip leaves the triangle's plane: x, y, x^2, x y, y^2, in units of what is seen
  float away[3];     ///< where the triangle faced in the closed mouth
  float allowed;     ///< signed distance at rest where it is below zero
  std::uint32_t column;

  struct Sight {
    float distance;
    Eigen::Vector3f away;  ///< unit length
  };
  /// Where the vertex is to the other lip, `reach` around the watched place; further off or where the triangle has
  /// tipped over the watch goes blind and sees it `reach` away. `vertices`: x y z of each of the posed mesh.
  [[nodiscard]] Sight look(const float* vertices, float reach) const;

  /// Takes the shape of the other lip in the closed mouth: `lip` are its vertices.
  void takeShape(const VertexPositions& closed, const VertexPositions& normals, const std::vector<std::uint32_t>& lip,
                 float reach);
};

}  // namespace mouthpiece
