#include "retarget/rig/judged_head.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "base/parallel_for.h"
#include "deform/mesh/triangle_tree.h"
#include "deform/surface/virtual_points.h"
#include "deform/topology/head_topology.h"

namespace mouthpiece {
namespace {

constexpr double kLeastEdgeMm = 2;  ///< an edge counts as so long at least: what finer nets do within it is not seen
/// An edge may grow by as much of its length where that is more than the limit, up to so many times the limit: the skin
/// along a long edge of a coarse head would be many edges of a finer one, and each would grow by a part of it.
constexpr double kLongGrowth = 0.25, kMostLongGrowth = 1.2;
constexpr double kLeastStepMm = 1;  ///< a marker's step counts as so long at least
/// A step of a lip's rim, which phones tell, counts as so long at most: twice it within a sixtieth of a second is
/// 0.24 m/s, the fastest that the lower lip goes in 60 takes of GRID s1, at 25 Hz.
constexpr double kMostRimStepMm = 2;
constexpr double kLeastAreaMm2 = 0.02;  ///< triangles below it are slivers
constexpr double kFolded = -0.7;        ///< cosine between neighbours of which one has turned over
constexpr double kUnfolded = 0;         ///< and of those that are looked at, at rest
constexpr double kOwnMarker = 0.15;     ///< weight from which on a marker counts as one of a vertex'
constexpr double kSampleShare = 0.02;   ///< of the mouth's width: between the points where lips are measured
constexpr std::size_t kMostShown = 400;
constexpr double kTearsFrom = 5.0 / 6;  ///< of a limit: what comes so near to it in these poses may break it in others

using Vector3f = Eigen::Vector3f;

/// Unit normals.
void findDirections(const VertexPositions& vertices, const std::vector<Triangle>& triangles,
                    VertexPositions& directions) {
  directions.resize(signedIndex(triangles.size()), 3);
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const Triangle& t = triangles[i];
    const Vector3f a = vertices.row(t[0]), b = vertices.row(t[1]), c = vertices.row(t[2]);
    const Vector3f across = (b - a).cross(c - a);
    directions.row(signedIndex(i)) = across.transpose() / std::max(across.norm(), 1e-30F);
  }
}

}  // namespace

JudgedHead::JudgedHead(const FaceRig& rig, const FaceFile& face)
    : face_(face),
      mm_(1000 * rig.mesh().metres_per_unit),
      welding_(weldSplitTriangles(rig.mesh())),
      mesh_(welding_.isNothing() ? rig.mesh() : welding_.mesh),
      meter_(mesh_, face.control, kSampleShare),
      at_rest_(meter_.measure(mesh_.vertices)),
      tuck_(mesh_, face.control, double{face.binding.tuck}) {
  findMoving();
  findEdges();
  findTriangles();
  findMarkers();
  findLeading();
}

void JudgedHead::findMoving() {
  kinds_ = vertexKinds(mesh_);
  const FaceBinding binding = welding_.isNothing() ? face_.binding : weldedBinding(face_.binding, welding_);
  patch_.assign(mesh_.vertexCount(), -1);
  moves_.assign(mesh_.vertexCount(), false);
  for (std::size_t v = 0; v < mesh_.vertexCount(); ++v) {
    if (kinds_[v] == PartKind::kTongue) continue;
    if (binding.patch[v] >= 0 && binding.skin_weight[v] > 0) patch_[v] = binding.patch[v];
    moves_[v] = patch_[v] >= 0 || binding.jaw_weight[v] > 0;
  }
}

void JudgedHead::findEdges() {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
  for (const Triangle& t : mesh_.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [low, high] = std::minmax(t[k], t[(k + 1) % 3]);
      const bool is_tongue = kinds_[low] == PartKind::kTongue || kinds_[high] == PartKind::kTongue;
      if ((moves_[low] || moves_[high]) && !is_tongue) pairs.emplace_back(low, high);
    }
  }
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  for (const auto& [from, to] : pairs)
    edges_.push_back({from, to, (mesh_.vertices.row(from) - mesh_.vertices.row(to)).norm()});
}

void JudgedHead::findTriangles() {
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> over_edge;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> neighbours;
  for (std::uint32_t i = 0; i < mesh_.triangles.size(); ++i) {
    const Triangle& t = mesh_.triangles[i];
    if (!std::all_of(t.begin(), t.end(), [&](std::uint32_t v) { return patch_[v] >= 0 && isSkin(kinds_[v]); }))
      continue;
    const Vector3f a = mesh_.vertices.row(t[0]), b = mesh_.vertices.row(t[1]), c = mesh_.vertices.row(t[2]);
    const double area_mm2 = mm_ * mm_ * 0.5 * double{(b - a).cross(c - a).norm()};
    if (area_mm2 < kLeastAreaMm2) continue;
    areas_mm2_.push_back(area_mm2);
    const auto here = static_cast<std::uint32_t>(moving_.size());
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [first, is_new] = over_edge.emplace(std::minmax(t[k], t[(k + 1) % 3]), here);
      if (!is_new) neighbours.emplace_back(first->second, here);
    }
    moving_.push_back(t);
    moving_ids_.push_back(i);
  }
  VertexPositions directions;
  findDirections(mesh_.vertices, moving_, directions);
  for (const auto& [one, other] : neighbours) {
    if (double{directions.row(one).dot(directions.row(other))} > kUnfolded) neighbours_.emplace_back(one, other);
  }
}

void JudgedHead::findMarkers() {
  const ControlMesh& control = face_.control;
  std::vector<std::vector<int>> markers_of_point(control.points.size()), rims_of_point = markers_of_point,
                                                                         opposite_of_point = markers_of_point;
  const auto add = [](std::vector<int>& all, const std::vector<int>& more) {
    all.insert(all.end(), more.begin(), more.end());
  };
  for (std::size_t i = 0; i < control.points.size(); ++i) {
    const ControlPoint& point = control.points[i];
    if (i < control.marker_count) markers_of_point[i] = {static_cast<int>(i)};
    if (point.rule == PointRule::kInnerLip) rims_of_point[i] = {static_cast<int>(i)};
    if (point.opposite >= 0) opposite_of_point[i] = {control.points[unsignedIndex(point.opposite)].drivers[0].point};
    for (const PointDriver& driver : point.drivers) {
      if (std::abs(driver.weight) < kOwnMarker) continue;
      add(markers_of_point[i], markers_of_point[unsignedIndex(driver.point)]);
      // What lies between a lip's rim and its markers goes along with both.
      add(opposite_of_point[i], opposite_of_point[unsignedIndex(driver.point)]);
      add(rims_of_point[i], rims_of_point[unsignedIndex(driver.point)]);
    }
  }
  for (const auto& triangle : control.triangles) {
    auto& markers = markers_of_.emplace_back();
    auto& rims = rims_of_.emplace_back();
    auto& opposite = opposite_of_.emplace_back();
    for (const int point : triangle) {
      add(opposite, opposite_of_point[unsignedIndex(point)]);
      add(markers, markers_of_point[unsignedIndex(point)]);
      add(rims, rims_of_point[unsignedIndex(point)]);
    }
  }
  const std::vector<Triangle> skin = trianglesOf(mesh_, {PartKind::kSkin, PartKind::kLips});
  const TriangleTree tree(mesh_.vertices, skin);
  for (std::size_t i = 0; i < control.marker_count; ++i) {
    const auto foot = tree.closest(control.rest.row(signedIndex(i)).transpose());
    Eigen::Index corner = 0;
    if (foot) foot->weights.maxCoeff(&corner);
    skin_at_.push_back(foot ? skin[foot->triangle][unsignedIndex(corner)] : 0);
    is_lip_.push_back(lipSideOf(face_.marker_names[i]) != LipSide::kNone);
  }
}

void JudgedHead::findLeading() {
  const ControlMesh& control = face_.control;
  std::vector<int> leading;
  for (std::size_t i = 0; i < control.points.size(); ++i) {
    if (control.points[i].rule != PointRule::kFollow) leading.push_back(static_cast<int>(i));
  }
  const HeadTopology topology(mesh_, openingsOf(control));
  for (std::uint32_t v = 0; v < patch_.size(); ++v) {
    if (patch_[v] < 0 || !isSkin(kinds_[v]) || topology.isInMouth(v)) continue;
    const auto away = [&](int point) {
      return (control.rest.row(point) - mesh_.vertices.row(v).cast<double>()).norm();
    };
    Outside& outside = outside_.emplace_back();
    outside.vertex = v;
    std::partial_sort_copy(leading.begin(), leading.end(), outside.around.begin(), outside.around.end(),
                           [&](int one, int other) { return away(one) < away(other); });
  }
}

void JudgedHead::lookAtPose(const VertexPositions& now, std::optional<double> widest_gap, PoseSeen& seen) const {
  lookAtEdges(now, seen);
  lookAtTriangles(now, seen);
  if (widest_gap) lookAtContact(now, *widest_gap, seen);
}

void JudgedHead::lookAtContact(const VertexPositions& now, double widest_gap, PoseSeen& seen) const {
  seen.is_measured = true;
  seen.contact = meter_.measure(now, widest_gap);
}

void JudgedHead::lookAtEdges(const VertexPositions& now, PoseSeen& seen) const {
  const auto least = asFloat(kLeastEdgeMm / mm_);
  const double most_growth = limitNamed("stretch"), most_ratio = limitNamed("edge length");
  for (std::size_t i = 0; i < edges_.size(); ++i) {
    const Edge& edge = edges_[i];
    const float length = (now.row(edge.from) - now.row(edge.to)).norm();
    const double growth_mm = mm_ * double{length - edge.length};
    const double allowed =
        std::clamp(kLongGrowth * mm_ * double{edge.length}, most_growth, kMostLongGrowth * most_growth);
    const double growth = growth_mm * most_growth / allowed;
    if (growth > seen.growth.value) seen.growth_mm = growth_mm;
    const double ratio = double{std::max(length, least) / std::max(edge.length, least)};
    seen.growth.take(growth, i);
    seen.ratio.take(ratio, i);
    if (growth > most_growth || ratio > most_ratio) {
      seen.stretched.push_back(edge.from);
      seen.stretched.push_back(edge.to);
    }
    if (growth > kTearsFrom * most_growth || ratio > kTearsFrom * most_ratio) {
      seen.torn.push_back(edge.from);
      seen.torn.push_back(edge.to);
    }
  }
}

void JudgedHead::lookAtTriangles(const VertexPositions& now, PoseSeen& seen) const {
  thread_local VertexPositions directions;
  findDirections(now, moving_, directions);
  std::vector<std::uint8_t> folds(moving_.size(), 0);
  for (const auto& [one, other] : neighbours_) {
    if (double{directions.row(one).dot(directions.row(other))} >= kFolded) continue;
    for (const std::uint32_t i : {one, other}) {
      // Over one edge skin may fold, as pressed lips do; over two the triangle lies the wrong way round.
      if (++folds[i] != 2) continue;
      seen.turned.push_back(moving_ids_[i]);
      seen.turned_mm2 += areas_mm2_[i];
      seen.torn.insert(seen.torn.end(), moving_[i].begin(), moving_[i].end());
    }
  }
}

MarkerPositions JudgedHead::leadingAt(const FaceMotion& motion, std::size_t row) const {
  const FacePose pose = motion.pose(FrameIndex{row});
  MarkerPositions points;
  leadingPoints(face_.control, lipPairs(face_.control), pose, points);
  tuck_.apply(pose.lips, points);
  return points;
}

void JudgedHead::lookAtStep(const VertexPositions& before, const VertexPositions& now, const FaceMotion& motion,
                            std::size_t row, PoseSeen& seen) const {
  // What phones tell of the lips no marker shows: skin beside the rims may go with what leads these.
  const Eigen::VectorXd led = mm_ * (leadingAt(motion, row) - leadingAt(motion, row - 1)).rowwise().norm();
  const auto largest_step = [&](const std::vector<int>& points) {
    double largest = 0;
    for (const int point : points) largest = std::max(largest, led[point]);
    return largest;
  };
  std::vector<double> steps;
  for (std::size_t p = 0; p < markers_of_.size(); ++p)
    steps.push_back(std::max({kLeastStepMm, largest_step(markers_of_[p]) + largest_step(opposite_of_[p]),
                              std::min(largest_step(rims_of_[p]), kMostRimStepMm)}));
  const double furthest = std::max({kLeastStepMm, led.head(signedIndex(face_.control.marker_count)).maxCoeff(),
                                    std::min(led.maxCoeff(), kMostRimStepMm)});
  const double most = limitNamed("vertex jump");
  for (std::uint32_t v = 0; v < patch_.size(); ++v) {
    if (patch_[v] < 0) continue;
    const double step = mm_ * double{(now.row(v) - before.row(v)).norm()};
    // Both lips' markers are no leave to go much further than any marker of the face.
    const double of_its_markers = step / steps[unsignedIndex(patch_[v])], of_any = step / (kOfAnyMarker * furthest);
    const double ratio = std::max(of_its_markers, of_any);
    if (ratio > seen.jump.value) {
      seen.jump_mm = step;
      seen.jumps_past_all = of_any > of_its_markers;
    }
    seen.jump.take(ratio, v);
    if (ratio > most) seen.jumped.push_back(v);
    if (ratio > kTearsFrom * most) seen.torn.push_back(v);
  }
}

void JudgedHead::lookAtMotion(const VertexPositions& now, const FaceMotion& motion, std::size_t row,
                              PoseSeen& seen) const {
  for (std::size_t i = 0; i < skin_at_.size(); ++i) {
    const double marker =
        (motion.markers().block<1, 3>(signedIndex(row), 3 * signedIndex(i)) - face_.marker_targets.row(signedIndex(i)))
            .squaredNorm();
    const double skin = double{(now.row(skin_at_[i]) - mesh_.vertices.row(skin_at_[i])).squaredNorm()};
    seen.marker_squares += marker;
    seen.skin_squares += skin;
    if (!is_lip_[i]) continue;
    seen.lip_marker_squares += marker;
    seen.lip_skin_squares += skin;
  }
}

void JudgedHead::lookAtMarkersAround(const VertexPositions& now, const FaceMotion& motion, std::size_t row,
                                     PoseSeen& seen) const {
  const MarkerPositions points = leadingAt(motion, row) - face_.control.rest;
  // Skin between markers goes as a mixture of them and of what stays: within the box around their ways and none.
  const double most = limitNamed("skin off its markers");
  for (const Outside& outside : outside_) {
    const Vector3f way = now.row(outside.vertex) - mesh_.vertices.row(outside.vertex);
    if (mm_ * double{way.norm()} <= std::min(seen.off_markers.value, kTearsFrom * most)) continue;
    Eigen::AlignedBox3f ways{Vector3f(Vector3f::Zero())};
    for (const int point : outside.around) ways.extend(Vector3f(points.row(point).cast<float>()));
    const double off_mm = mm_ * double{ways.exteriorDistance(way)};
    seen.off_markers.take(off_mm, outside.vertex);
    if (off_mm > most) seen.off.push_back(outside.vertex);
    if (off_mm > kTearsFrom * most) seen.torn.push_back(outside.vertex);
  }
}

/// The Jacobian where markers are in the poses, and skin between them: the way back from the head is fitted the other
/// way round, near enough to look at a sign.
void JudgedHead::lookAtWarp(const JudgedPoses& poses, const ActorPose& actor, FaceJudgement& found) const {
  constexpr std::size_t kPoses = 60, kSkin = 150;
  const RbfWarp warp = RbfWarp::fit(face_.actor_neutral_mm, face_.marker_targets, face_.warp);
  const RbfWarp back = RbfWarp::fit(face_.marker_targets, face_.actor_neutral_mm, face_.warp);
  std::vector<std::uint32_t> skin;
  for (std::uint32_t v = 0; v < patch_.size(); ++v) {
    if (patch_[v] >= 0 && isSkin(kinds_[v])) skin.push_back(v);
  }
  const std::size_t stride = skin.size() / kSkin + 1;
  MarkerPositions places(signedIndex((skin.size() + stride - 1) / stride), 3);
  for (Eigen::Index i = 0; i < places.rows(); ++i)
    places.row(i) = mesh_.vertices.row(skin[unsignedIndex(i) * stride]).cast<double>();
  const MarkerPositions at_rest = skin.empty() ? places : back.targetFromActor(places);
  std::vector<Eigen::Index> nearest(unsignedIndex(at_rest.rows()));
  for (Eigen::Index i = 0; i < at_rest.rows(); ++i)
    (face_.actor_neutral_mm.rowwise() - at_rest.row(i)).rowwise().squaredNorm().minCoeff(&nearest[unsignedIndex(i)]);
  const CompletedMarkers moved =
      completedMarkers(poses.motion, actor.neutral_mm, face_.control, face_.actor_neutral_mm);
  // A mirrored target is negative everywhere: what counts is the sign in the middle.
  const double usual = warp.jacobian(face_.actor_neutral_mm.colwise().mean().transpose()).determinant();
  const std::size_t step = poses.rows.size() / kPoses + 1;
  std::vector<std::size_t> rows;
  for (std::size_t row = 0; row < poses.rows.size(); row += step) rows.push_back(row);
  struct At {
    double least = std::numeric_limits<double>::infinity();
    std::size_t folds = 0;
    Eigen::Index marker = 0;
  };
  std::vector<At> at(rows.size());
  parallelFor(rows.size(), [&](std::size_t r) {
    const auto look = [&](const Eigen::Vector3d& place, Eigen::Index marker) {
      const double share = warp.jacobian(place).determinant() / usual;
      at[r].folds += share > 0 ? 0U : 1U;
      if (share < at[r].least) {
        at[r].least = share;
        at[r].marker = marker;
      }
    };
    const auto row = signedIndex(rows[r]);
    const auto move = [&](Eigen::Index marker) -> Eigen::Vector3d {
      return (moved.positions_mm.block<1, 3>(row, 3 * marker) - moved.neutral_mm.row(marker)).transpose();
    };
    // RbfWarp::targetFromActorRelative looks where the actor's own markers are, whoever the warp was fitted to.
    for (Eigen::Index m = 0; m < moved.neutral_mm.rows(); ++m)
      look(moved.positions_mm.block<1, 3>(row, 3 * m).transpose(), m);
    for (Eigen::Index i = 0; i < at_rest.rows(); ++i) {
      const Eigen::Index marker = nearest[unsignedIndex(i)];
      look(at_rest.row(i).transpose() + move(marker), marker);
    }
  });
  found.warp_stretch_least = std::numeric_limits<double>::infinity();
  std::size_t worst = 0;
  for (std::size_t r = 0; r < at.size(); ++r) {
    found.warp_points += unsignedIndex(moved.neutral_mm.rows() + at_rest.rows());
    found.warp_folds += at[r].folds;
    if (at[r].least >= found.warp_stretch_least) continue;
    found.warp_stretch_least = at[r].least;
    worst = r;
  }
  if (found.warp_folds == 0) return;
  const std::string& marker = face_.marker_names[unsignedIndex(at[worst].marker)];
  found.faults.push_back(
      {"warp fold-overs in use",
       fmt::format("the warp folds over at {} of {} places of poses, most beside {} in {}; check the "
                   "anchors there",
                   found.warp_folds, found.warp_points, marker, poses.rows[rows[worst]].where),
       trianglesAt({skin_at_[unsignedIndex(at[worst].marker)]}), rows[worst]});
}

std::string JudgedHead::placeOf(std::uint32_t vertex) const {
  Eigen::Index nearest = 0;
  (face_.marker_targets.rowwise() - mesh_.vertices.row(vertex).cast<double>())
      .rowwise()
      .squaredNorm()
      .minCoeff(&nearest);
  return fmt::format("vertex {} beside {}", givenOf(vertex), face_.marker_names[unsignedIndex(nearest)]);
}

std::vector<std::uint32_t> JudgedHead::trianglesAt(const std::vector<std::uint32_t>& vertices) const {
  std::vector<bool> is_in(mesh_.vertexCount(), false);
  for (const std::uint32_t v : vertices) is_in[v] = true;
  std::vector<std::uint32_t> found;
  for (std::uint32_t i = 0; i < mesh_.triangles.size() && found.size() < kMostShown; ++i) {
    const Triangle& t = mesh_.triangles[i];
    if (is_in[t[0]] || is_in[t[1]] || is_in[t[2]]) found.push_back(i);
  }
  return found;
}

std::string JudgedHead::edgeText(std::size_t edge, const std::string& does) const {
  if (edges_.empty()) return {};
  return fmt::format("an edge of {:.2f} mm gets {} at {}", mm_ * double{edges_[edge].length}, does,
                     placeOf(edges_[edge].from));
}

std::vector<std::uint32_t> JudgedHead::mouth() const {
  std::vector<std::uint32_t> lips;
  for (std::size_t i = 0; i < skin_at_.size(); ++i) {
    if (is_lip_[i]) lips.push_back(skin_at_[i]);
  }
  return trianglesAt(lips);
}

}  // namespace mouthpiece
