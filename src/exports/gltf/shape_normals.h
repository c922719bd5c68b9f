#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "deform/mesh/face_mesh.h"
#include "exports/shapes/principal_shapes.h"

namespace mouthpiece {

/// Unit normals of the resting mesh and how each shape turns them, to first order: what shapes take back of each other
/// (the offset and the rest) they then take back of the normals too, and shading follows the motion.
struct ShapeNormals {
  Eigen::RowVectorXf rest;              ///< 1 x (3 * vertices); +Z where a vertex has no area around it
  std::vector<std::uint32_t> vertices;  ///< that the columns of `deltas` turn, rising: movers and their neighbours
  RowMajorMatrixF deltas;               ///< shapes x (3 * vertices), a weight; zero where it is under half a degree
};

/// Area-weighted normals of `shapes.rest`, and their derivatives by the shapes' weights.
ShapeNormals shapeNormals(const std::vector<Triangle>& triangles, const PrincipalShapes& shapes);

}  // namespace mouthpiece
