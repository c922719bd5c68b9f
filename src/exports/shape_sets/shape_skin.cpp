#include "exports/shape_sets/shape_parts.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include "base/index.h"
#include "deform/mesh/face_mesh.h"
#include "deform/surface/virtual_points.h"

namespace mouthpiece {
namespace {

// Lengths as shares of the mouth's width.
constexpr double kDownTheNeck = 2;  ///< so far along the skin a jaw that opens moves it, as on ICT-FaceKit's head
constexpr double kRims = 0.06;      ///< so near to the line between the lips vertices are rims

/// Vertices at the ends of the skin, where a body is joined on; a texture's seams are none.
std::vector<bool> borderOf(const FaceMesh& mesh) {
  using Place = std::array<float, 3>;
  const auto placeOf = [&](std::uint32_t v) {
    return Place{mesh.vertices(v, 0), mesh.vertices(v, 1), mesh.vertices(v, 2)};
  };
  std::map<std::pair<Place, Place>, int> uses;
  const auto usesOf = [&](std::uint32_t a, std::uint32_t b) -> int& {
    return uses[std::minmax(placeOf(a), placeOf(b))];
  };
  const std::vector<Triangle> skin = trianglesOf(mesh, {PartKind::kSkin, PartKind::kLips});
  for (const Triangle& t : skin) {
    for (std::size_t k = 0; k < 3; ++k) ++usesOf(t[k], t[(k + 1) % 3]);
  }
  std::vector<bool> is_border(mesh.vertexCount(), false);
  for (const Triangle& t : skin) {
    for (std::size_t k = 0; k < 3; ++k) {
      if (usesOf(t[k], t[(k + 1) % 3]) == 1) is_border[t[k]] = is_border[t[(k + 1) % 3]] = true;
    }
  }
  return is_border;
}

}  // namespace

ShapeSkin::ShapeSkin(const FaceMesh& mesh, const ControlMesh& control, const FaceBinding& binding)
    : mesh_(mesh),
      welding_(weldSplitTriangles(mesh)),
      topology_(whole(), openingsOf(control)),
      control_(control),
      jaw_(control),
      mouth_width_(control.mouth_width),
      meter_(whole(), control),
      at_rest_(meter_.measure(whole().vertices)) {
  const FaceMesh& skin = whole();
  const FaceBinding bound = welding_.isNothing() ? binding : weldedBinding(binding, welding_);
  const std::vector<PartKind>& kinds = topology_.kinds();
  const std::vector<Eigen::Vector3d> lip_line = openingsOf(control).lip_line;
  const auto across = [&](int point) { return control.rest(point, 0); };
  const double right = across(findPoint(control, "RIM_CORNER_R")), left = across(findPoint(control, "RIM_CORNER_L"));
  for (const LipPair& pair : lipPairs(control)) {
    pairs_at_.push_back((across(pair.upper_rim) - right) / (left - right));
    pair_markers_.emplace_back(control.points[unsignedIndex(pair.upper_marker)].name,
                               control.points[unsignedIndex(pair.lower_marker)].name);
  }
  const std::vector<PartKind> given_kinds = vertexKinds(mesh);
  for (std::size_t v = 0; v < given_kinds.size(); ++v) {
    const bool is_tongue = given_kinds[v] == PartKind::kTongue;
    const float by_skin = binding.patch[v] >= 0 ? binding.skin_weight[v] : 0.0F;
    by_jaw_.push_back(is_tongue ? 1 : (1 - by_skin) * binding.jaw_weight[v]);
  }
  const double mouth_height =
      0.5 * (control.rest(findPoint(control, "LIP_CORNER_R"), 1) + control.rest(findPoint(control, "LIP_CORNER_L"), 1));
  std::vector<bool> is_held = borderOf(skin);
  std::vector<std::uint32_t> beyond;
  for (std::uint32_t v = 0; v < skin.vertexCount(); ++v) {
    rims_.push_back(distanceToLine(pointAt(skin.vertices, v), lip_line) < kRims * mouth_width_);
    bool is_beyond = false;
    if (bound.patch[v] >= 0 && bound.skin_weight[v] > 0) {
      const auto& corners = control.triangles[unsignedIndex(bound.patch[v])];
      is_beyond = std::any_of(corners.begin(), corners.end(),
                              [&](int point) { return control.points[unsignedIndex(point)].fixed; });
      is_held[v] = is_held[v] || !is_beyond;
    }
    const bool is_below = pointAt(skin.vertices, v).y() < mouth_height;
    is_held[v] = is_held[v] || !is_below || !isSkin(kinds[v]) || topology_.isInMouth(v);
    if (is_beyond && !is_held[v]) beyond.push_back(v);
  }
  below_jaw_.emplace(skin, topology_, beyond, is_held, kDownTheNeck * mouth_width_);
}

void ShapeSkin::apply(const SkinRelaxing& relaxing, VertexPositions& moves) const {
  if (welding_.isNothing()) return relaxing.relax(moves);
  VertexPositions welded = welding_.weldedFromGiven(moves);
  relaxing.relax(welded);
  welding_.givenFromWelded(welded, moves);
}

void ShapeSkin::spreadBelowJaw(VertexPositions& moves) const { apply(*below_jaw_, moves); }

void ShapeSkin::relax(const std::vector<std::uint32_t>& torn, double reach, VertexPositions& moves) const {
  std::vector<std::uint32_t> where = torn;
  if (!welding_.isNothing()) {
    for (std::uint32_t& v : where) v = welding_.welded_of[v];
    std::sort(where.begin(), where.end());
    where.erase(std::unique(where.begin(), where.end()), where.end());
  }
  apply(SkinRelaxing(whole(), topology_, where, rims_, reach * mouth_width_), moves);
}

void ShapeSkin::carryByChin(const FacePose& pose, VertexPositions& vertices) const {
  constexpr double kMostFurther = 2;
  const MarkerPositions points = controlPoints(control_, pose);
  const AddedMotion lagging = jaw_.motion(points);
  Eigen::Vector3d chin = Eigen::Vector3d::Zero(), goes = chin;
  for (const char* name : {"CHIN_MID", "CHIN_LOW"}) {
    const int point = findPoint(control_, name);
    if (point < 0) return;
    chin += 0.5 * control_.rest.row(point).transpose();
    goes += 0.5 * (points.row(point) - control_.rest.row(point)).transpose();
  }
  const Eigen::Vector3d carried = lagging.turn * chin + lagging.shift;
  if (carried.norm() < 0.01 * mouth_width_) return;
  const double further = std::clamp(goes.dot(carried) / carried.squaredNorm(), 1.0, kMostFurther);
  // The same turn about the same place, and the same slide, so much further.
  const Eigen::AngleAxisd turn(Eigen::Matrix3d(Eigen::Matrix3d::Identity() + lagging.turn));
  const Eigen::Matrix3d whole = Eigen::AngleAxisd(further * turn.angle(), turn.axis()).toRotationMatrix();
  const Eigen::Vector3d pivot = jaw_.pivot(), slide = lagging.turn * pivot + lagging.shift;
  for (Eigen::Index v = 0; v < vertices.rows(); ++v) {
    const float share = by_jaw_[unsignedIndex(v)];
    if (!(share > 0)) continue;
    const Eigen::Vector3d rest = pointAt(mesh_.vertices, unsignedIndex(v));
    const Eigen::Vector3d was = lagging.turn * rest + lagging.shift;
    const Eigen::Vector3d now = pivot + whole * (rest - pivot) + further * slide - rest;
    vertices.row(v) += share * (now - was).transpose().cast<float>();
  }
}

ShapeSkin::Lips ShapeSkin::lipsIn(const VertexPositions& moves) const {
  const VertexPositions posed = mesh_.vertices + moves;
  const LipContact contact = meter_.measure(welding_.isNothing() ? posed : welding_.weldedFromGiven(posed));
  // A pair speaks for the columns that no other pair is nearer to.
  std::vector<double> apart(pairs_at_.size(), 0), inside = apart;
  const auto nearestPair = [&](double at) {
    const auto nearer = [&](double a, double b) { return std::abs(a - at) < std::abs(b - at); };
    return unsignedIndex(std::min_element(pairs_at_.begin(), pairs_at_.end(), nearer) - pairs_at_.begin());
  };
  for (std::size_t c = 0; c < contact.gaps.size(); ++c) {
    double& gap = apart[nearestPair(0.25 + 0.5 * (asReal(c) + 0.5) / asReal(contact.gaps.size()))];
    gap = std::max(gap, contact.gaps[c]);
  }
  for (std::size_t c = 0; c < contact.overlaps.size(); ++c) {
    double& overlap = inside[nearestPair((asReal(c) + 0.5) / asReal(contact.overlaps.size()))];
    overlap = std::max(overlap, contact.overlaps[c] - at_rest_.overlap);
  }
  const double mm = 1000 * mesh_.metres_per_unit;
  for (std::size_t i = 0; i < apart.size(); ++i) apart[i] = mm * (inside[i] > 0 ? -inside[i] : apart[i]);
  return {apart, mm * (contact.in_teeth - at_rest_.in_teeth)};
}

}  // namespace mouthpiece
