#define CGAL_EIGEN3_ENABLED
#include "arap_deformer.h"

#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/Surface_mesh_deformation.h>

#include <limits>
#include <stdexcept>

namespace mouthpiece {
namespace {

using Point = CGAL::Simple_cartesian<double>::Point_3;
using Surface = CGAL::Surface_mesh<Point>;
using Corner = Surface::Vertex_index;
using Arap = CGAL::Surface_mesh_deformation<Surface>;

/// The triangles of the skin; Surface_mesh refuses those that would make it non-manifold.
Surface skinSurface(const FaceMesh& mesh) {
  Surface surface;
  for (Eigen::Index i = 0; i < mesh.vertices.rows(); ++i) {
    surface.add_vertex({mesh.vertices(i, 0), mesh.vertices(i, 1), mesh.vertices(i, 2)});
  }
  for (const MeshPart& part : mesh.parts) {
    if (part.kind != PartKind::kSkin && part.kind != PartKind::kLips) continue;
    for (std::size_t t = part.first_triangle; t < part.first_triangle + part.triangle_count; ++t) {
      const Triangle& triangle = mesh.triangles[t];
      surface.add_face(Corner(triangle[0]), Corner(triangle[1]), Corner(triangle[2]));
    }
  }
  return surface;
}

Corner nearestOf(const std::vector<Corner>& corners, const Surface& surface, const Point& place) {
  Corner nearest;
  double least = std::numeric_limits<double>::infinity();
  for (const Corner corner : corners) {
    const double distance = CGAL::squared_distance(surface.point(corner), place);
    if (distance >= least) continue;
    least = distance;
    nearest = corner;
  }
  return nearest;
}

/// Those of `moving` that hang together with the one nearest to `place`: lashes have no marker and would be free.
std::vector<Corner> pieceAt(const Point& place, std::span<const std::uint32_t> moving, const Surface& surface) {
  std::vector<Corner> candidates;
  std::vector<bool> waits(surface.number_of_vertices(), false);
  for (const std::uint32_t vertex : moving) {
    if (surface.is_isolated(Corner(vertex))) continue;
    candidates.emplace_back(vertex);
    waits[vertex] = true;
  }
  std::vector<Corner> piece{nearestOf(candidates, surface, place)};
  waits[piece.front().idx()] = false;
  for (std::size_t next = 0; next < piece.size(); ++next) {
    for (const Corner neighbour : surface.vertices_around_target(surface.halfedge(piece[next]))) {
      if (!waits[neighbour.idx()]) continue;
      waits[neighbour.idx()] = false;
      piece.push_back(neighbour);
    }
  }
  return piece;
}

}  // namespace

struct ArapDeformer::Data {
  Surface surface;
  std::unique_ptr<Arap> arap;
  std::vector<Corner> moving, controls;
  std::vector<Point> control_rest;
  MarkerPositions marker_rest;
};

ArapDeformer::ArapDeformer(const FaceMesh& mesh, const MarkerPositions& marker_rest,
                           std::span<const std::uint32_t> moving)
    : data_(std::make_unique<Data>()) {
  Data& data = *data_;
  data.surface = skinSurface(mesh);
  data.marker_rest = marker_rest;
  data.arap = std::make_unique<Arap>(data.surface);
  const auto placeOfMarker = [&](Eigen::Index i) {
    return Point(marker_rest(i, 0), marker_rest(i, 1), marker_rest(i, 2));
  };
  data.moving = pieceAt(placeOfMarker(0), moving, data.surface);
  data.arap->insert_roi_vertices(data.moving.begin(), data.moving.end());
  for (Eigen::Index i = 0; i < marker_rest.rows(); ++i) {
    const Corner control = nearestOf(data.moving, data.surface, placeOfMarker(i));
    data.controls.push_back(control);
    data.control_rest.push_back(data.surface.point(control));
    data.arap->insert_control_vertex(control);
  }
  if (!data.arap->preprocess()) throw std::runtime_error("the head's as-rigid-as-possible system is singular");
}

ArapDeformer::~ArapDeformer() = default;

void ArapDeformer::deform(std::span<const double> markers, VertexPositions& out) {
  Data& data = *data_;
  for (std::size_t i = 0; i < data.controls.size(); ++i) {
    const Eigen::RowVector3d move =
        Eigen::RowVector3d(&markers[3 * i]) - data.marker_rest.row(static_cast<Eigen::Index>(i));
    const Point& rest = data.control_rest[i];
    data.arap->set_target_position(data.controls[i],
                                   Point(rest.x() + move.x(), rest.y() + move.y(), rest.z() + move.z()));
  }
  data.arap->deform();
  for (const Corner corner : data.moving) {
    const Point& place = data.surface.point(corner);
    out.row(static_cast<Eigen::Index>(corner.idx())) =
        Eigen::RowVector3d(place.x(), place.y(), place.z()).cast<float>();
  }
}

std::size_t ArapDeformer::vertexCount() const { return data_->moving.size(); }

}  // namespace mouthpiece
