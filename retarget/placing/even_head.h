#pragma once

#include <Eigen/Core>
#include <optional>
#include <utility>
#include <vector>

#include "deform/mesh/triangles.h"

namespace mouthpiece {

class ActorPlaces;
struct FaceMesh;
struct Similarity;

/// A head that a plane mirrors onto itself, its mouth too.
class EvenHead {
 public:
  /// nullopt for a head that is not alike on both sides, or an actor without eye corners to tell where to look. `mesh`
  /// must stand upright, and `mesh_from_actor` be about right for it.
  static std::optional<EvenHead> of(const FaceMesh& mesh, const Similarity& mesh_from_actor, const ActorPlaces& actor);

  [[nodiscard]] Eigen::Vector3d mirrored(const Eigen::Vector3d& place) const {
    return place - 2 * (normal_.dot(place) - offset_) * normal_;
  }
  /// In the plane, halfway between `right` and the mirror image of `left`, or of itself.
  [[nodiscard]] Eigen::Vector3d halfway(const Eigen::Vector3d& right, const Eigen::Vector3d& left) const {
    return 0.5 * (right + mirrored(left));
  }

  /// Where the plane cuts triangles: pieces of a profile.
  using Profile = std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>>;
  [[nodiscard]] Profile profileOf(const FaceMesh& mesh, const std::vector<Triangle>& triangles) const;

 private:
  EvenHead(Eigen::Vector3d normal, double offset) : normal_(std::move(normal)), offset_(offset) {}

  Eigen::Vector3d normal_;
  double offset_;
};

/// The point of a profile that is closest to `place`; nullopt of an empty one.
std::optional<Eigen::Vector3d> closestOn(const EvenHead::Profile& profile, const Eigen::Vector3d& place);

}  // namespace mouthpiece
