#pragma once

#include "deform/surface/control_surface.h"

namespace mouthpiece {

/// Markers and inner lips of a frame, which all other points follow linearly; those stay at rest. `pairs`:
/// lipPairs(mesh). `points`: points x 3, resized when needed; nothing else is allocated.
void leadingPoints(const ControlMesh& mesh, std::span<const LipPair> pairs, const FacePose& pose,
                   MarkerPositions& points);

/// An upright cylinder about the head; its surface unrolled is the plane that control meshes are triangulated in.
struct Cylinder {
  double radius = 0, axis_x = 0, axis_z = 0;

  [[nodiscard]] Eigen::Vector2d unrolled(const Eigen::Vector3d& p) const;
};
Cylinder cylinderOf(const ControlMesh& mesh);

/// Index of a point, -1 if the mesh has none of that name.
int findPoint(const ControlMesh& mesh, const std::string& name);

/// The rim of the mouth, closed: right corner, lower rim, left corner, upper rim (names of points).
std::vector<std::string> mouthRim();

/// The rim of one eye, closed; `side` is 'R' or 'L'.
std::vector<std::string> eyeRim(char side);

/// The line of outer lip markers, closed.
std::vector<std::string> outerLipLine();

}  // namespace mouthpiece
