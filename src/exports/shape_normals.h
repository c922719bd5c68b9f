#pragma once

#include <Eigen/Core>
#include <vector>

#include "deform/face_mesh.h"
#include "exports/principal_shapes.h"

namespace mouthpiece {

/// Unit normals of the resting mesh and how each shape, at weight 1, turns them; so that shading follows the motion.
struct ShapeNormals {
  Eigen::RowVectorXf rest;  ///< 1 x (3 * vertices); +Z where a vertex has no area around it
  RowMajorMatrixF deltas;   ///< shapes x (3 * vertices); zero where the normal turns by less than half a degree
};

/// Area-weighted normals of `shapes.rest` and of every shape.
ShapeNormals shapeNormals(const std::vector<Triangle>& triangles, const PrincipalShapes& shapes);

}  // namespace mouthpiece
