// Which vertices of the lips watch what, and how far they may go: found once for a face.
#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "base/errors.h"
#include "base/smooth_step.h"
#include "deform/mouth/lip_guard.h"
#include "deform/surface/lip_sides.h"
#include "deform/mesh/near_triangles.h"
#include "deform/surface/virtual_points.h"

namespace mouthpiece {
namespace {

using Eigen::Vector3f;

// Lengths as shares of the mouth's width.
constexpr double kReach = 0.12;       ///< a vertex watches what is nearer than this at rest
constexpr double kLipsReach = 0.16;   ///< lips may lie on teeth this far from their rims
constexpr double kTeethCell = 0.012;  ///< of the net over the teeth
constexpr double kDrawnFrom = 0.12;   ///< lips are drawn together from within this of their rims
constexpr double kSlips = 0.002;      ///< the guard itself moves what touches no teeth by little more than this
constexpr double kTouching = 0.002;   ///< lips no further apart at rest touch there and stay so
constexpr double kElsewhere = 0.03;   ///< what is further behind the other lip at rest does not meet it
constexpr double kMostLooks = 2e10;   ///< vertices times triangles of lips: a head of millions has half of this
constexpr std::size_t kFitVertices = 8000;
constexpr float kLeastLength = 1e-30F;

Vector3f vertexOf(const VertexPositions& vertices, std::uint32_t v) { return vertices.row(v).transpose(); }

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
  const auto side_of = [&](std::uint32_t v) {
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
      const std::uint32_t side = side_of(triangle[0]) & side_of(triangle[1]) & side_of(triangle[2]);
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
  const auto reach = static_cast<float>(kWatched * mouth_width_);
  for (const LipWatch& watch : lips_) {
    float& gap = resting_gaps_[watch.column];
    gap = std::min(gap, std::max(0.0F, watch.look(closed.data(), reach).distance));
  }
  draw(mesh.vertices, upper_vertices, -0.5F);
  draw(mesh.vertices, lower_vertices, 0.5F);
}

/// 0 at the right corner of the mouth, kColumns at the left one, and no further.
float LipGuard::columnOf(const Vector3f& p) const {
  const float way = (p - from_).dot(along_) / std::max(along_.squaredNorm(), kLeastLength);
  return std::clamp(way, 0.0F, 0.999F) * static_cast<float>(kColumns);
}

void LipGuard::watchLips(const VertexPositions& rest, const VertexPositions& closed,
                         const std::vector<std::uint32_t>& own, const std::vector<std::uint32_t>& others,
                         const std::vector<Triangle>& other, const VertexPositions& normals,
                         const VertexPositions& rest_normals) {
  if (static_cast<double>(own.size()) * static_cast<double>(other.size()) > kMostLooks) {
    throw InputError(fmt::format("found {} vertices and {} triangles at the lips; expected no more than a head has",
                                 own.size(), other.size()));
  }
  const auto reach = static_cast<float>(kWatched * mouth_width_);
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
    watch.takeShape(closed, normals, seen, reach);
    // Where the lips close by moving, the watch cannot tell how they lie at rest.
    const bool rests_closed = (vertexOf(closed, v) - vertexOf(rest, v)).norm() < kStill * mouth_width_;
    watch.allowed = std::min(0.0F, rests_closed ? watch.look(closed.data(), reach).distance
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
                      share * static_cast<float>(1 - smoothStep(static_cast<double>(distance / reach)))});
  }
}

}  // namespace mouthpiece
