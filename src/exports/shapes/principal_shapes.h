#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "deform/kernel/face_animation.h"
#include "deform/mesh/triangles.h"

namespace mouthpiece {

using RowMajorMatrixF = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

struct PrincipalShapesOptions {
  double tolerance_mm = 0.09;  ///< largest distance of a vertex, in any frame, from the full animation
};

/// A face animation as a few shapes: frame f is `rest + sum_k weights(f, k) * shapes.row(k)`. All weights lie in [0,
/// 1], since Blender 3.4 cuts a shape key's value to that range; so the first shape is the pose that the others start
/// from, its weight 1 throughout.
struct PrincipalShapes {
  double frame_rate_hz = 0;
  Eigen::RowVectorXf rest;              ///< 1 x (3 * vertices), mesh unit
  std::vector<std::uint32_t> vertices;  ///< that the columns of `shapes` move, rising; empty: all
  RowMajorMatrixF shapes;   ///< shapes x (3 * vertices), mesh unit: displacements at weight 1; zero where nothing moves
  RowMajorMatrixF weights;  ///< frames x shapes; every column's largest is 1
  double max_error_mm = 0;  ///< measured over all vertices and frames

  [[nodiscard]] Eigen::Index shapeCount() const { return shapes.rows(); }
  [[nodiscard]] Eigen::Index frameCount() const { return weights.rows(); }
  /// The vertices that columns 3 i, 3 i + 1, 3 i + 2 of `shapes` move.
  [[nodiscard]] std::vector<std::uint32_t> columnVertices() const;
};

/// Compresses `animation` of a mesh that rests at `rest` (all vertices x 3, same unit): principal components of a
/// sample of trajectories give the weights, one least-squares product the shapes; vertices beyond the tolerance get
/// shapes of their own until none is left, so the tolerance always holds. On all cores; the same for any number of
/// them.
PrincipalShapes principalShapes(const FaceAnimation& animation, const VertexPositions& rest, double metres_per_unit,
                                const PrincipalShapesOptions& options = {});

/// The same of frames that are made when they are asked for, in memory that grows with the line by its weights alone.
/// A line of more than some 30 s takes its shapes from evenly spread frames, each other frame its weights by least
/// squares; what is then beyond the tolerance becomes a shape of its own, so the tolerance holds in every frame.
PrincipalShapes principalShapes(const FrameMaker& frames, const VertexPositions& rest, double metres_per_unit,
                                const PrincipalShapesOptions& options = {});

/// Unit normals of the resting mesh and how each shape turns them, to first order: what shapes take back of each other
/// (the offset and the rest) they then take back of the normals too, and shading follows the motion.
struct ShapeNormals {
  /// What a shape turns, movers and their neighbours, but for those that it turns by less than half a degree.
  struct Turns {
    std::vector<std::uint32_t> vertices;  ///< rising
    std::vector<float> values;            ///< three a vertex, a weight
  };
  Eigen::RowVectorXf rest;    ///< 1 x (3 * vertices); +Z where a vertex has no area around it
  std::vector<Turns> shapes;  ///< in their order
};

/// Area-weighted normals of `shapes.rest`, and their derivatives by the shapes' weights.
ShapeNormals shapeNormals(const std::vector<Triangle>& triangles, const PrincipalShapes& shapes);

}  // namespace mouthpiece
