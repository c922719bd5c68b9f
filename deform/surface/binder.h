#pragma once

#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "deform/mesh/face_mesh.h"
#include "deform/mesh/triangle_tree.h"
#include "deform/surface/bezier_surface.h"
#include "deform/surface/binding.h"
#include "deform/surface/surface_projection.h"
#include "deform/surface/virtual_points.h"
#include "deform/topology/head_topology.h"

namespace mouthpiece {

/// Binds the vertices of one mesh step by step; every step adds to `binding`. binding.cpp: what lies on the surface;
/// binding_followers.cpp: what goes with that.
class Binder {
 public:
  Binder(const FaceMesh& mesh, const HeadTopology& topology, const ControlMesh& control, const BindingOptions& options);

  FaceBinding bind() {
    bindSkinAbove();
    leaveIslands();
    followAlongMesh();
    followNearby();
    giveToJaw();
    carryFar();
    measureOffsets();
    return std::move(binding_);
  }

 private:
  enum class Fate : std::uint8_t { kOpen, kBound, kStill };

  [[nodiscard]] Eigen::Vector3d vertex(std::size_t v) const { return pointAt(mesh_.vertices, v); }
  /// SideBits of the triangle that a vertex is bound to.
  [[nodiscard]] std::uint32_t sidesOfPatch(std::size_t v) const {
    return triangle_sides_[unsignedIndex(binding_.patch[v])];
  }
  /// The piece that most of the control surface lies on: a figure's hands may have more vertices than its face.
  [[nodiscard]] std::uint32_t skinAtMarkers() const;
  [[nodiscard]] bool isOnRing(const SurfaceFoot& foot) const;
  void place(std::size_t v, const SurfacePlace& place, double weight) {
    fates_[v] = Fate::kBound;
    binding_.patch[v] = place.triangle;
    binding_.u[v] = asFloat(place.u);
    binding_.v[v] = asFloat(place.v);
    binding_.skin_weight[v] = asFloat(weight);
  }
  void copyPlace(std::size_t v, std::size_t from, double weight) {
    fates_[v] = Fate::kBound;
    binding_.patch[v] = binding_.patch[from];
    binding_.u[v] = binding_.u[from];
    binding_.v[v] = binding_.v[from];
    binding_.skin_weight[v] = asFloat(weight * double{binding_.skin_weight[from]});
  }
  /// EDGE 6: the closest patch whose normal agrees with the vertex'.
  void bindSkinAbove();
  /// Normals alone let a nostril's wall hang on the other side of the nose. What hangs together along the mesh hangs
  /// together on the surface: where it does not the skin comes apart into islands, of which only the largest stays, and
  /// those that lie on the surface all over.
  void leaveIslands();
  /// Whether other skin lies between a vertex and its place: then it is the wall of a pocket, an eye's socket or a
  /// nostril, which faces as some patch before it does and hangs together with another.
  [[nodiscard]] bool isBehindSkin(std::size_t v, const SurfaceFoot& foot, const TriangleTree& skin) const;
  /// Whether the surface is much nearer than the nearest place whose normal agrees: then the vertex turns away from it,
  /// like the inside of a lip, and what agrees is another part of the face.
  [[nodiscard]] bool isDetour(std::size_t v, const SurfaceFoot& foot) const;
  /// What turns away from the surface (inside of lips, lids, nostrils; the mouth's bag) goes with the nearest bound
  /// vertex along the mesh, less and less; nearest of those on its own side of the mouth and the eyes.
  void followAlongMesh();
  /// Binds a vertex where it lies if it is of a coarse lip's rim and all that is bound is further off than that, by
  /// `along` on the mesh: the nearest may be beside the mouth's corner, and a lip that hangs there does not close.
  bool bindRimWhereItLies(std::uint32_t v, double along);
  /// Two neighbours behind the lips may follow vertices that are centimetres apart, one beside the mouth's corner, one
  /// on the lip: their places in the plane are made harmonic between those of the vertices they follow. Where the upper
  /// lip's side of the mouth's inside meets the lower one's both hang on the corner, or they would part there. Vertices
  /// in one place and on one side count as one.
  void smoothPlaces(const std::vector<Fate>& before);
  /// Puts those of `followers` that are where both sides of an opening meet at its nearer corner, and takes them out.
  void hangOnCorners(const std::array<const char*, 2>& corners, std::uint32_t sides,
                     const std::vector<std::uint32_t>& at_seam, std::vector<std::uint32_t>& followers,
                     std::vector<Eigen::Vector2d>& planes) const;
  [[nodiscard]] Eigen::Vector2d planeOf(std::size_t v) const {
    const auto& [a, b, c] = control_.triangles[unsignedIndex(binding_.patch[v])];
    const double u = binding_.u[v], w = binding_.v[v];
    return (u * control_.domain.row(a) + w * control_.domain.row(b) + (1 - u - w) * control_.domain.row(c)).transpose();
  }
  void follow(std::size_t v, std::size_t source, double weight) {
    if (fates_[source] == Fate::kStill || weight <= 0) {
      fates_[v] = Fate::kStill;
    } else {
      copyPlace(v, source, weight);
    }
  }
  [[nodiscard]] bool isLoosePart(std::size_t v) const {
    return pieces_[v] != face_piece_ && (isSkin(kinds_[v]) || kinds_[v] == PartKind::kOther);
  }
  /// The face's nearest vertex to a place.
  [[nodiscard]] std::pair<std::uint32_t, double> nearestOnFace(const std::vector<std::uint32_t>& face,
                                                               std::uint32_t v) const;
  /// The upper lid's lashes come near the lower one at the eye's corners: a piece keeps the roots on the side of the
  /// eye or mouth that most of its roots are on.
  void leaveOneSide(const std::vector<std::uint32_t>& parts, std::map<std::uint32_t, std::uint32_t>& rooted_in) const;
  /// The part of each vertex: its piece, and what hangs together of the face's that no way along it has reached (lashes
  /// whose vertices lie in the place of a lid's).
  [[nodiscard]] std::vector<std::uint32_t> loosePartsOf() const;
  [[nodiscard]] bool isUnreached(std::size_t v) const {
    return pieces_[v] == face_piece_ && isSkin(kinds_[v]) && fates_[v] == Fate::kOpen;
  }
  /// Parts of their own on the skin (lashes, ears): where they are rooted in the face they move as it does, and each
  /// vertex as the root nearest along the part.
  void followNearby();
  /// Lower teeth and tongue wholly; the mouth's inside by how near it is to the lower lip rather than the upper.
  void giveToJaw();
  /// What hangs behind the rims, or far off the surface where that ends, would swing out when the surface turns.
  void carryFar();
  [[nodiscard]] bool isBehindLips(std::size_t v) const;
  /// Jaw's share of parts of the mouth's inside that hang on nothing (gums): 1 below the mouth's line, 0 above; -1: not
  /// such a part.
  [[nodiscard]] std::vector<float> separateParts() const;
  void measureOffsets();

  const FaceMesh& mesh_;
  const HeadTopology& topology_;
  const std::vector<PartKind>& kinds_;
  const std::vector<std::uint32_t>&pieces_, &forbidden_;
  const ControlMesh& control_;
  const BindingOptions& options_;
  BezierSurface surface_;
  std::vector<std::uint32_t> triangle_sides_;
  SurfaceProjector projector_;
  std::vector<Eigen::Vector3d> lip_line_ = openingsOf(control_).lip_line;
  std::uint32_t face_piece_ = 0;
  std::vector<Fate> fates_;
  FaceBinding binding_;
};

}  // namespace mouthpiece
