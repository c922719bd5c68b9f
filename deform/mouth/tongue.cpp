// The tongue of jaw.h.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "base/smooth_step.h"
#include "deform/mesh/face_mesh.h"
#include "deform/mesh/triangle_tree.h"
#include "deform/mouth/jaw.h"

namespace mouthpiece {
namespace {

/// Along the tongue, 0 at the root, 1 at the tip: where the tip's movement begins, where the back's is strongest and
/// how wide.
constexpr double kTipFrom = 0.35;
constexpr double kBackAt = 0.4;
constexpr double kBackWidth = 0.4;
/// Shares of the tongue's length: no part moves further; the ridge is so far behind the teeth's edge; the tip comes so
/// far out between teeth that are so far apart; on such a way before the teeth it is flattened.
constexpr double kFurthest = 0.45;
constexpr double kRidgeBehind = 0.2;
constexpr double kOut = 0.06;
constexpr double kApart = 0.08;
constexpr double kLipsApart = 0.06;  ///< and as far between lips, which it does not push apart
constexpr float kFlattened = 0.12F;

/// The front teeth of a row.
struct FrontTeeth {
  Eigen::Vector3d edge;  ///< in the middle, at the front, as high as their free edge
  double height = 0;     ///< with the gum
  double back_z = 0;     ///< of what is near the edge
};

/// `up`: 1 for the upper row, whose free edge is below, -1 for the lower one.
std::optional<FrontTeeth> frontTeeth(const FaceMesh& mesh, PartKind row, double up) {
  constexpr double kFrontShare = 0.12;  // of the row's depth
  constexpr double kNearEdge = 0.1;     // of the front teeth's height
  std::vector<Eigen::Vector3d> points;
  Eigen::AlignedBox3d box;
  for (const Triangle& triangle : trianglesOf(mesh, {row})) {
    for (const std::uint32_t v : triangle) {
      points.push_back(pointAt(mesh.vertices, v));
      box.extend(points.back());
    }
  }
  if (points.empty()) return std::nullopt;
  const double front_z = box.max().z() - kFrontShare * box.sizes().z();
  std::erase_if(points, [&](const Eigen::Vector3d& p) { return p.z() < front_z; });
  double free = std::numeric_limits<double>::infinity(), rooted = -free;
  for (const Eigen::Vector3d& p : points) {
    free = std::min(free, up * p.y());
    rooted = std::max(rooted, up * p.y());
  }
  FrontTeeth teeth{{box.center().x(), up * free, box.max().z()}, rooted - free, box.max().z()};
  for (const Eigen::Vector3d& p : points) {
    if (up * p.y() < free + kNearEdge * teeth.height) teeth.back_z = std::min(teeth.back_z, p.z());
  }
  return teeth;
}

Eigen::AlignedBox3d boxOf(const VertexPositions& vertices, const Triangle& triangle) {
  Eigen::AlignedBox3d box;
  for (const std::uint32_t corner : triangle) box.extend(pointAt(vertices, corner));
  return box;
}

/// Height of the lowest part of those kinds that lies straight above a point.
std::optional<double> roofOver(const FaceMesh& mesh, const Eigen::Vector3d& point,
                               std::initializer_list<PartKind> kinds) {
  std::vector<Triangle> around = trianglesOf(mesh, kinds);
  std::erase_if(around, [&](const Triangle& triangle) {
    const Eigen::AlignedBox3d box = boxOf(mesh.vertices, triangle);
    return point.x() < box.min().x() || point.x() > box.max().x() || point.z() < box.min().z() ||
           point.z() > box.max().z();
  });
  std::optional<double> roof;
  for (const auto& [triangle, height] :
       TriangleTree(mesh.vertices, around, TriangleTree::Use::kWithoutStarts).crossings(point.x(), point.z())) {
    if (height > point.y() && (!roof || height < *roof)) roof = height;
  }
  return roof;
}

Eigen::Vector3d atMost(const Eigen::Vector3d& move, double length) {
  const double norm = move.norm();
  return norm > length ? Eigen::Vector3d(move * (length / norm)) : move;
}

}  // namespace

TongueMorph::TongueMorph(const FaceMesh& mesh, std::vector<std::uint32_t> vertices) {
  if (vertices.empty()) return;
  Eigen::AlignedBox3d box;
  for (const std::uint32_t v : vertices) box.extend(pointAt(mesh.vertices, v));
  const Eigen::Vector3d low = box.min(), high = box.max();
  length_ = high.z() - low.z();
  const double length = std::max(length_, 1e-12);
  const double middle_x = 0.5 * (low.x() + high.x());
  tip_ = {middle_x, 0.5 * (low.y() + high.y()), high.z()};
  double tip_height = -1e30, back_height = -1e30;
  for (const std::uint32_t v : vertices) {
    const Eigen::Vector3d p = pointAt(mesh.vertices, v);
    const double along = (p.z() - low.z()) / length;
    if (along > 0.9) tip_height = std::max(tip_height, p.y());
    if (std::abs(along - kBackAt) < 0.15) back_height = std::max(back_height, p.y());
    const double tip = std::pow(smoothStep((along - kTipFrom) / (1 - kTipFrom)), 1.5);
    const double bump = 1 - smoothStep(std::abs(along - kBackAt) / kBackWidth);
    // The underside and the root stay with the jaw.
    const double upper = smoothStep((p.y() - low.y()) / std::max(0.6 * (high.y() - low.y()), 1e-12));
    items_.push_back({v, mesh.vertices.row(v).transpose(), asFloat(tip), asFloat(bump * (0.3 + 0.7 * upper))});
  }
  if (tip_height > -1e29) tip_.y() = tip_height;
  back_ = {middle_x, back_height > -1e29 ? back_height : high.y(), low.z() + kBackAt * length};
  findTeeth(mesh);
}

void TongueMorph::findTeeth(const FaceMesh& mesh) {
  const auto upper = frontTeeth(mesh, PartKind::kUpperTeeth, 1), lower = frontTeeth(mesh, PartKind::kLowerTeeth, -1);
  const Eigen::Vector3d edge = upper ? upper->edge : Eigen::Vector3d(tip_ + length_ * Eigen::Vector3d(0, 0.12, 0.08));
  const double height = upper ? upper->height : 0.2 * length_;
  has_teeth_ = upper && lower;
  between_ = edge + Eigen::Vector3d(0, 0, kOut * length_);
  behind_ = {edge.x(), edge.y(), upper ? upper->back_z : edge.z()};
  if (lower) lower_edge_ = {lower->edge.x(), lower->edge.y(), lower->back_z};

  ridge_ = edge + Eigen::Vector3d(0, 0.45 * height, -0.15 * length_);
  const Eigen::Vector3d under_ridge = edge - Eigen::Vector3d(0, 0.05 * height, kRidgeBehind * length_);
  if (const auto roof = roofOver(mesh, under_ridge, {PartKind::kUpperTeeth}))
    ridge_ = {under_ridge.x(), *roof, under_ridge.z()};
  palate_ = {back_.x(), edge.y() + 1.1 * height, back_.z()};
  if (const auto roof = roofOver(mesh, back_, {PartKind::kUpperTeeth, PartKind::kMouthInside})) palate_.y() = *roof;
}

/// The height of a place of the tip that shall go out between the teeth and lips, not through them.
float TongueMorph::keptInWayOut(const Eigen::Vector3f& place, const WayOut& way_out) const {
  const float way = kFlattened * asFloat(length_);
  const auto near = [&](float teeth_z) { return asFloat(smoothStep(double{(place.z() - (teeth_z - way)) / way})); };
  const float over = std::max(0.0F, way_out.over - place.y()) * near(way_out.lower_z);
  const float under = std::max(0.0F, place.y() - way_out.under) * near(asFloat(behind_.z()));
  return place.y() + over - under;
}

void TongueMorph::deform(const AddedMotion& jaw, const TonguePose& pose, const PartedLips& lips, float* out) const {
  const auto moved = [&](const Eigen::Vector3d& p) -> Eigen::Vector3d { return p + jaw.turn * p + jaw.shift; };
  const Eigen::Vector3d lower_edge = moved(lower_edge_);
  // Through closed teeth no tongue comes, nor through closed lips: it touches the upper ones from behind.
  const double out_share = smoothStep(lips.apart / (kLipsApart * length_)) *
                           (has_teeth_ ? smoothStep((behind_.y() - lower_edge.y()) / (kApart * length_)) : 1.0);
  const Eigen::Vector3d between = behind_ + out_share * (between_ - behind_);
  const Eigen::Vector3d to_ridge = double{pose.tip_up} * (ridge_ - moved(tip_));
  const Eigen::Vector3d to_gap = double{pose.tip_forward} * (between - moved(tip_));
  const Eigen::Vector3d to_palate = double{pose.back_up} * (palate_ - moved(back_));
  const Eigen::Vector3f tip = atMost(to_ridge + to_gap, kFurthest * length_).cast<float>();
  const Eigen::Vector3f back = atMost(to_palate, kFurthest * length_).cast<float>();
  const Eigen::Matrix3f turn = jaw.turn.cast<float>();
  const Eigen::Vector3f shift = jaw.shift.cast<float>();
  // As far as the tip comes out lips that hang before the teeth are in its way, too.
  const WayOut way_out{
      .lower_z = asFloat(lower_edge.z()),
      .over = asFloat(lower_edge.y() + out_share * std::max(0.0, std::min(lips.lower_y, behind_.y()) - lower_edge.y())),
      .under = asFloat(behind_.y() - out_share * std::max(0.0, behind_.y() - std::max(lips.upper_y, lower_edge.y())))};
  for (const Item& item : items_) {
    Eigen::Vector3f place = item.rest + turn * item.rest + shift + item.tip * tip + item.back * back;
    if (has_teeth_ && pose.tip_forward > 0) place.y() += pose.tip_forward * (keptInWayOut(place, way_out) - place.y());
    Eigen::Map<Eigen::Vector3f>(out + 3 * std::size_t{item.vertex}) = place;
  }
}

}  // namespace mouthpiece
