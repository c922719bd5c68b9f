#include "deform/mouth/lip_tuck.h"

#include <algorithm>
#include <limits>

#include "base/smooth_step.h"

namespace mouthpiece {
namespace {

// Lengths as shares of the mouth's width.
constexpr double kBeside = 0.06;       ///< teeth so far to both sides tell where the edge is
constexpr double kEdge = 0.02;         ///< the edge is as high as this
constexpr double kFront = 0.15;        ///< and no further behind the foremost tooth there
constexpr double kUnder = 0.01;        ///< the rim lies so far under it
constexpr double kBefore = 0.03;       ///< and so far before lower teeth: the inner side of the lip lies between
constexpr double kUpright = 0.06;      ///< lower teeth are looked at so far under it
constexpr double kShown = 0.03;        ///< the upper lip shows so much of the teeth
constexpr double kFurthestTuck = 0.2;  ///< no rim goes further: what lies there is no row of teeth
constexpr double kWhole = 0.4;         ///< of the way from the middle to the corner the lip goes the whole way
constexpr double kFades = 0.5;         ///< of it, on which that ends
constexpr double kPassesUnder = 0.04;  ///< on its way the lower rim passes so far under the upper one
constexpr double kMarkerShare = 0.3;   ///< of its rim's way a lip's outer edge goes along
/// Without teeth nothing but the lip tells an F: its outer edge goes by so much of what its rim is then over and behind
/// it, so that thick lips and thin ones get thinner by the same share.
constexpr double kThinnedUp = 0.3, kThinnedBack = 0.2;
/// The chin goes along as far as this from a lip's outer edge, and by so much of that edge's way beside it: the walls
/// of mouths, which thin lips lie close before, go along little. Without teeth the edge goes up further, and the chin
/// with it, or it would bulge.
constexpr double kSkinReach = 0.45, kSkinShare = 0.4, kToothlessSkinReach = 0.8;

/// How far a lip that is tucked by `tuck` goes down to pass under the other's edge: not at all at both ends, wholly at
/// two thirds, where it would go through that edge.
double goesUnder(double tuck) { return 27.0 / 4 * tuck * tuck * (1 - tuck); }

/// The middle of the edge of the upper teeth that lie behind or before `rim`; false without teeth.
bool edgeAt(const std::vector<Eigen::Vector3d>& teeth, const Eigen::Vector3d& rim, double mouth,
            Eigen::Vector3d& edge) {
  double foremost = -std::numeric_limits<double>::infinity(), lowest = -foremost;
  const auto is_near = [&](const Eigen::Vector3d& p) { return std::abs(p.x() - rim.x()) < kBeside * mouth; };
  for (const Eigen::Vector3d& p : teeth) {
    if (is_near(p)) foremost = std::max(foremost, p.z());
  }
  const auto is_front = [&](const Eigen::Vector3d& p) { return is_near(p) && p.z() > foremost - kFront * mouth; };
  for (const Eigen::Vector3d& p : teeth) {
    if (is_front(p)) lowest = std::min(lowest, p.y());
  }
  double front = -std::numeric_limits<double>::infinity(), back = -front;
  for (const Eigen::Vector3d& p : teeth) {
    if (!is_front(p) || p.y() > lowest + kEdge * mouth) continue;
    front = std::max(front, p.z());
    back = std::min(back, p.z());
  }
  edge = {rim.x(), lowest, 0.5 * (front + back)};
  return front >= back;
}

/// How far in front the lip must stay of the lower teeth, which may stand right under the upper ones' edge.
double leastDepth(const std::vector<Eigen::Vector3d>& lower_teeth, const Eigen::Vector3d& place, double mouth) {
  double least = -std::numeric_limits<double>::infinity();
  for (const Eigen::Vector3d& p : lower_teeth) {
    if (std::abs(p.x() - place.x()) < kBeside * mouth && p.y() > place.y() - kUpright * mouth)
      least = std::max(least, p.z() + kBefore * mouth);
  }
  return least;
}

std::vector<Eigen::Vector3d> pointsOf(const FaceMesh& mesh, PartKind kind) {
  std::vector<Eigen::Vector3d> points;
  for (const Triangle& triangle : trianglesOf(mesh, {kind})) {
    for (const std::uint32_t v : triangle) points.push_back(pointAt(mesh.vertices, v));
  }
  return points;
}

}  // namespace

/// Skin under the lip goes along the less the further it is from the lip's edge, or it would bulge where the lip goes
/// in: the surface is as smooth there as everywhere.
void LipTuck::takeSkin(const ControlMesh& control) {
  for (std::size_t m = 0; m < control.marker_count; ++m) {
    if (control.points[m].side != LipSide::kNone) continue;
    const auto away = [&](const LipPair& pair) {
      return (control.rest.row(signedIndex(m)) - control.rest.row(pair.lower_marker)).norm() / mouth_width_;
    };
    const auto nearest = std::min_element(pairs_.begin(), pairs_.end(), [&](const LipPair& one, const LipPair& other) {
      return away(one) < away(other);
    });
    if (nearest == pairs_.end() || control.rest(signedIndex(m), 1) > control.rest(nearest->lower_marker, 1)) continue;
    Target& target = targets_[unsignedIndex(nearest - pairs_.begin())];
    const double share = target.has_teeth ? kSkinShare * (1 - smoothStep(away(*nearest) / kSkinReach))
                                          : 1 - smoothStep(away(*nearest) / kToothlessSkinReach);
    if (share > 0) target.skin.emplace_back(static_cast<int>(m), share);
  }
}

LipTuck::LipTuck(const FaceMesh& mesh, const ControlMesh& control, double share)
    : pairs_(lipPairs(control)), mouth_width_(control.mouth_width) {
  const std::vector<Eigen::Vector3d> teeth = pointsOf(mesh, PartKind::kUpperTeeth),
                                     lower_teeth = pointsOf(mesh, PartKind::kLowerTeeth);
  double left = -std::numeric_limits<double>::infinity(), right = -left;
  for (const Eigen::Vector3d& p : openingsOf(control).lip_line) {
    left = std::max(left, p.x());
    right = std::min(right, p.x());
  }
  const double middle = 0.5 * (left + right), half = std::max(0.5 * (left - right), 1e-12);
  for (const LipPair& pair : pairs_) {
    const Eigen::Vector3d upper = control.rest.row(pair.upper_rim), lower = control.rest.row(pair.lower_rim);
    Eigen::Vector3d place;
    Target target;
    target.has_teeth = edgeAt(teeth, 0.5 * (upper + lower), mouth_width_, place);
    if (target.has_teeth) {
      target.raised_to = place.y() + kShown * mouth_width_;
      place.y() -= kUnder * mouth_width_;
    } else {
      target.raised_to = upper.y() + kRaised * mouth_width_;
      place = upper + mouth_width_ * Eigen::Vector3d(0, kTuckedUp, -kTuckedBehind);
    }
    // No further forward than where the lip lies anyway.
    place.z() = std::max(place.z(), std::min(lower.z(), leastDepth(lower_teeth, place, mouth_width_)));
    places_.push_back(place);
    const double way = std::abs(0.5 * (upper.x() + lower.x()) - middle) / half;
    target.share = share * (1 - smoothStep((way - kWhole) / kFades));
    targets_.push_back(target);
  }
  takeSkin(control);
}

void LipTuck::apply(std::span<const LipGap> gaps, MarkerPositions& points) const {
  for (std::size_t i = 0; i < gaps.size(); ++i) {
    const auto& [raised_to, has_teeth, whole, skin] = targets_[i];
    const double share = gaps[i].tuck * whole;
    if (!(share > 0)) continue;
    const auto& [upper_rim, lower_rim, upper_marker, lower_marker] = pairs_[i];
    const double furthest = kFurthestTuck * mouth_width_;
    const double lift = share * std::clamp(raised_to - points(upper_rim, 1), 0.0, furthest);
    points(upper_rim, 1) += lift;
    points(upper_marker, 1) += kMarkerShare * lift;
    Eigen::RowVector3d way = places_[i].transpose() - points.row(lower_rim);
    way.x() = 0;
    // Teeth stay where they are; an upper lip that stands higher has its lower one behind it all the same.
    if (!has_teeth) way.y() += std::max(0.0, points(upper_rim, 1) - raised_to);
    way *= std::min(1.0, furthest / std::max(way.norm(), 1e-12));
    points.row(lower_rim) += share * way;
    Eigen::RowVector3d edge_way = kMarkerShare * way;
    if (!has_teeth) {
      const double under = points(upper_rim, 1) - points(lower_rim, 1);
      points(lower_rim, 1) -= whole * goesUnder(gaps[i].tuck) * std::max(0.0, kPassesUnder * mouth_width_ - under);
      const Eigen::RowVector3d off = points.row(lower_rim) - points.row(lower_marker);
      edge_way = {0, kThinnedUp * off.y(), kThinnedBack * std::min(off.z(), 0.0)};
    }
    points.row(lower_marker) += share * edge_way;
    for (const auto& [marker, goes_along] : skin) points.row(marker) += share * goes_along * edge_way;
  }
}

}  // namespace mouthpiece
