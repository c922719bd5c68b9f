#include "deform/surface/binding.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <boost/pending/disjoint_sets.hpp>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <set>
#include <tuple>

#include "base/errors.h"
#include "base/smooth_step.h"
#include "deform/mesh/face_mesh.h"
#include "deform/mesh/triangle_tree.h"
#include "deform/surface/bezier_surface.h"
#include "deform/surface/surface_projection.h"
#include "deform/surface/virtual_points.h"

namespace mouthpiece {
namespace {

// Lengths as shares of the mouth's width.
constexpr double kFarFrom = 0.3;      ///< offsets above this bind less and less
constexpr double kFarTo = 0.5;        ///< and above this not at all
constexpr double kBeside = 0.25;      ///< beyond an opening's border by more: not above the surface any more
constexpr double kLayerAbove = 0.05;  ///< the skin that the surface is laid along is no further before it
constexpr double kTornAt = 0.05, kTornTimes = 3;  ///< ends of an edge hang no further apart than this and so many edges
constexpr double kDetour = 0.05;                  ///< a place further off than this has to be about the nearest of all
/// Rims of lips so near to the surface lie on it, whichever way they face, if what is bound is so far along the mesh.
constexpr double kOnSurface = 0.02, kFarAlong = 0.06;
constexpr double kFadeInside = 0.35;  ///< behind lips, lids and nostrils the motion fades over this way along the mesh
constexpr double kTurnsAtEnd = 0.1;   ///< where the surface ends, what is nearer to its place turns with it
constexpr double kFollows = 0.3;      ///< lashes and the like follow skin that is nearer
constexpr double kRootDepth = 0.03;   ///< what of such a part counts as its root

constexpr double kBagDeep =
    1;  ///< the lower half of a mouth bag goes with the jaw this far along the mesh, and less beyond
constexpr int kSmoothings = 60;  ///< of the places of what follows; more than the rows of vertices in a mouth bag

/// Of an eye's width: behind it lies what is no further from both of its corners.
constexpr double kAtEye = 1.2;

enum class Fate : std::uint8_t { kOpen, kBound, kStill };

bool mayBind(PartKind kind) { return isSkin(kind) || kind == PartKind::kMouthInside || kind == PartKind::kOther; }

/// The control mesh in its plane.
class PlaneTriangles {
 public:
  PlaneTriangles(const ControlMesh& control, const std::vector<std::uint32_t>& sides) : sides_(sides) {
    for (const auto& [a, b, c] : control.triangles) {
      Eigen::Matrix2d edges;
      edges << (control.domain.row(a) - control.domain.row(c)).transpose(),
          (control.domain.row(b) - control.domain.row(c)).transpose();
      triangles_.push_back({edges.inverse(), control.domain.row(c).transpose()});
    }
  }

  /// The place at `p`, or the one that least misses it, on no triangle of the forbidden sides.
  [[nodiscard]] SurfacePlace nearest(const Eigen::Vector2d& p, std::uint32_t forbidden) const {
    SurfacePlace best{-1, 0, 0};
    double least = -std::numeric_limits<double>::infinity();
    for (std::size_t t = 0; t < triangles_.size(); ++t) {
      if ((sides_[t] & forbidden) != 0) continue;
      const Eigen::Vector2d uv = triangles_[t].shares * (p - triangles_[t].last);
      const Eigen::Vector3d weights(uv.x(), uv.y(), 1 - uv.sum());
      if (weights.minCoeff() <= least) continue;
      least = weights.minCoeff();
      const Eigen::Vector3d inside = weights.cwiseMax(0) / weights.cwiseMax(0).sum();
      best = {static_cast<int>(t), inside.x(), inside.y()};
      if (least >= 0) break;
    }
    return best;
  }

 private:
  struct Flat {
    Eigen::Matrix2d shares;
    Eigen::Vector2d last;
  };
  std::vector<Flat> triangles_;
  const std::vector<std::uint32_t>& sides_;
};

/// Binds the vertices of one mesh step by step; every step adds to `binding`.
class Binder {
 public:
  Binder(const FaceMesh& mesh, const HeadTopology& topology, const ControlMesh& control, const BindingOptions& options)
      : mesh_(mesh),
        topology_(topology),
        kinds_(topology.kinds()),
        pieces_(topology.pieces()),
        forbidden_(topology.forbidden()),
        control_(control),
        options_(options),
        surface_(control),
        triangle_sides_(triangleSides(control)),
        projector_(surface_, control, triangle_sides_),
        fates_(kinds_.size(), Fate::kOpen) {
    face_piece_ = skinAtMarkers();
    binding_.patch.assign(kinds_.size(), -1);
    for (auto* column : {&binding_.u, &binding_.v, &binding_.d, &binding_.skin_weight, &binding_.jaw_weight})
      column->assign(kinds_.size(), 0.0F);
  }

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
  [[nodiscard]] Eigen::Vector3d vertex(std::size_t v) const { return pointAt(mesh_.vertices, v); }
  /// SideBits of the triangle that a vertex is bound to.
  [[nodiscard]] std::uint32_t sidesOfPatch(std::size_t v) const {
    return triangle_sides_[unsignedIndex(binding_.patch[v])];
  }

  /// The piece that most of the control surface lies on: a figure's hands may have more vertices than its face.
  [[nodiscard]] std::uint32_t skinAtMarkers() const {
    std::map<std::uint32_t, std::size_t> points;
    for (std::size_t i = 0; i < control_.points.size(); ++i) {
      if (control_.points[i].fixed) continue;
      if (const auto at = topology_.nearestSkin(control_.rest.row(signedIndex(i)).transpose())) ++points[pieces_[*at]];
    }
    const auto most = std::max_element(points.begin(), points.end(),
                                       [](const auto& a, const auto& b) { return a.second < b.second; });
    return most == points.end() ? 0 : most->first;
  }

  [[nodiscard]] bool isOnRing(const SurfaceFoot& foot) const {
    if (!foot.at_border) return false;
    const auto& triangle = control_.triangles[unsignedIndex(foot.place.triangle)];
    int fixed = 0;
    for (const int point : triangle) fixed += control_.points[unsignedIndex(point)].fixed ? 1 : 0;
    return fixed >= 2;
  }

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
  void bindSkinAbove() {
    const VertexPositions normals = vertexNormals(mesh_.vertices, mesh_.triangles);
    const double least_cosine = std::cos(options_.max_normal_angle_deg * std::numbers::pi / 180);
    const double width = control_.mouth_width;
    const TriangleTree skin(mesh_.vertices, trianglesOf(mesh_, {PartKind::kSkin, PartKind::kLips}),
                            TriangleTree::Use::kWithoutStarts);
    const Eigen::Vector3d reach = Eigen::Vector3d::Constant(kFarTo * width);
    const Eigen::AlignedBox3d near(control_.rest.colwise().minCoeff().transpose() - reach,
                                   control_.rest.colwise().maxCoeff().transpose() + reach);
    for (std::size_t v = 0; v < kinds_.size(); ++v) {
      // What lies in the mouth goes along with the lips, whichever way it faces.
      if (!isSkin(kinds_[v]) || pieces_[v] != face_piece_ || topology_.isInMouth(v)) continue;
      if (!near.contains(vertex(v))) {
        fates_[v] = Fate::kStill;
        continue;
      }
      const auto foot = projector_.closest(vertex(v), pointAt(normals, v), least_cosine, forbidden_[v]);
      if (!foot || (foot->distance > kDetour * width && isDetour(v, *foot))) continue;
      if (foot->distance > kSkinLayer * width && isBehindSkin(v, *foot, skin)) continue;
      if (isOnRing(*foot)) {
        fates_[v] = Fate::kStill;
        continue;
      }
      if (foot->distance > kFarTo * width || (foot->at_border && foot->distance > kBeside * width)) continue;
      place(v, foot->place, 1 - smoothStep((foot->distance - kFarFrom * width) / ((kFarTo - kFarFrom) * width)));
    }
  }

  /// Normals alone let a nostril's wall hang on the other side of the nose. What hangs together along the mesh hangs
  /// together on the surface: where it does not the skin comes apart into islands, of which only the largest stays, and
  /// those that lie on the surface all over.
  void leaveIslands() {
    const double width = control_.mouth_width;
    std::vector<std::uint32_t> first_in_place(kinds_.size());
    std::map<std::array<float, 3>, std::uint32_t> first_at;
    for (std::uint32_t v = 0; v < kinds_.size(); ++v) {
      const auto p = mesh_.vertices.row(v);
      if (fates_[v] == Fate::kBound) first_in_place[v] = first_at.try_emplace({p.x(), p.y(), p.z()}, v).first->second;
    }
    boost::disjoint_sets_with_storage<> islands(kinds_.size());
    for (const Triangle& t : mesh_.triangles) {
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t a = t[k], b = t[(k + 1) % 3];
        if (fates_[a] != Fate::kBound || fates_[b] != Fate::kBound) continue;
        const double apart = (planeOf(a) - planeOf(b)).norm();
        if (apart < kTornAt * width + kTornTimes * (vertex(a) - vertex(b)).norm()) islands.union_set(a, b);
      }
    }
    // A texture's seam is no shore, and lips that touch hang together around their corners anyway.
    for (std::uint32_t v = 0; v < kinds_.size(); ++v) {
      if (fates_[v] == Fate::kBound && (planeOf(v) - planeOf(first_in_place[v])).norm() < kTornAt * width)
        islands.union_set(v, first_in_place[v]);
    }
    struct Island {
      std::size_t size = 0;
      double off = 0;  ///< sum of the distances from the surface
    };
    std::map<std::size_t, Island> found;
    for (std::uint32_t v = 0; v < kinds_.size(); ++v) {
      if (fates_[v] != Fate::kBound) continue;
      Island& island = found[islands.find_set(v)];
      ++island.size;
      island.off += (vertex(v) - evaluate(surface_.restPose(), binding_.placeOf(v)).position).norm();
    }
    const auto largest = std::max_element(found.begin(), found.end(),
                                          [](const auto& a, const auto& b) { return a.second.size < b.second.size; });
    for (std::uint32_t v = 0; v < kinds_.size(); ++v) {
      if (fates_[v] != Fate::kBound) continue;
      const auto at = found.find(islands.find_set(v));
      if (at == largest || at->second.off < kSkinLayer * width * asReal(at->second.size)) continue;
      fates_[v] = Fate::kOpen;
      binding_.patch[v] = -1;
      binding_.u[v] = binding_.v[v] = binding_.skin_weight[v] = 0;
    }
  }

  /// Whether other skin lies between a vertex and its place: then it is the wall of a pocket, an eye's socket or a
  /// nostril, which faces as some patch before it does and hangs together with another.
  [[nodiscard]] bool isBehindSkin(std::size_t v, const SurfaceFoot& foot, const TriangleTree& skin) const {
    const Eigen::Vector3d from = vertex(v), place = evaluate(surface_.restPose(), foot.place).position;
    const Eigen::Vector3d way = (place - from).normalized();
    if (way.dot(evaluate(surface_.restPose(), foot.place).normal()) < 0) return false;
    const double width = control_.mouth_width;
    return skin.isBetween(from + 0.5 * kSkinLayer * width * way, place + kLayerAbove * width * way);
  }

  /// Whether the surface is much nearer than the nearest place whose normal agrees: then the vertex turns away from it,
  /// like the inside of a lip, and what agrees is another part of the face.
  [[nodiscard]] bool isDetour(std::size_t v, const SurfaceFoot& foot) const {
    const auto nearest = projector_.closest(vertex(v), Eigen::Vector3d::Zero(), -1, forbidden_[v]);
    return nearest && nearest->distance < 0.5 * foot.distance;
  }

  /// What turns away from the surface (inside of lips, lids, nostrils; the mouth's bag) goes with the nearest bound
  /// vertex along the mesh, less and less; nearest of those on its own side of the mouth and the eyes.
  void followAlongMesh() {
    std::set<std::uint32_t> sides;
    for (std::size_t v = 0; v < kinds_.size(); ++v) {
      if (fates_[v] == Fate::kOpen && mayBind(kinds_[v])) sides.insert(forbidden_[v]);
    }
    std::vector<Fate> before = fates_;
    for (const std::uint32_t forbidden : sides) {
      std::vector<std::uint32_t> seeds;
      for (std::uint32_t v = 0; v < kinds_.size(); ++v) {
        const bool is_bound = before[v] == Fate::kBound && (sidesOfPatch(v) & forbidden) == 0;
        if (is_bound || before[v] == Fate::kStill) seeds.push_back(v);
      }
      const auto reachOver = [&](double longest_edge) {
        return topology_.reachFrom(
            seeds, [&](std::uint32_t v) { return before[v] == Fate::kOpen && mayBind(kinds_[v]); },
            longest_edge * control_.mouth_width);
      };
      HeadTopology::Reach reach = reachOver(std::numeric_limits<double>::infinity());
      const std::size_t seeds_before = seeds.size();
      for (std::uint32_t v = 0; v < kinds_.size(); ++v) {
        if (before[v] != Fate::kOpen || forbidden_[v] != forbidden || !bindRimWhereItLies(v, reach.distance[v]))
          continue;
        before[v] = Fate::kBound;
        seeds.push_back(v);
      }
      if (seeds.size() > seeds_before || std::isfinite(options_.longest_edge)) reach = reachOver(options_.longest_edge);
      for (std::size_t v = 0; v < kinds_.size(); ++v) {
        if (before[v] != Fate::kOpen || forbidden_[v] != forbidden || reach.source[v] < 0) continue;
        const double weight = 1 - smoothStep(reach.distance[v] / (kFadeInside * control_.mouth_width));
        follow(v, unsignedIndex(reach.source[v]), weight);
        // A pocket's wall would swing out where the skin before it turns.
        if (fates_[v] == Fate::kBound) binding_.carried.push_back(static_cast<std::uint32_t>(v));
      }
    }
    smoothPlaces(before);
  }

  /// Binds a vertex where it lies if it is of a coarse lip's rim and all that is bound is further off than that, by
  /// `along` on the mesh: the nearest may be beside the mouth's corner, and a lip that hangs there does not close.
  bool bindRimWhereItLies(std::uint32_t v, double along) {
    const double width = control_.mouth_width;
    if ((forbidden_[v] & (kUpperLip | kLowerLip)) == 0 || !isSkin(kinds_[v]) || pieces_[v] != face_piece_ ||
        along < kFarAlong * width || distanceToLine(vertex(v), lip_line_) > kOnSurface * width)
      return false;
    const auto foot = projector_.closest(vertex(v), Eigen::Vector3d::Zero(), -1, forbidden_[v]);
    if (!foot || foot->distance > kOnSurface * width) return false;
    place(v, foot->place, 1);
    return true;
  }

  /// Two neighbours behind the lips may follow vertices that are centimetres apart, one beside the mouth's corner, one
  /// on the lip: their places in the plane are made harmonic between those of the vertices they follow. Where the upper
  /// lip's side of the mouth's inside meets the lower one's both hang on the corner, or they would part there. Vertices
  /// in one place and on one side count as one.
  void smoothPlaces(const std::vector<Fate>& before) {
    const auto follows = [&](std::size_t v) { return before[v] == Fate::kOpen && fates_[v] == Fate::kBound; };
    std::map<std::tuple<float, float, float, std::uint32_t>, std::uint32_t> first_at;
    std::vector<std::uint32_t> knot(kinds_.size());
    std::vector<Eigen::Vector2d> planes(kinds_.size(), Eigen::Vector2d::Zero());
    std::vector<std::uint32_t> followers;
    for (std::uint32_t v = 0; v < kinds_.size(); ++v) {
      if (fates_[v] != Fate::kBound) continue;
      const Eigen::RowVector3f p = mesh_.vertices.row(v);
      const auto [at, is_new] = first_at.try_emplace({p.x(), p.y(), p.z(), forbidden_[v]}, v);
      knot[v] = at->second;
      if (!is_new) continue;
      planes[v] = planeOf(v);
      if (follows(v)) followers.push_back(v);
    }
    std::vector<std::vector<std::uint32_t>> beside(kinds_.size());
    std::vector<std::uint32_t> at_seam(kinds_.size(), 0);  ///< bits of the openings whose two sides meet there
    for (const Triangle& triangle : mesh_.triangles) {
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t a = triangle[k], b = triangle[(k + 1) % 3];
        if (fates_[a] != Fate::kBound || fates_[b] != Fate::kBound) continue;
        if (forbidden_[a] != forbidden_[b]) {
          for (const std::uint32_t v : {knot[a], knot[b]}) at_seam[v] |= forbidden_[a] ^ forbidden_[b];
          continue;
        }
        if (follows(knot[a])) beside[knot[a]].push_back(knot[b]);
        if (follows(knot[b])) beside[knot[b]].push_back(knot[a]);
      }
    }
    hangOnCorners({"RIM_CORNER_R", "RIM_CORNER_L"}, kUpperLip | kLowerLip, at_seam, followers, planes);
    hangOnCorners({"CANTHUS_OUT_R", "EYE_IN_R"}, kUpperLidRight | kLowerLidRight, at_seam, followers, planes);
    hangOnCorners({"CANTHUS_OUT_L", "EYE_IN_L"}, kUpperLidLeft | kLowerLidLeft, at_seam, followers, planes);
    for (int i = 0; i < kSmoothings; ++i) {
      for (const std::uint32_t v : followers) {
        if (beside[v].empty()) continue;
        Eigen::Vector2d sum = Eigen::Vector2d::Zero();
        for (const std::uint32_t other : beside[v]) sum += planes[other];
        planes[v] = sum / asReal(beside[v].size());
      }
    }
    const PlaneTriangles triangles(control_, triangle_sides_);
    for (std::uint32_t v = 0; v < kinds_.size(); ++v) {
      if (!follows(v)) continue;
      const SurfacePlace at = triangles.nearest(planes[knot[v]], forbidden_[v]);
      if (at.triangle >= 0) place(v, at, double{binding_.skin_weight[v]});
    }
  }

  /// Puts those of `followers` that are where both sides of an opening meet at its nearer corner, and takes them out.
  void hangOnCorners(const std::array<const char*, 2>& corners, std::uint32_t sides,
                     const std::vector<std::uint32_t>& at_seam, std::vector<std::uint32_t>& followers,
                     std::vector<Eigen::Vector2d>& planes) const {
    const int one = findPoint(control_, corners[0]), other = findPoint(control_, corners[1]);
    if (one < 0 || other < 0) return;
    const bool is_mouth = (sides & kUpperLip) != 0;
    const double width = (control_.rest.row(one) - control_.rest.row(other)).norm();
    std::erase_if(followers, [&](std::uint32_t v) {
      if ((at_seam[v] & sides) == 0 || (is_mouth && !topology_.isInMouth(v))) return false;
      const auto distance = [&](int corner) { return (vertex(v) - control_.rest.row(corner).transpose()).norm(); };
      // The line between one eye's sides goes on around the head and through the other eye.
      if (!is_mouth && std::max(distance(one), distance(other)) > kAtEye * width) return false;
      planes[v] = control_.domain.row(distance(one) < distance(other) ? one : other).transpose();
      return true;
    });
  }

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
                                                               std::uint32_t v) const {
    std::pair<std::uint32_t, float> nearest{0, std::numeric_limits<float>::infinity()};
    for (const std::uint32_t s : face) {
      const float squared = (mesh_.vertices.row(s) - mesh_.vertices.row(v)).squaredNorm();
      if (squared < nearest.second) nearest = {s, squared};
    }
    return {nearest.first, std::sqrt(double{nearest.second})};
  }

  /// The upper lid's lashes come near the lower one at the eye's corners: a piece keeps the roots on the side of the
  /// eye or mouth that most of its roots are on.
  void leaveOneSide(const std::vector<std::uint32_t>& parts, std::map<std::uint32_t, std::uint32_t>& rooted_in) const {
    std::map<std::uint32_t, std::map<std::uint32_t, std::size_t>> counts;  // by component, by side
    for (const auto& [root, skin] : rooted_in) ++counts[parts[root]][forbidden_[skin]];
    std::erase_if(rooted_in, [&](const auto& root) {
      const auto& sides = counts.at(parts[root.first]);
      const auto most = std::max_element(sides.begin(), sides.end(),
                                         [](const auto& a, const auto& b) { return a.second < b.second; });
      return forbidden_[root.second] != most->first;
    });
  }

  /// The part of each vertex: its piece, and what hangs together of the face's that no way along it has reached (lashes
  /// whose vertices lie in the place of a lid's).
  [[nodiscard]] std::vector<std::uint32_t> loosePartsOf() const {
    boost::disjoint_sets_with_storage<> unreached(kinds_.size());
    for (const Triangle& t : mesh_.triangles) {
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t a = t[k], b = t[(k + 1) % 3];
        if (isUnreached(a) && isUnreached(b)) unreached.union_set(a, b);
      }
    }
    std::vector<std::uint32_t> parts = pieces_;
    for (std::uint32_t v = 0; v < parts.size(); ++v) {
      if (isUnreached(v)) parts[v] = static_cast<std::uint32_t>(kinds_.size() + unreached.find_set(v));
    }
    return parts;
  }
  [[nodiscard]] bool isUnreached(std::size_t v) const {
    return pieces_[v] == face_piece_ && isSkin(kinds_[v]) && fates_[v] == Fate::kOpen;
  }

  /// Parts of their own on the skin (lashes, ears): where they are rooted in the face they move as it does, and each
  /// vertex as the root nearest along the part.
  void followNearby() {
    const std::vector<std::uint32_t> parts = loosePartsOf();
    std::vector<bool> is_loose(kinds_.size());
    std::vector<std::uint32_t> face, loose;
    for (std::uint32_t v = 0; v < kinds_.size(); ++v) {
      is_loose[v] = isLoosePart(v) || isUnreached(v);
      if (is_loose[v])
        loose.push_back(v);
      else if (isSkin(kinds_[v]) && fates_[v] != Fate::kOpen)
        face.push_back(v);
    }
    if (face.empty()) return;
    std::vector<std::pair<std::uint32_t, double>> nearest;
    std::map<std::uint32_t, double> gaps;  // of each part from the face
    for (const std::uint32_t v : loose) {
      nearest.push_back(nearestOnFace(face, v));
      const auto gap = gaps.emplace(parts[v], nearest.back().second).first;
      gap->second = std::min(gap->second, nearest.back().second);
    }
    std::map<std::uint32_t, std::uint32_t> rooted_in;
    const double width = control_.mouth_width;
    for (std::size_t i = 0; i < loose.size(); ++i) {
      if (nearest[i].second > kFollows * width || nearest[i].second > gaps[parts[loose[i]]] + kRootDepth * width)
        continue;
      rooted_in.emplace(loose[i], nearest[i].first);
    }
    leaveOneSide(parts, rooted_in);
    std::vector<std::uint32_t> roots;
    for (const auto& [root, skin] : rooted_in) roots.push_back(root);
    const auto reach = topology_.reachFrom(roots, [&](std::uint32_t v) { return is_loose[v]; });
    for (const std::uint32_t v : loose) {
      if (reach.source[v] < 0) continue;
      follow(v, rooted_in.at(static_cast<std::uint32_t>(reach.source[v])), 1);
      if (fates_[v] == Fate::kBound) binding_.carried.push_back(v);
    }
  }

  /// Lower teeth and tongue wholly; the mouth's inside by how near it is to the lower lip rather than the upper.
  void giveToJaw() {
    const std::vector<float> separate = separateParts();
    for (std::size_t v = 0; v < kinds_.size(); ++v) {
      float& jaw = binding_.jaw_weight[v];
      if (kinds_[v] == PartKind::kLowerTeeth || kinds_[v] == PartKind::kTongue) {
        jaw = 1;
      } else if (separate[v] >= 0 && kinds_[v] == PartKind::kMouthInside) {
        jaw = separate[v];
      } else if (kinds_[v] == PartKind::kMouthInside || isBehindLips(v)) {
        jaw = asFloat(smoothStep((topology_.lowerShare(v) - 0.35) / 0.3));
      } else if (topology_.isInMouth(v) && isSkin(kinds_[v])) {
        // Of one material with the face, the bag ends where a head's inner wall may begin.
        const double far = topology_.wayToLowerLip()[v] / control_.mouth_width;
        jaw = asFloat(smoothStep((topology_.lowerShare(v) - 0.35) / 0.3) * (1 - smoothStep(far - kBagDeep)));
      }
    }
  }

  /// What hangs behind the rims, or far off the surface where that ends, would swing out when the surface turns.
  void carryFar() {
    for (std::uint32_t v = 0; v < kinds_.size(); ++v) {
      if (binding_.patch[v] < 0) continue;
      const auto& corners = control_.triangles[unsignedIndex(binding_.patch[v])];
      const bool is_at_ring = std::any_of(corners.begin(), corners.end(),
                                          [&](int corner) { return control_.points[unsignedIndex(corner)].fixed; });
      const auto isFar = [&] {
        const SurfacePoint place = evaluate(surface_.restPose(), binding_.placeOf(v));
        return (vertex(v) - place.position).norm() > kTurnsAtEnd * control_.mouth_width;
      };
      if (topology_.isInMouth(v) || (is_at_ring && isFar())) binding_.carried.push_back(v);
    }
    std::sort(binding_.carried.begin(), binding_.carried.end());
    binding_.carried.erase(std::unique(binding_.carried.begin(), binding_.carried.end()), binding_.carried.end());
  }

  [[nodiscard]] bool isBehindLips(std::size_t v) const {
    if (fates_[v] != Fate::kBound || binding_.skin_weight[v] >= 1) return false;
    return (sidesOfPatch(v) & (kUpperLip | kLowerLip)) != 0;
  }

  /// Jaw's share of parts of the mouth's inside that hang on nothing (gums): 1 below the mouth's line, 0 above; -1: not
  /// such a part.
  [[nodiscard]] std::vector<float> separateParts() const {
    const std::size_t count = pieces_.empty() ? 0 : *std::max_element(pieces_.begin(), pieces_.end()) + 1;
    std::vector<bool> has_skin(count, false);
    std::vector<double> height(count, 0), size(count, 0);
    for (std::size_t v = 0; v < kinds_.size(); ++v) {
      const std::uint32_t piece = pieces_[v];
      has_skin[piece] = has_skin[piece] || isSkin(kinds_[v]);
      height[piece] += vertex(v).y();
      size[piece] += 1;
    }
    double line = 0, rim = 0;
    for (std::size_t i = 0; i < control_.points.size(); ++i) {
      if (control_.points[i].rule != PointRule::kInnerLip) continue;
      line += control_.rest(signedIndex(i), 1);
      rim += 1;
    }
    std::vector<float> share(kinds_.size(), -1.0F);
    for (std::size_t v = 0; v < kinds_.size(); ++v) {
      const std::uint32_t piece = pieces_[v];
      if (!has_skin[piece]) share[v] = height[piece] / size[piece] < line / std::max(rim, 1.0) ? 1.0F : 0.0F;
    }
    return share;
  }

  void measureOffsets() {
    for (std::size_t v = 0; v < kinds_.size(); ++v) {
      if (binding_.patch[v] < 0 || isCarried(binding_, v)) continue;
      const SurfacePoint s = evaluate(surface_.restPose(), binding_.placeOf(v));
      binding_.d[v] = asFloat((vertex(v) - s.position).dot(s.normal()));
    }
  }

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

}  // namespace

FaceBinding bindFace(const FaceMesh& mesh, const HeadTopology& topology, const ControlMesh& control,
                     const BindingOptions& options) {
  return Binder(mesh, topology, control, options).bind();
}
FaceBinding bindFace(const FaceMesh& mesh, const ControlMesh& control, const BindingOptions& options) {
  return bindFace(mesh, HeadTopology(mesh, openingsOf(control)), control, options);
}

}  // namespace mouthpiece
