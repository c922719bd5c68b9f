#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <boost/pending/disjoint_sets.hpp>
#include <cmath>
#include <map>
#include <numbers>

#include "base/smooth_step.h"
#include "deform/surface/binder.h"

namespace mouthpiece {
namespace {

// Lengths as shares of the mouth's width.
constexpr double kFarFrom = 0.3;      ///< offsets above this bind less and less
constexpr double kFarTo = 0.5;        ///< and above this not at all
constexpr double kBeside = 0.25;      ///< beyond an opening's border by more: not above the surface any more
constexpr double kLayerAbove = 0.05;  ///< the skin that the surface is laid along is no further before it
constexpr double kTornAt = 0.05, kTornTimes = 3;  ///< ends of an edge hang no further apart than this and so many edges
constexpr double kDetour = 0.05;                  ///< a place further off than this has to be about the nearest of all
constexpr double kTurnsAtEnd = 0.1;               ///< where the surface ends, what is nearer to its place turns with it
constexpr double kBagDeep =
    1;  ///< the lower half of a mouth bag goes with the jaw this far along the mesh, and less beyond

}  // namespace

Binder::Binder(const FaceMesh& mesh, const HeadTopology& topology, const ControlMesh& control,
               const BindingOptions& options)
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

std::uint32_t Binder::skinAtMarkers() const {
  std::map<std::uint32_t, std::size_t> points;
  for (std::size_t i = 0; i < control_.points.size(); ++i) {
    if (control_.points[i].fixed) continue;
    if (const auto at = topology_.nearestSkin(control_.rest.row(signedIndex(i)).transpose())) ++points[pieces_[*at]];
  }
  const auto most =
      std::max_element(points.begin(), points.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  return most == points.end() ? 0 : most->first;
}

bool Binder::isOnRing(const SurfaceFoot& foot) const {
  if (!foot.at_border) return false;
  const auto& triangle = control_.triangles[unsignedIndex(foot.place.triangle)];
  int fixed = 0;
  for (const int point : triangle) fixed += control_.points[unsignedIndex(point)].fixed ? 1 : 0;
  return fixed >= 2;
}

void Binder::bindSkinAbove() {
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

void Binder::leaveIslands() {
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

bool Binder::isBehindSkin(std::size_t v, const SurfaceFoot& foot, const TriangleTree& skin) const {
  const Eigen::Vector3d from = vertex(v), place = evaluate(surface_.restPose(), foot.place).position;
  const Eigen::Vector3d way = (place - from).normalized();
  if (way.dot(evaluate(surface_.restPose(), foot.place).normal()) < 0) return false;
  const double width = control_.mouth_width;
  return skin.isBetween(from + 0.5 * kSkinLayer * width * way, place + kLayerAbove * width * way);
}

bool Binder::isDetour(std::size_t v, const SurfaceFoot& foot) const {
  const auto nearest = projector_.closest(vertex(v), Eigen::Vector3d::Zero(), -1, forbidden_[v]);
  return nearest && nearest->distance < 0.5 * foot.distance;
}

void Binder::giveToJaw() {
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

void Binder::carryFar() {
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

bool Binder::isBehindLips(std::size_t v) const {
  if (fates_[v] != Fate::kBound || binding_.skin_weight[v] >= 1) return false;
  return (sidesOfPatch(v) & (kUpperLip | kLowerLip)) != 0;
}

std::vector<float> Binder::separateParts() const {
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

void Binder::measureOffsets() {
  for (std::size_t v = 0; v < kinds_.size(); ++v) {
    if (binding_.patch[v] < 0 || isCarried(binding_, v)) continue;
    const SurfacePoint s = evaluate(surface_.restPose(), binding_.placeOf(v));
    binding_.d[v] = asFloat((vertex(v) - s.position).dot(s.normal()));
  }
}

FaceBinding bindFace(const FaceMesh& mesh, const HeadTopology& topology, const ControlMesh& control,
                     const BindingOptions& options) {
  return Binder(mesh, topology, control, options).bind();
}
FaceBinding bindFace(const FaceMesh& mesh, const ControlMesh& control, const BindingOptions& options) {
  return bindFace(mesh, HeadTopology(mesh, openingsOf(control)), control, options);
}

}  // namespace mouthpiece
