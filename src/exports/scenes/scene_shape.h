#pragma once

#include <cstdint>
#include <vector>

#include "exports/shapes/principal_shapes.h"

namespace mouthpiece {

/// What one blend shape does to the vertices that it moves or turns.
struct SceneShape {
  std::vector<std::uint32_t> vertices;  ///< rising
  std::vector<float> moves;             ///< three a vertex, in the mesh's unit, a weight
  std::vector<float> turns;             ///< of the unit normals, three a vertex, a weight
};

/// Of shape `k`. `normals`: shapeNormals() of the mesh and `shapes`.
SceneShape sceneShape(const PrincipalShapes& shapes, const ShapeNormals& normals, Eigen::Index k);

}  // namespace mouthpiece
