#pragma once

#include <array>
#include <vector>

#include "deform/surface/control_surface.h"

namespace mouthpiece {

struct FaceMesh;

// The steps of buildControlMesh(), one source file each.

/// The markers and the virtual points with their rules, rest positions and places in the plane; no triangles yet.
ControlMesh placePoints(const std::vector<std::string>& marker_names, const MarkerPositions& marker_rest,
                        const std::map<std::string, Eigen::Vector3d>& known, const SurfacePlan& plan);

/// Moves points in the plane, not at rest, until the outer lines of the lips go around the slit and upper lids run
/// above lower ones: eyes may be shut, a click may be off. Points that lie so already stay where they are.
void untangle(ControlMesh& mesh);

/// Constrained Delaunay triangulation of `mesh.domain`: the rims of mouth and eyes are edges and stay open. Triangles
/// are counter-clockwise. Throws InputError, which names them, when two lines cross or markers coincide.
std::vector<std::array<int, 3>> triangulate(const ControlMesh& mesh);

/// Corners of the convex hull of `points` (rows), counter-clockwise.
std::vector<int> convexHull(const Eigen::Matrix<double, Eigen::Dynamic, 2, Eigen::RowMajor>& points);

/// fittedToMesh() without a look at what came out.
ControlMesh laidAlongSkin(const ControlMesh& control, const FaceMesh& mesh, const HeadTopology& topology);

}  // namespace mouthpiece
