#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "deform/topology/head_topology.h"
#include "motion/motion_clip.h"

namespace mouthpiece {

enum class PartKind;
struct FaceMesh;

/// A vertex of the mesh, or a point in its unit.
using AnchorPlace = std::variant<std::uint32_t, Eigen::Vector3d>;

/// Where markers (and virtual points of the control surface) lie on a mesh (docs/formats/anchors.md).
struct Anchors {
  std::map<std::string, AnchorPlace> markers;
  std::map<std::string, PartKind> part_kinds;  ///< by part name
  std::optional<double> metres_per_unit;
};

/// A larger anchors file is not read.
inline constexpr std::uint64_t kMaxAnchorBytes = 16 << 20;

/// Reads JSON; throws InputError with the key at fault.
Anchors parseAnchors(std::string_view json_text, const std::string& file);

/// What parseAnchors() reads.
std::string anchorsBytes(const Anchors& anchors);

/// The place of `name` on `mesh`; nullopt when it is not among the anchors. Throws InputError for a vertex that the
/// mesh lacks.
std::optional<Eigen::Vector3d> placeOf(const Anchors& anchors, const std::string& name, const FaceMesh& mesh,
                                       const std::string& file);

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

/// The similarity that takes the rows of `from`, three or more, nearest to those of `to` by least squares (Umeyama
/// 1991).
Similarity similarityBetween(const MarkerPositions& from, const MarkerPositions& to);

/// The least-squares similarity that takes the actor's markers to the anchors of the same name. Throws InputError
/// that says which anchors are wanted.
Similarity meshFromActor(const FaceMesh& mesh, const Anchors& anchors, const std::string& anchors_file,
                         const std::vector<std::string>& marker_names, const MarkerPositions& actor_neutral_mm);

/// The turn that sets a mesh upright (Y up, Z out of the face), found from the anchors: the identity, quarter turns
/// about the axes, with a turn to the front for a head that looks or leans to a side, or, for one that stands askew,
/// any rotation.
Eigen::Matrix3d uprightFromMesh(const Similarity& mesh_from_actor);

/// Parts that are skin since most of the anchors of lips, nose and chin lie on them, whatever their names say: their
/// kinds are to be set so. Throws InputError when anchors lie far off the mesh, all of them or the one that it names,
/// when right and left or the lips are the wrong way round, and when the mesh is inside out.
std::map<std::string, PartKind> skinUnderAnchors(const FaceMesh& mesh, const Anchors& anchors,
                                                 const std::string& anchors_file);

/// Anchors for all markers, and how those that were not given were placed.
struct PlacedAnchors {
  Anchors anchors;
  std::size_t given = 0;  ///< anchors that the actor has too
  std::size_t placed = 0;
  int rounds = 0;        ///< until nothing moved
  double last_move = 0;  ///< in the last round, mesh unit
};

/// The mouth as four anchors tell it, before anything else is known of a head: the corners and both lips' middles.
/// Throws InputError when one is missing.
FaceOpenings openingsOf(const FaceMesh& mesh, const Anchors& anchors, const std::string& anchors_file);

/// Whether placeMarkers() has something to place.
bool leavesPlacesOpen(const Anchors& anchors, const std::vector<std::string>& marker_names);

/// `anchors` with a place for every marker of the layout and the rims of the lips behind them: a coarse warp of the
/// actor's face onto the given anchors, then turns of carrying each marker to the closest skin that faces outwards (lip
/// markers to their own lip) and smoothing the warp through them, until still. The actor's two sides are averaged
/// first, so a symmetric head gets symmetric markers. The mesh must stand upright; `topology`: its own, by
/// openingsOf(). Throws InputError that says which anchors are wanted.
PlacedAnchors placeMarkers(const FaceMesh& mesh, const HeadTopology& topology, const Anchors& anchors,
                           const std::string& anchors_file, const std::vector<std::string>& marker_names,
                           const MarkerPositions& actor_neutral_mm);

}  // namespace mouthpiece
