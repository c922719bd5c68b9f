// What morph targets do to markers, of face_fit.h.
#include <Eigen/Geometry>
#include <limits>

#include "base/errors.h"
#include "deform/mesh/face_mesh.h"
#include "deform/mesh/triangle_tree.h"
#include "retarget/rig/face_fit.h"

namespace mouthpiece {
namespace {

/// A value of the corners in a place of their triangle.
Eigen::RowVector3d blend(const VertexPositions& values, const Triangle& triangle, const Eigen::Vector3d& weights) {
  return weights.transpose() * values(triangle, Eigen::all).cast<double>();
}

}  // namespace

MarkerShapes markerShapes(const FaceMesh& mesh, const FaceShapes& shapes, const MarkerPositions& places,
                          const std::string& file) {
  const std::vector<Triangle> triangles = trianglesOf(mesh, {PartKind::kSkin, PartKind::kLips});
  const TriangleTree skin(mesh.vertices, triangles);
  if (skin.empty()) throw InputError(file, "", "has no skin; expected a head");
  const double mm_per_unit = 1000 * mesh.metres_per_unit;
  MarkerShapes markers{MarkerPositions(places.rows(), 3), shapes.names,
                       std::vector(shapes.moves.size(), MarkerPositions(places.rows(), 3))};
  for (Eigen::Index m = 0; m < places.rows(); ++m) {
    const TriangleTree::Foot foot = skin.closest(places.row(m).transpose()).value();
    const Triangle& triangle = triangles[foot.triangle];
    markers.neutral_mm.row(m) = mm_per_unit * blend(mesh.vertices, triangle, foot.weights);
    for (std::size_t s = 0; s < shapes.moves.size(); ++s) {
      MOUTHPIECE_EXPECT(shapes.moves[s].rows() == mesh.vertices.rows());
      markers.moves_mm[s].row(m) = mm_per_unit * blend(shapes.moves[s], triangle, foot.weights);
    }
  }
  return markers;
}

PositionMatrix drivenMarkers(const MarkerShapes& shapes, const Eigen::MatrixXd& weights) {
  MOUTHPIECE_EXPECT(weights.cols() == signedIndex(shapes.names.size()));
  PositionMatrix positions(weights.rows(), shapes.neutral_mm.size());
  const auto row = [](const MarkerPositions& pose) {
    return Eigen::Map<const Eigen::RowVectorXd>(pose.data(), pose.size());
  };
  for (Eigen::Index frame = 0; frame < weights.rows(); ++frame) {
    if (!weights.row(frame).allFinite()) {
      positions.row(frame).setConstant(std::numeric_limits<double>::quiet_NaN());
      continue;
    }
    positions.row(frame) = row(shapes.neutral_mm);
    for (std::size_t s = 0; s < shapes.moves_mm.size(); ++s)
      positions.row(frame) += weights(frame, signedIndex(s)) * row(shapes.moves_mm[s]);
  }
  return positions;
}

}  // namespace mouthpiece
