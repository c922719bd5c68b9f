#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "base/errors.h"
#include "base/smooth_step.h"
#include "deform/surface/control_surface.h"
#include "deform/surface/virtual_points.h"

namespace mouthpiece {
namespace {

/// Share of the mouth's width over which a closing gap is eased to nothing.
constexpr double kContactEase = 0.02;
/// Of the rest distance between the outer lip markers: closer than this their direction is not trusted.
constexpr double kLeastLipHeight = 0.25;
/// A lip gets thinner when stretched and thicker when pursed, within these factors.
constexpr double kThinnest = 0.75;
constexpr double kThickest = 1.3;
/// The rim turns by this share of the lip line's turn: in full, neighbours that turn towards each other make a beak.
constexpr double kTurnsWithLine = 0.5;

/// The upper lip's share of the way when lips that are apart at rest shall meet.
constexpr double kUpperLipCloses = 0.35;
/// The skin under the lip goes along as far as this from the lip's edge, mouth widths, or the surface, which is steep
/// between a marker that goes and one beside it that stays, swings out beyond both.
constexpr double kSkinCloses = 0.45;

Eigen::Vector3d row(const MarkerPositions& points, int index) { return points.row(index).transpose(); }

/// 0 below 0, x - ease / 2 above `ease`, a parabola between: continuous in value and slope, so contact never jerks.
double easedGap(double x, double ease) {
  if (x <= 0) return 0;
  return x < ease ? x * x / (2 * ease) : x - ease / 2;
}

double inverseEasedGap(double gap, double ease) {
  if (gap <= 0) return 0;
  return gap < ease / 2 ? std::sqrt(2 * ease * gap) : gap + ease / 2;
}

/// The rim point carried along by its outer lip marker: turned as the lip line turns, thinner as it stretches.
Eigen::Vector3d carriedByLip(const ControlMesh& mesh, int index, const MarkerPositions& now) {
  const auto& drivers = mesh.points[unsignedIndex(index)].drivers;
  const int outer = drivers[0].point;
  const Eigen::Vector3d rest_line = row(mesh.rest, drivers[2].point) - row(mesh.rest, drivers[1].point);
  const Eigen::Vector3d line = row(now, drivers[2].point) - row(now, drivers[1].point);
  const double stretch = line.norm() / rest_line.norm();
  const double thickness = stretch > 0 ? std::clamp(1 / std::sqrt(stretch), kThinnest, kThickest) : kThickest;
  const Eigen::Vector3d offset = row(mesh.rest, index) - row(mesh.rest, outer);
  return row(now, outer) + thickness * (Eigen::Quaterniond::Identity().slerp(
                                            kTurnsWithLine, Eigen::Quaterniond::FromTwoVectors(rest_line, line)) *
                                        offset);
}

/// Keeps a pair of rim points from passing through each other: the gap along the lips' own direction is eased to zero,
/// both giving way alike. `lips`: null where only the markers are known.
void meetInBetween(const ControlMesh& mesh, const LipPair& pair, const LipGap* lips, double ease,
                   MarkerPositions& now) {
  const auto& [upper, lower, outer_upper, outer_lower] = pair;
  const Eigen::Vector3d rest_lips = row(mesh.rest, outer_upper) - row(mesh.rest, outer_lower);
  const Eigen::Vector3d rest_up = rest_lips.normalized();
  Eigen::Vector3d up = row(now, outer_upper) - row(now, outer_lower);
  // Outer markers that come too close, or cross, are noise: lean on the direction at rest.
  up += 2 * std::max(0.0, kLeastLipHeight * rest_lips.norm() - up.dot(rest_up)) * rest_up;
  up.normalize();
  // Lips that overlap a little in the mesh at rest stay so at rest.
  const double rest_gap = (row(mesh.rest, upper) - row(mesh.rest, lower)).dot(rest_up);
  const double touching = std::min(rest_gap, 0.0);
  const double gap = (row(now, upper) - row(now, lower)).dot(up);
  double wanted = touching;
  if (lips) {
    wanted += lips->least + lips->opened * easedGap(gap - touching, std::max(ease, 2 * lips->least));
  } else {
    const double shift = inverseEasedGap(rest_gap - touching, ease) - (rest_gap - touching);
    wanted += easedGap(gap - touching + shift, ease);
  }
  const Eigen::Vector3d correction = 0.5 * (wanted - gap) * up;
  now.row(upper) += correction.transpose();
  now.row(lower) -= correction.transpose();
}

}  // namespace

std::vector<LipPair> lipPairs(const ControlMesh& mesh) {
  std::vector<LipPair> pairs;
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    const ControlPoint& point = mesh.points[i];
    if (point.rule != PointRule::kInnerLip || point.side != LipSide::kUpper || point.opposite < 0) continue;
    const ControlPoint& opposite = mesh.points[unsignedIndex(point.opposite)];
    pairs.push_back({static_cast<int>(i), point.opposite, point.drivers[0].point, opposite.drivers[0].point});
  }
  return pairs;
}

double partedShare(double stretch, double slack) {
  // Shares of the way on which the rims catch up: it is `kCatchUp` slacks long, they are faster than the outer edges by
  // the same factor over most of it, and it begins and ends softly.
  constexpr double kCatchUp = 1.75, kBegins = 0.25, kEnds = 0.15;
  constexpr double kFastest = (1 + kCatchUp - kCatchUp * kEnds / 2) / (1 - kBegins / 2 - kEnds / 2);
  if (!(slack > 0)) return 1;
  const double x = (stretch / slack - 1) / kCatchUp;
  if (x <= 0) return 0;
  if (x >= 1) return 1;
  double parted = kFastest * (x < kBegins ? x * x / (2 * kBegins) : x - kBegins / 2);
  if (const double late = x - (1 - kEnds); late > 0) parted -= (kFastest - kCatchUp) * late * late / (2 * kEnds);
  return parted / (1 + kCatchUp * x);
}

void leadingPoints(const ControlMesh& mesh, std::span<const LipPair> pairs, const FacePose& pose,
                   MarkerPositions& points) {
  MOUTHPIECE_EXPECT(pose.markers.size() == 3 * mesh.marker_count);
  MOUTHPIECE_EXPECT(pose.lips.empty() || pose.lips.size() == pairs.size());
  points = mesh.rest;
  points.topRows(signedIndex(mesh.marker_count)) =
      Eigen::Map<const MarkerPositions>(pose.markers.data(), signedIndex(mesh.marker_count), 3);
  const int count = static_cast<int>(mesh.points.size());
  for (int i = 0; i < count; ++i) {
    if (mesh.points[unsignedIndex(i)].rule == PointRule::kInnerLip)
      points.row(i) = carriedByLip(mesh, i, points).transpose();
  }
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    meetInBetween(mesh, pairs[i], pose.lips.empty() ? nullptr : &pose.lips[i], kContactEase * mesh.mouth_width, points);
  }
}

MarkerPositions closingOffsets(const ControlMesh& mesh) {
  MarkerPositions offsets = MarkerPositions::Zero(signedIndex(mesh.marker_count), 3);
  const std::vector<LipPair> pairs = lipPairs(mesh);
  for (const auto& [upper_rim, lower_rim, upper, lower] : pairs) {
    const Eigen::Vector3d up = (row(mesh.rest, upper) - row(mesh.rest, lower)).normalized();
    const double gap = (row(mesh.rest, upper_rim) - row(mesh.rest, lower_rim)).dot(up);
    if (!(gap > 0)) continue;
    offsets.row(upper) -= (kUpperLipCloses * gap * up).transpose();
    offsets.row(lower) += ((1 - kUpperLipCloses) * gap * up).transpose();
  }
  for (Eigen::Index m = 0; m < offsets.rows() && !pairs.empty(); ++m) {
    if (mesh.points[unsignedIndex(m)].side != LipSide::kNone) continue;
    const auto away = [&](const LipPair& pair) { return (mesh.rest.row(m) - mesh.rest.row(pair.lower_marker)).norm(); };
    const int nearest = std::min_element(pairs.begin(), pairs.end(), [&](const LipPair& one, const LipPair& other) {
                          return away(one) < away(other);
                        })->lower_marker;
    if (mesh.rest(m, 1) > mesh.rest(nearest, 1)) continue;
    const double off = (mesh.rest.row(m) - mesh.rest.row(nearest)).norm() / mesh.mouth_width;
    offsets.row(m) = (1 - smoothStep(off / kSkinCloses)) * offsets.row(nearest);
  }
  return offsets;
}

MarkerPositions controlPoints(const ControlMesh& mesh, const FacePose& pose) {
  MarkerPositions now;
  leadingPoints(mesh, lipPairs(mesh), pose, now);
  for (std::size_t i = mesh.marker_count; i < mesh.points.size(); ++i) {
    if (mesh.points[i].rule != PointRule::kFollow) continue;
    for (const PointDriver& driver : mesh.points[i].drivers) {
      now.row(signedIndex(i)) += driver.weight * (now.row(driver.point) - mesh.rest.row(driver.point));
    }
  }
  return now;
}

}  // namespace mouthpiece
