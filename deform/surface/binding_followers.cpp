// What hangs on skin that lies on the surface: what turns away from it, and parts of their own.
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <boost/pending/disjoint_sets.hpp>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <tuple>

#include "base/smooth_step.h"
#include "deform/surface/binder.h"

namespace mouthpiece {
namespace {

// Lengths as shares of the mouth's width.
/// Rims of lips so near to the surface lie on it, whichever way they face, if what is bound is so far along the mesh.
constexpr double kOnSurface = 0.02, kFarAlong = 0.06;
constexpr double kFadeInside = 0.35;  ///< behind lips, lids and nostrils the motion fades over this way along the mesh
constexpr double kFollows = 0.3;      ///< lashes and the like follow skin that is nearer
constexpr double kRootDepth = 0.03;   ///< what of such a part counts as its root
constexpr int kSmoothings = 60;       ///< of the places of what follows; more than the rows of vertices in a mouth bag

/// Of an eye's width: behind it lies what is no further from both of its corners.
constexpr double kAtEye = 1.2;

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

}  // namespace

void Binder::followAlongMesh() {
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
      if (before[v] != Fate::kOpen || forbidden_[v] != forbidden || !bindRimWhereItLies(v, reach.distance[v])) continue;
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

bool Binder::bindRimWhereItLies(std::uint32_t v, double along) {
  const double width = control_.mouth_width;
  if ((forbidden_[v] & (kUpperLip | kLowerLip)) == 0 || !isSkin(kinds_[v]) || pieces_[v] != face_piece_ ||
      along < kFarAlong * width || distanceToLine(vertex(v), lip_line_) > kOnSurface * width)
    return false;
  const auto foot = projector_.closest(vertex(v), Eigen::Vector3d::Zero(), -1, forbidden_[v]);
  if (!foot || foot->distance > kOnSurface * width) return false;
  place(v, foot->place, 1);
  return true;
}

void Binder::smoothPlaces(const std::vector<Fate>& before) {
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

void Binder::hangOnCorners(const std::array<const char*, 2>& corners, std::uint32_t sides,
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

std::pair<std::uint32_t, double> Binder::nearestOnFace(const std::vector<std::uint32_t>& face, std::uint32_t v) const {
  std::pair<std::uint32_t, float> nearest{0, std::numeric_limits<float>::infinity()};
  for (const std::uint32_t s : face) {
    const float squared = (mesh_.vertices.row(s) - mesh_.vertices.row(v)).squaredNorm();
    if (squared < nearest.second) nearest = {s, squared};
  }
  return {nearest.first, std::sqrt(double{nearest.second})};
}

void Binder::leaveOneSide(const std::vector<std::uint32_t>& parts,
                          std::map<std::uint32_t, std::uint32_t>& rooted_in) const {
  std::map<std::uint32_t, std::map<std::uint32_t, std::size_t>> counts;  // by component, by side
  for (const auto& [root, skin] : rooted_in) ++counts[parts[root]][forbidden_[skin]];
  std::erase_if(rooted_in, [&](const auto& root) {
    const auto& sides = counts.at(parts[root.first]);
    const auto most =
        std::max_element(sides.begin(), sides.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
    return forbidden_[root.second] != most->first;
  });
}

std::vector<std::uint32_t> Binder::loosePartsOf() const {
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

void Binder::followNearby() {
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

}  // namespace mouthpiece
