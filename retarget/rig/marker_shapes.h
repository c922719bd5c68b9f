#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "deform/mesh/face_mesh.h"
#include "motion/motion_clip.h"

namespace mouthpiece {

/// What the morph targets of a head do to markers on its skin.
struct MarkerShapes {
  MarkerPositions neutral_mm;
  std::vector<std::string> names;         ///< of the shapes
  std::vector<MarkerPositions> moves_mm;  ///< of the markers, at weight 1
};

/// `places` (mesh unit) are carried to the closest skin; a marker there moves as the corners of its triangle do.
/// Throws InputError that begins with `file` when the mesh has no skin.
MarkerShapes markerShapes(const FaceMesh& mesh, const FaceShapes& shapes, const MarkerPositions& places,
                          const std::string& file);

/// The markers at `weights`, frames x shapes (a frame with a NaN: not seen).
PositionMatrix drivenMarkers(const MarkerShapes& shapes, const Eigen::MatrixXd& weights);

}  // namespace mouthpiece
