#pragma once

#include <string>
#include <vector>

#include "deform/mesh/face_mesh.h"
#include "motion/motion_clip.h"
#include "retarget/placing/anchors.h"

namespace mouthpiece {

/// A few anchors are enough to place all markers; these four must be among them, and as many in all.
inline constexpr std::size_t kLeastAnchors = 8;
const std::vector<std::string>& requiredAnchors();

/// A similarity y = scale turn x + shift.
struct Similarity {
  double scale = 1;
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();

  [[nodiscard]] Eigen::Vector3d operator()(const Eigen::Vector3d& x) const { return scale * (turn * x) + shift; }
};

/// The least-squares similarity that takes the actor's markers to the anchors of the same name. Throws InputError
/// that says which anchors are wanted.
Similarity meshFromActor(const FaceMesh& mesh, const Anchors& anchors, const std::string& anchors_file,
                         const std::vector<std::string>& marker_names, const MarkerPositions& actor_neutral_mm);

/// The turn that sets a mesh upright (Y up, Z out of the face), found from the anchors: the identity, quarter turns
/// about the axes, or, for a head that stands askew, any rotation.
Eigen::Matrix3d uprightFromMesh(const Similarity& mesh_from_actor);

/// How the markers without an anchor were placed.
struct PlacingReport {
  std::size_t anchors = 0;
  std::size_t placed = 0;
  int rounds = 0;        ///< until nothing moved
  double last_move = 0;  ///< in the last round, mesh unit
};

/// Whether withAllMarkers() has something to place.
bool leavesPlacesOpen(const Anchors& anchors, const std::vector<std::string>& marker_names);

/// `anchors` with a place for every marker of the layout and the rims of the lips behind them: a coarse warp of the
/// actor's face onto the given anchors, then turns of carrying each marker to the closest skin that faces outwards (lip
/// markers to their own lip) and smoothing the warp through them, until still. The actor's two sides are averaged
/// first, so a symmetric head gets symmetric markers. The mesh must stand upright. Throws InputError that says which
/// anchors are wanted.
Anchors withAllMarkers(const FaceMesh& mesh, const Anchors& anchors, const std::string& anchors_file,
                       const std::vector<std::string>& marker_names, const MarkerPositions& actor_neutral_mm,
                       PlacingReport* report = nullptr);

}  // namespace mouthpiece
