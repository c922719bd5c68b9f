#include "retarget/rig/marker_shapes.h"

#include <Eigen/Geometry>
#include <limits>

#include "base/errors.h"
#include "retarget/placing/skin_tree.h"

namespace mouthpiece {
namespace {

std::vector<Triangle> skinTriangles(const FaceMesh& mesh) {
  std::vector<Triangle> triangles;
  for (const MeshPart& part : mesh.parts) {
    if (part.kind != PartKind::kSkin && part.kind != PartKind::kLips) continue;
    const auto first = mesh.triangles.begin() + static_cast<std::ptrdiff_t>(part.first_triangle);
    triangles.insert(triangles.end(), first, first + static_cast<std::ptrdiff_t>(part.triangle_count));
  }
  return triangles;
}

/// A place on a triangle: how much of each corner it is.
struct SkinPlace {
  Triangle triangle{};
  Eigen::Vector3d weights = Eigen::Vector3d::Zero();
};

/// The closest skin; shares of the area (C. Ericson, Real-Time Collision Detection, 3.4).
SkinPlace closestPlace(const SkinTree& skin, const std::vector<Triangle>& triangles, const VertexPositions& vertices,
                       const Eigen::Vector3d& point) {
  const SkinTree::Foot foot = skin.closestFoot(point).value();
  const Triangle& triangle = triangles[foot.triangle];
  const auto at = [&](std::size_t k) -> Eigen::Vector3d {
    return vertices.row(triangle[k]).cast<double>().transpose();
  };
  const Eigen::Vector3d a = at(0), ab = at(1) - a, ac = at(2) - a, ap = foot.point - a;
  const Eigen::Vector3d normal = ab.cross(ac);
  const double of_b = ap.cross(ac).dot(normal) / normal.squaredNorm();
  const double of_c = ab.cross(ap).dot(normal) / normal.squaredNorm();
  return {triangle, {1 - of_b - of_c, of_b, of_c}};
}

Eigen::RowVector3d blend(const VertexPositions& values, const SkinPlace& place) {
  Eigen::RowVector3d sum = Eigen::RowVector3d::Zero();
  for (std::size_t corner = 0; corner < 3; ++corner)
    sum += place.weights[static_cast<Eigen::Index>(corner)] * values.row(place.triangle[corner]).cast<double>();
  return sum;
}

}  // namespace

MarkerShapes markerShapes(const FaceMesh& mesh, const FaceShapes& shapes, const MarkerPositions& places,
                          const std::string& file) {
  const std::vector<Triangle> triangles = skinTriangles(mesh);
  const SkinTree skin(mesh.vertices, triangles);
  if (skin.empty()) throw InputError(file, "", "has no skin; expected a head");
  const double mm_per_unit = 1000 * mesh.metres_per_unit;
  MarkerShapes markers{MarkerPositions(places.rows(), 3), shapes.names,
                       std::vector(shapes.moves.size(), MarkerPositions(places.rows(), 3))};
  for (Eigen::Index m = 0; m < places.rows(); ++m) {
    const SkinPlace place = closestPlace(skin, triangles, mesh.vertices, places.row(m).transpose());
    markers.neutral_mm.row(m) = mm_per_unit * blend(mesh.vertices, place);
    for (std::size_t s = 0; s < shapes.moves.size(); ++s) {
      MOUTHPIECE_EXPECT(shapes.moves[s].rows() == mesh.vertices.rows());
      markers.moves_mm[s].row(m) = mm_per_unit * blend(shapes.moves[s], place);
    }
  }
  return markers;
}

PositionMatrix drivenMarkers(const MarkerShapes& shapes, const Eigen::MatrixXd& weights) {
  MOUTHPIECE_EXPECT(weights.cols() == static_cast<Eigen::Index>(shapes.names.size()));
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
      positions.row(frame) += weights(frame, static_cast<Eigen::Index>(s)) * row(shapes.moves_mm[s]);
  }
  return positions;
}

}  // namespace mouthpiece
