#include "deform/lip_guard.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "base/errors.h"
#include "deform/lip_sides.h"
#include "deform/near_triangles.h"
#include "deform/vertex_kinds.h"
#include "deform/virtual_points.h"

namespace mouthpiece {
namespace {

using Eigen::Vector3f;

// Lengths as shares of the mouth's width.
constexpr double kReach = 0.12;        ///< a vertex watches what is nearer than this at rest
constexpr double kLipsReach = 0.16;    ///< lips may lie on teeth this far from their rims
constexpr double kEase = 0.001;        ///< what is pushed less than this is pushed softly
constexpr double kDeepInTeeth = 0.08;  ///< what is deeper is in the mouth
constexpr double kTeethCell = 0.012;   ///< of the net over the teeth
constexpr double kDrawnFrom = 0.12;    ///< lips are drawn together from within this of their rims
constexpr double kDrawnWhole = 0.02;   ///< the whole way where they are nearer than this
constexpr double kSeenAbove = 0.04;    ///< and not at all beyond this, where watches see nothing
constexpr double kComesNear = 0.004;   ///< nothing is pushed further than this into the other lip
constexpr double kSlips = 0.002;       ///< the guard itself moves what touches no teeth by little more than this
constexpr double kTouching = 0.002;    ///< lips no further apart at rest touch there and stay so
constexpr double kFarApart = 0.08;    ///< lips further apart everywhere need no guard, which fades in over half of this
constexpr float kTips = 0.85F;        ///< cosine to the way it faced when the mouth closed: below, a triangle tips over
constexpr float kTipsOver = 0.25F;    ///< within this
constexpr double kElsewhere = 0.03;   ///< what is further behind the other lip at rest does not meet it
constexpr double kKeptApart = 0.01;   ///< lips that are kept further apart are not drawn together at all
constexpr double kStill = 0.0005;     ///< pushes below this are not worth another sweep
constexpr int kSweeps = 4;            ///< lips that give way by half each are out of each other after so many
constexpr std::size_t kColumns = 12;  ///< across the mouth
constexpr double kMostLooks = 2e10;   ///< vertices times triangles of lips: a head of millions has half of this
constexpr std::size_t kFitVertices = 8000;
constexpr float kLeastLength = 1e-30F;
constexpr double kWatched = 0.08;       ///< a watch sees the other lip this far around the place it watches
constexpr double kBendHeldFlat = 0.02;  ///< a little, where few vertices tell
constexpr float kSameSide = 0.2F;       ///< cosine between surfaces that are one

Vector3f vertexOf(const VertexPositions& vertices, std::uint32_t v) { return vertices.row(v).transpose(); }

/// 0 above 0; how far to go back from behind a surface, at first softly.
float pushBack(float distance, float ease) {
  if (distance >= 0) return 0;
  const float behind = -distance;
  return behind < ease ? behind * behind / (2 * ease) : behind - ease / 2;
}

double smooth(double x) {
  const double t = std::clamp(x, 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

/// The plane of a watched triangle: origin, axes along it and away from it.
struct Frame {
  Vector3f origin, x, y, away;
};
template <typename Watch>
Frame frameOf(const Watch& watch, const float* vertices) {
  const auto at = [vertices](std::uint32_t v) { return Eigen::Map<const Vector3f>(vertices + 3 * std::size_t{v}); };
  const Vector3f a = at(watch.corners[0]), ab = at(watch.corners[1]) - a, ac = at(watch.corners[2]) - a;
  const Vector3f across = ab.cross(ac);
  Frame frame;
  frame.origin = a + watch.weights[0] * ab + watch.weights[1] * ac;
  frame.x = ab / std::max(ab.norm(), kLeastLength);
  frame.away = across / std::max(across.norm(), kLeastLength);
  frame.y = frame.away.cross(frame.x);
  return frame;
}

/// The lip around a watched place: least squares over its vertices within `reach`.
template <typename Watch>
void fitBend(const VertexPositions& vertices, const VertexPositions& normals, const std::vector<std::uint32_t>& lip,
             float reach, Watch& watch) {
  using Terms = Eigen::Matrix<double, 5, 1>;
  const Frame frame = frameOf(watch, vertices.data());
  Eigen::Matrix<double, 5, 5> squares = kBendHeldFlat * Eigen::Matrix<double, 5, 5>::Identity();
  Terms sums = Terms::Zero();
  for (const std::uint32_t v : lip) {
    const Vector3f q = (vertexOf(vertices, v) - frame.origin) / reach;
    if (q.squaredNorm() >= 1 || vertexOf(normals, v).dot(frame.away) < kSameSide) continue;
    const auto x = static_cast<double>(q.dot(frame.x)), y = static_cast<double>(q.dot(frame.y));
    const Terms terms{x, y, x * x, x * y, y * y};
    const double weight = 1 - static_cast<double>(q.squaredNorm());
    squares += weight * terms * terms.transpose();
    sums += weight * static_cast<double>(q.dot(frame.away)) * terms;
  }
  const Terms bend = squares.ldlt().solve(sums);
  for (Eigen::Index i = 0; i < 5; ++i) watch.bend[i] = static_cast<float>(bend[i]);
}

float distanceTo(const Vector3f& p, const std::vector<Vector3f>& ring) {
  float nearest = std::numeric_limits<float>::infinity();
  for (std::size_t i = 0; i < ring.size(); ++i) {
    const Vector3f& a = ring[i];
    const Vector3f ab = ring[(i + 1) % ring.size()] - a;
    const float way = std::clamp((p - a).dot(ab) / std::max(ab.squaredNorm(), kLeastLength), 0.0F, 1.0F);
    nearest = std::min(nearest, (p - a - way * ab).norm());
  }
  return nearest;
}

}  // namespace

LipGuard::LipGuard(const FaceMesh& mesh, const VertexPositions& closed, const ControlMesh& control,
                   const FaceBinding& binding)
    : pairs_(lipPairs(control)), mouth_width_(control.mouth_width) {
  const auto place = [&](int point) -> Vector3f { return control.rest.row(point).transpose().cast<float>(); };
  for (const std::string& name : mouthRim()) {
    if (const int point = findPoint(control, name); point >= 0) rim_.push_back(place(point));
  }
  const int right = findPoint(control, "LIP_CORNER_R"), left = findPoint(control, "LIP_CORNER_L");
  if (right >= 0 && left >= 0) {
    from_ = place(right);
    along_ = place(left) - from_;
  }
  for (const LipPair& pair : pairs_)
    pair_columns_.push_back(columnOf(0.5F * (place(pair.upper_rim) + place(pair.lower_rim))));
  takeLips(mesh, closed, binding, triangleSides(control));
}

void LipGuard::takeLips(const FaceMesh& mesh, const VertexPositions& closed, const FaceBinding& binding,
                        const std::vector<std::uint32_t>& patch_sides) {
  const auto sideOf = [&](std::uint32_t v) {
    return binding.patch[v] < 0 || !(binding.skin_weight[v] > 0)
               ? 0U
               : patch_sides[static_cast<std::size_t>(binding.patch[v])];
  };
  std::vector<Triangle> upper, lower, upper_teeth, lower_teeth;
  std::vector<bool> is_upper(binding.patch.size(), false), is_lower = is_upper;
  for (const MeshPart& part : mesh.parts) {
    const bool is_lip =
        part.kind == PartKind::kSkin || part.kind == PartKind::kLips || part.kind == PartKind::kMouthInside;
    for (std::size_t t = part.first_triangle; t < part.first_triangle + part.triangle_count; ++t) {
      const Triangle& triangle = mesh.triangles[t];
      if (part.kind == PartKind::kUpperTeeth) upper_teeth.push_back(triangle);
      if (part.kind == PartKind::kLowerTeeth) lower_teeth.push_back(triangle);
      if (!is_lip) continue;
      const std::uint32_t side = sideOf(triangle[0]) & sideOf(triangle[1]) & sideOf(triangle[2]);
      if ((side & kUpperLip) != 0) upper.push_back(triangle);
      if ((side & kLowerLip) != 0) lower.push_back(triangle);
      for (const std::uint32_t v : triangle) {
        if ((side & kUpperLip) != 0) is_upper[v] = true;
        if ((side & kLowerLip) != 0) is_lower[v] = true;
      }
    }
  }
  std::vector<std::uint32_t> upper_vertices, lower_vertices;
  for (std::uint32_t v = 0; v < is_upper.size(); ++v) {
    if (is_upper[v] == is_lower[v]) continue;
    (is_upper[v] ? upper_vertices : lower_vertices).push_back(v);
  }
  const VertexPositions normals = vertexNormals(closed, mesh.triangles);
  const VertexPositions rest_normals = vertexNormals(mesh.vertices, mesh.triangles);
  watchLips(mesh.vertices, closed, upper_vertices, lower_vertices, lower, normals, rest_normals);
  watchLips(mesh.vertices, closed, lower_vertices, upper_vertices, upper, normals, rest_normals);
  const auto cell = static_cast<float>(kTeethCell * mouth_width_);
  upper_teeth_ = TeethShell(mesh.vertices, upper_teeth, true, cell);
  lower_teeth_ = TeethShell(mesh.vertices, lower_teeth, false, cell);
  watchTeeth(mesh.vertices, upper_vertices, upper_teeth_, false, at_upper_teeth_);
  watchTeeth(mesh.vertices, lower_vertices, upper_teeth_, true, at_upper_teeth_);
  watchTeeth(mesh.vertices, lower_vertices, lower_teeth_, false, at_lower_teeth_);
  boundTeeth(upper_teeth_, at_upper_teeth_);
  boundTeeth(lower_teeth_, at_lower_teeth_);
  for (std::size_t c = 0; c < kColumns; ++c) {
    const float column = static_cast<float>(c) + 0.5F;
    const bool is_between = !pair_columns_.empty() && column > pair_columns_.front() && column < pair_columns_.back();
    // Beyond the outermost pairs nothing tells that the lips touch.
    resting_gaps_.push_back(is_between ? static_cast<float>(kTouching * mouth_width_)
                                       : std::numeric_limits<float>::infinity());
  }
  for (const LipWatch& watch : lips_) {
    float& gap = resting_gaps_[watch.column];
    gap = std::min(gap, std::max(0.0F, look(watch, closed.data()).distance));
  }
  draw(mesh.vertices, upper_vertices, -0.5F);
  draw(mesh.vertices, lower_vertices, 0.5F);
}

/// 0 at the right corner of the mouth, kColumns at the left one, and no further.
float LipGuard::columnOf(const Vector3f& p) const {
  const float way = (p - from_).dot(along_) / std::max(along_.squaredNorm(), kLeastLength);
  return std::clamp(way, 0.0F, 0.999F) * static_cast<float>(kColumns);
}

/// Where a watching vertex is to the other lip, whose shape around the watched place is taken along in its frame.
LipGuard::Sight LipGuard::look(const LipWatch& watch, const float* out) const {
  const Frame frame = frameOf(watch, out);
  const Vector3f p = Eigen::Map<const Vector3f>(out + 3 * std::size_t{watch.vertex}) - frame.origin;
  const auto reach = static_cast<float>(kWatched * mouth_width_);
  const float x = p.dot(frame.x) / reach, y = p.dot(frame.y) / reach;
  const float* b = watch.bend;
  const float height = b[0] * x + b[1] * y + b[2] * x * x + b[3] * x * y + b[4] * y * y;
  const float slope_x = b[0] + 2 * b[2] * x + b[3] * y, slope_y = b[1] + b[3] * x + 2 * b[4] * y;
  const float distance = (p.dot(frame.away) - reach * height) / std::sqrt(1 + slope_x * slope_x + slope_y * slope_y);
  // Towards the border of what it sees a watch goes blind, and where its triangle has tipped over.
  const float off = 2 * (x * x + y * y) - 1;
  const float tipped = (kTips - frame.away.dot(Eigen::Map<const Vector3f>(watch.away))) / kTipsOver;
  const auto blind = static_cast<float>(smooth(static_cast<double>(std::max(off, tipped))));
  return {distance + blind * std::max(0.0F, reach - distance), frame.away};
}

void LipGuard::watchLips(const VertexPositions& rest, const VertexPositions& closed,
                         const std::vector<std::uint32_t>& own, const std::vector<std::uint32_t>& others,
                         const std::vector<Triangle>& other, const VertexPositions& normals,
                         const VertexPositions& rest_normals) {
  if (static_cast<double>(own.size()) * static_cast<double>(other.size()) > kMostLooks) {
    throw InputError(fmt::format("found {} vertices and {} triangles at the lips; expected no more than a head has",
                                 own.size(), other.size()));
  }
  // Shapes of dense lips are told by some of their vertices.
  std::vector<std::uint32_t> seen;
  const std::size_t stride = others.size() / kFitVertices + 1;
  for (std::size_t i = 0; i < others.size(); i += stride) seen.push_back(others[i]);
  const NearTriangles near(closed, other, static_cast<float>(kReach * mouth_width_));
  const NearTriangles near_at_rest(rest, other, static_cast<float>(kReach * mouth_width_));
  for (const std::uint32_t v : own) {
    const auto place = near.facing(vertexOf(closed, v), vertexOf(normals, v));
    if (!place) continue;
    const Triangle& t = *place->triangle;
    LipWatch watch{};
    watch.vertex = v;
    std::copy(t.begin(), t.end(), watch.corners);
    watch.weights[0] = place->weights[1];
    watch.weights[1] = place->weights[2];
    watch.column = static_cast<std::uint32_t>(columnOf(vertexOf(rest, v)));
    fitBend(closed, normals, seen, static_cast<float>(kWatched * mouth_width_), watch);
    Eigen::Map<Vector3f>(watch.away) = frameOf(watch, closed.data()).away;
    // Where the lips close by moving, the watch cannot tell how they lie at rest.
    const bool rests_closed = (vertexOf(closed, v) - vertexOf(rest, v)).norm() < kStill * mouth_width_;
    watch.allowed = std::min(0.0F, rests_closed ? look(watch, closed.data()).distance
                                                : near_at_rest.distance(vertexOf(rest, v), vertexOf(rest_normals, v)));
    if (watch.allowed < -static_cast<float>(kElsewhere * mouth_width_)) continue;
    lips_.push_back(watch);
  }
}

void LipGuard::watchTeeth(const VertexPositions& rest, const std::vector<std::uint32_t>& own, const TeethShell& shell,
                          bool around_edge, std::vector<ToothWatch>& watches) const {
  if (shell.empty()) return;
  const auto near = static_cast<float>(kReach * mouth_width_), far = static_cast<float>(kLipsReach * mouth_width_);
  for (const std::uint32_t v : own) {
    const Vector3f p = vertexOf(rest, v);
    const float to_rim = distanceTo(p, rim_);
    if (to_rim > far || (to_rim > near && !shell.isNear(p, 0.5F * near))) continue;
    const float depth = shell.depthAt(p, static_cast<float>(kDeepInTeeth * mouth_width_), around_edge).depth;
    watches.push_back({v, around_edge, depth, 0, p});
  }
}

/// How far each watch may move without a look at the teeth.
void LipGuard::boundTeeth(TeethShell& shell, std::vector<ToothWatch>& watches) const {
  if (shell.empty()) return;
  for (const double share : {0.08, 0.04, 0.02, 0.01}) {
    const auto margin = static_cast<float>(share * mouth_width_);
    shell.bound(margin);
    for (ToothWatch& watch : watches) {
      if (watch.free <= 0 && !shell.mayTouch(watch.rest)) watch.free = margin * margin;
    }
  }
  shell.bound(static_cast<float>(kSlips * mouth_width_));
}

void LipGuard::draw(const VertexPositions& rest, const std::vector<std::uint32_t>& own, float share) {
  const auto reach = static_cast<float>(kDrawnFrom * mouth_width_);
  for (const std::uint32_t v : own) {
    const float distance = distanceTo(vertexOf(rest, v), rim_);
    if (distance >= reach) continue;
    const float column = std::max(0.0F, columnOf(vertexOf(rest, v)) - 0.5F);
    const auto first = std::min(static_cast<std::size_t>(column), kColumns - 2);
    drawn_.push_back({v, static_cast<std::uint32_t>(first), std::min(1.0F, column - static_cast<float>(first)),
                      share * static_cast<float>(1 - smooth(static_cast<double>(distance / reach)))});
  }
}

double LipGuard::narrowestGap(const MarkerPositions& points) const {
  double narrowest = std::numeric_limits<double>::infinity();
  for (const LipPair& pair : pairs_)
    narrowest = std::min(narrowest, (points.row(pair.upper_rim) - points.row(pair.lower_rim)).norm());
  return narrowest;
}

void LipGuard::findNearTeeth(const TeethShell& shell, const std::vector<ToothWatch>& watches, const Moved& with,
                             const float* out, std::vector<const ToothWatch*>& near) {
  near.clear();
  for (const ToothWatch& watch : watches) {
    const Vector3f p = with.back(Eigen::Map<const Vector3f>(out + 3 * std::size_t{watch.vertex}));
    if ((p - watch.rest).squaredNorm() >= watch.free && shell.mayTouch(p)) near.push_back(&watch);
  }
}

void LipGuard::findNearLips(const float* out, std::vector<const LipWatch*>& near) const {
  const auto at = [out](std::uint32_t v) { return Eigen::Map<const Vector3f>(out + 3 * std::size_t{v}); };
  const auto reach = static_cast<float>(kWatched * mouth_width_), above = static_cast<float>(kSeenAbove * mouth_width_);
  near.clear();
  for (const LipWatch& watch : lips_) {
    const Vector3f a = at(watch.corners[0]), ab = at(watch.corners[1]) - a, ac = at(watch.corners[2]) - a;
    const Vector3f p = at(watch.vertex) - a - watch.weights[0] * ab - watch.weights[1] * ac, across = ab.cross(ac);
    const float over = p.dot(across);
    if (p.squaredNorm() > 2 * reach * reach || (over > 0 && over * over > above * above * across.squaredNorm()))
      continue;
    near.push_back(&watch);
  }
}

/// The largest push. Watches that are far from the other lip leave `near`.
float LipGuard::partLips(float share, float ease, std::vector<const LipWatch*>& near, float* out) const {
  thread_local std::vector<std::pair<std::uint32_t, Vector3f>> pushes;
  pushes.clear();
  pushes.reserve(lips_.size());
  float largest = 0;
  const auto far = static_cast<float>(kComesNear * mouth_width_);
  std::erase_if(near, [&](const LipWatch* watch) {
    const Sight sight = look(*watch, out);
    const float push = share * pushBack(sight.distance - watch->allowed, ease);
    if (push > 0) pushes.emplace_back(watch->vertex, push * sight.away);
    largest = std::max(largest, push);
    return sight.distance > far;
  });
  for (const auto& [vertex, push] : pushes) Eigen::Map<Vector3f>(out + 3 * std::size_t{vertex}) += push;
  return largest;
}

/// The largest push out of this row of teeth, which has gone along with `with`. Watches outside leave `near`.
float LipGuard::leaveTeeth(const TeethShell& shell, std::vector<const ToothWatch*>& near, const Moved& with, float ease,
                           float* out) const {
  const auto deepest = static_cast<float>(kDeepInTeeth * mouth_width_);
  float largest = 0;
  std::erase_if(near, [&](const ToothWatch* watch) {
    Eigen::Map<Vector3f> p(out + 3 * std::size_t{watch->vertex});
    const TeethShell::Depth depth = shell.depthAt(with.back(p), deepest, watch->around_edge);
    if (depth.depth <= watch->allowed) return true;
    const float push = pushBack(watch->allowed - depth.depth, ease);
    p += push * (with.turn * depth.out);
    largest = std::max(largest, push);
    return false;
  });
  return largest;
}

/// How far the lips of a pair are shut: not where they have opened, nor where they are kept apart.
float LipGuard::shutShare(const LipGap& gap) const {
  return static_cast<float>((1 - gap.opened) * (1 - smooth(gap.least / (kKeptApart * mouth_width_))));
}

/// Lips that touch may still be a little apart on the mesh, whose rims the control surface knows at five places only:
/// each column's narrowest place is closed, as far as `gaps` say that the lips touch there.
void LipGuard::drawTogether(const MarkerPositions& points, std::span<const LipGap> gaps,
                            const std::vector<const LipWatch*>& near, float* out) const {
  std::array<float, kColumns> way;
  way.fill(std::numeric_limits<float>::infinity());
  for (const LipWatch* watch : near) way[watch->column] = std::min(way[watch->column], look(*watch, out).distance);
  bool any = false;
  for (std::size_t c = 0; c < kColumns; ++c) {
    const float column = static_cast<float>(c) + 0.5F;
    const auto next = std::upper_bound(pair_columns_.begin(), pair_columns_.end(), column) - pair_columns_.begin();
    const auto last = static_cast<std::ptrdiff_t>(pairs_.size()) - 1;
    const auto before = static_cast<std::size_t>(std::max<std::ptrdiff_t>(next - 1, 0));
    const auto after = static_cast<std::size_t>(std::min(next, last));
    const float span = pair_columns_[after] - pair_columns_[before];
    const float weight = span > 0 ? (column - pair_columns_[before]) / span : 0;
    const auto closed = shutShare(gaps[before]) * (1 - weight) + shutShare(gaps[after]) * weight;
    // What is further apart than lips that touch ever are is not drawn: the pull fades out.
    const auto apart = static_cast<double>(way[c]) / mouth_width_;
    const auto drawn = closed * static_cast<float>(1 - smooth((apart - kDrawnWhole) / (kSeenAbove - kDrawnWhole)));
    way[c] = apart < kSeenAbove ? drawn * std::max(0.0F, way[c] - resting_gaps_[c]) : 0;
    any = any || way[c] > 0;
  }
  if (!any) return;
  Eigen::Vector3d lips = Eigen::Vector3d::Zero();
  for (const LipPair& pair : pairs_)
    lips += (points.row(pair.upper_marker) - points.row(pair.lower_marker)).transpose();
  const Vector3f up = lips.normalized().cast<float>();
  for (const Drawn& vertex : drawn_) {
    const float far = (1 - vertex.next) * way[vertex.column] + vertex.next * way[vertex.column + 1];
    Eigen::Map<Vector3f>(out + 3 * std::size_t{vertex.vertex}) += vertex.share * far * up;
  }
}

void LipGuard::separate(const MarkerPositions& points, std::span<const LipGap> gaps, const AddedMotion& jaw,
                        float* out) const {
  const auto ease = static_cast<float>(kEase * mouth_width_);
  const double apart = narrowestGap(points) / (kFarApart * mouth_width_);
  const bool may_touch = apart < 1 && !lips_.empty();
  thread_local std::vector<const LipWatch*> near;
  thread_local std::vector<const ToothWatch*> near_upper_teeth, near_lower_teeth;
  near.clear();
  near.reserve(lips_.size());
  near_upper_teeth.reserve(at_upper_teeth_.size());
  near_lower_teeth.reserve(at_lower_teeth_.size());
  if (may_touch) findNearLips(out, near);
  if (!gaps.empty() && !near.empty()) drawTogether(points, gaps, near, out);
  const Moved still_head,
      lower_jaw{true, Eigen::Matrix3f::Identity() + jaw.turn.cast<float>(), jaw.shift.cast<float>()};
  findNearTeeth(upper_teeth_, at_upper_teeth_, still_head, out, near_upper_teeth);
  findNearTeeth(lower_teeth_, at_lower_teeth_, lower_jaw, out, near_lower_teeth);
  const auto share = static_cast<float>(0.5 * (1 - smooth(2 * apart - 1)));
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    const float of_lips = partLips(share, ease, near, out);
    const float of_upper_teeth = leaveTeeth(upper_teeth_, near_upper_teeth, still_head, ease, out);
    const float of_lower_teeth = leaveTeeth(lower_teeth_, near_lower_teeth, lower_jaw, ease, out);
    if (std::max({of_lips, of_upper_teeth, of_lower_teeth}) < kStill * mouth_width_) break;
  }
}

}  // namespace mouthpiece
