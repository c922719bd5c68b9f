#pragma once

#include <array>
#include <vector>

#include "deform/surface/control_surface.h"

namespace mouthpiece {

/// Constrained Delaunay triangulation of `mesh.domain`: the rims of mouth and eyes are edges and stay open. Triangles
/// are counter-clockwise. Throws InputError when the rims cross or markers coincide.
std::vector<std::array<int, 3>> triangulate(const ControlMesh& mesh);

/// Corners of the convex hull of `points` (rows), counter-clockwise.
std::vector<int> convexHull(const Eigen::Matrix<double, Eigen::Dynamic, 2, Eigen::RowMajor>& points);

}  // namespace mouthpiece
