// Which vertices of the lips watch what, and how far they may go: found once for a face.
#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <optional>
#include <set>

#include "base/errors.h"
#include "base/smooth_step.h"
#include "deform/mesh/face_mesh.h"
#include "deform/mouth/lip_guard.h"
#include "deform/mouth/lip_levelling.h"
#include "deform/surface/virtual_points.h"

namespace mouthpiece {
namespace {

using Eigen::Vector3f;

// Lengths as shares of the mouth's width.
constexpr double kReach = 0.12;       ///< a vertex watches what is nearer than this at rest
constexpr double kLipsReach = 0.16;   ///< lips may lie on teeth this far from their rims
constexpr double kTeethCell = 0.012;  ///< of the net over the teeth
constexpr double kDrawnFrom = 0.12;   ///< lips are drawn together from within this of their rims
constexpr float kDrawnFurther = 2;    ///< lips that are pressed are drawn from this times as much further apart
constexpr double kSlips = 0.002;      ///< the guard itself moves what touches no teeth by little more than this
constexpr double kTouching = 0.002;   ///< lips no further apart at rest touch there and stay so
constexpr double kElsewhere = 0.03;   ///< what is further behind the other lip at rest does not meet it
constexpr double kAtCorner = 0.05;    ///< so near to a corner of the mouth the lips are one surface that folds
constexpr double kOffCorner = 0.15;   ///< and from here on they are two
constexpr double kMostLooks = 2e10;   ///< vertices times triangles of lips: a head of millions has half of this
constexpr std::size_t kFitVertices = 8000;
/// Edges near the rims that are longer have watches between their ends. They let the other lip in a little: where
/// vertices of coarse lips touch, their edges cross.
constexpr double kWatchEvery = 0.03, kEdgesNear = 0.05, kEdgesLetIn = 0.005;
constexpr Eigen::Index kMostCuts = 16;
constexpr float kOpposed = -0.3F;  ///< cosine between surfaces that can meet

Vector3f vertexOf(const VertexPositions& vertices, std::uint32_t v) { return vertices.row(v).transpose(); }

/// Weights of the corners at 15 places of a triangle, a row each, the last one twice.
Eigen::Array<float, 16, 3> placesOfATriangle() {
  constexpr int kCuts = 4;
  Eigen::Array<float, 16, 3> places;
  Eigen::Index place = 0;
  for (int i = 0; i <= kCuts; ++i) {
    for (int j = 0; i + j <= kCuts; ++j)
      places.row(place++) = Eigen::Array3i(i, j, kCuts - i - j).cast<float>() / float{kCuts};
  }
  places.row(place) = places.row(place - 1);
  return places;
}

/// Weights of the place of a triangle that is nearest to `p`, sought on a net of 15 places: lips are finer than what
/// that misses.
Vector3f nearestWeights(const Vector3f& p, const Eigen::Matrix3f& corners, float& squared) {
  static const Eigen::Array<float, 16, 3> kPlaces = placesOfATriangle();
  const auto along = [&](Eigen::Index axis) -> Eigen::Array<float, 16, 1> {
    return (kPlaces.col(0) * corners(axis, 0) + kPlaces.col(1) * corners(axis, 1) + kPlaces.col(2) * corners(axis, 2) -
            p[axis])
        .square();
  };
  Eigen::Index place = 0;
  squared = (along(0) + (along(1) + along(2))).minCoeff(&place);
  return kPlaces.row(place);
}

/// Nearest places on a lip's triangles that face a vertex of the other.
class FacingLip {
 public:
  struct Nearest {
    Triangle triangle;
    Vector3f weights;  ///< of its corners
  };

  /// Sees no further than `reach`.
  FacingLip(const VertexPositions& vertices, std::vector<Triangle> triangles, float reach)
      : vertices_(vertices), reach_(reach) {
    for (const Triangle& triangle : sortedByX(vertices, std::move(triangles))) {
      const Eigen::Matrix3f corners = vertices(triangle, Eigen::all).transpose();
      const Vector3f ab = corners.col(1) - corners.col(0), ac = corners.col(2) - corners.col(0);
      if (ab.cast<double>().cross(ac.cast<double>()).isZero(0)) continue;
      facets_.push_back({triangle, corners, ab.cross(ac).normalized()});
    }
    middles_.resize(signedIndex(facets_.size()), 3);
    radii_.resize(middles_.rows());
    for (Eigen::Index i = 0; i < radii_.size(); ++i) {
      const Eigen::Matrix3f& corners = facets_[unsignedIndex(i)].corners;
      const Vector3f middle = (corners.col(0) + corners.col(1) + corners.col(2)) / 3;
      middles_.row(i) = middle.transpose();
      radii_[i] = (corners.colwise() - middle).colwise().norm().maxCoeff();
      largest_ = std::max(largest_, radii_[i]);
    }
  }

  /// Quicker where the place asked for before is near; that changes nothing else.
  [[nodiscard]] std::optional<Nearest> facing(const Vector3f& p, const Vector3f& normal) {
    float least = reach_ * reach_;
    // A corner is a place of its triangle: what lies wholly further away than one is not the nearest.
    float corner = least;
    const auto takeCorners = [&](const Facet& facet) {
      corner = std::min(corner, (facet.corners.colwise() - p).colwise().squaredNorm().minCoeff());
    };
    if (last_ != nullptr && last_->across.dot(normal) <= kOpposed) takeCorners(*last_);
    float away = std::sqrt(corner);
    const auto x = middles_.col(0);
    const float beside = kRounds * (away + largest_);
    const Eigen::Index first = std::lower_bound(x.begin(), x.end(), p.x() - beside) - x.begin(),
                       count = std::upper_bound(x.begin() + first, x.end(), p.x() + beside) - x.begin() - first;
    // No place of a facet is nearer than this.
    thread_local Eigen::ArrayXf least_away;
    least_away =
        ((x.segment(first, count) - p.x()).square() + (middles_.col(1).segment(first, count) - p.y()).square() +
         (middles_.col(2).segment(first, count) - p.z()).square())
                .sqrt() /
            kRounds -
        radii_.segment(first, count);
    thread_local std::vector<Eigen::Index> near;
    near.clear();
    for (Eigen::Index i = 0; i < count; ++i) {
      const Facet& facet = facets_[unsignedIndex(first + i)];
      if (least_away[i] > away || facet.across.dot(normal) > kOpposed) continue;
      near.push_back(i);
      takeCorners(facet);
      away = std::sqrt(corner);
    }
    std::optional<Nearest> nearest;
    for (const Eigen::Index i : near) {
      if (least_away[i] > std::sqrt(std::min(least, corner))) continue;
      const Facet& facet = facets_[unsignedIndex(first + i)];
      float squared = 0;
      const Vector3f weights = nearestWeights(p, facet.corners, squared);
      if (squared >= least) continue;
      least = squared;
      nearest = {facet.triangle, weights};
      last_ = &facet;
    }
    return nearest;
  }

  /// From the plane of the nearest triangle that faces `p`; 0 where there is none.
  [[nodiscard]] float distance(const Vector3f& p, const Vector3f& normal) {
    const auto nearest = facing(p, normal);
    if (!nearest) return 0;
    const auto& [a, b, c] = nearest->triangle;
    const Vector3f at = vertexOf(vertices_, a);
    const Vector3f across = (vertexOf(vertices_, b) - at).cross(vertexOf(vertices_, c) - at);
    return (p - at).dot(across) / std::max(across.norm(), kLeastLength);
  }

 private:
  /// Of places equally near the rightmost triangle's counts, whatever the order in the file.
  static std::vector<Triangle> sortedByX(const VertexPositions& vertices, std::vector<Triangle> triangles) {
    const auto middle = [&](const Triangle& t) {
      return (vertices(t[0], 0) + vertices(t[1], 0) + vertices(t[2], 0)) / 3;
    };
    std::sort(triangles.begin(), triangles.end(),
              [&](const Triangle& a, const Triangle& b) { return middle(a) < middle(b); });
    return triangles;
  }

  static constexpr float kRounds = 1.0001F;  ///< room for rounding

  struct Facet {
    Triangle triangle;
    Eigen::Matrix3f corners;
    Vector3f across;
  };

  const VertexPositions& vertices_;
  float reach_;
  std::vector<Facet> facets_;    ///< those with an area, by the x of their middles
  Eigen::ArrayX3f middles_;      ///< facets x 3
  Eigen::ArrayXf radii_;         ///< of the balls around the middles that hold the facets
  float largest_ = 0;            ///< of the radii
  const Facet* last_ = nullptr;  ///< found last
};

}  // namespace

LipGuard::LipGuard(const FaceMesh& mesh, const VertexPositions& closed, const ControlMesh& control,
                   const FaceBinding& binding, std::span<const std::uint32_t> found, const HeadTopology* topology)
    : pairs_(lipPairs(control)), rim_(openingsOf(control).lip_line), mouth_width_(control.mouth_width) {
  const auto place = [&](int point) -> Vector3f { return control.rest.row(point).transpose().cast<float>(); };
  const int right = findPoint(control, "LIP_CORNER_R"), left = findPoint(control, "LIP_CORNER_L");
  if (right >= 0 && left >= 0) {
    from_ = place(right);
    along_ = place(left) - from_;
  }
  for (const LipPair& pair : pairs_)
    pair_columns_.push_back(columnOf(0.5F * (place(pair.upper_rim) + place(pair.lower_rim))));
  if (!takeFound(found, mesh.vertexCount())) takeLips(mesh, closed, control, binding);
  if (!binding.meets) return;
  VertexPositions levelled = closed;
  for (const Levelled& vertex : levelled_) levelled(vertex.vertex, 1) += vertex.way;
  meeting_.emplace(mesh, levelled, control, binding, topology);
}

void LipGuard::takeLips(const FaceMesh& mesh, const VertexPositions& unlevelled, const ControlMesh& control,
                        const FaceBinding& binding) {
  const LipVertices lips(mesh, control, binding);
  std::vector<Triangle> upper, lower, around;
  std::copy_if(mesh.triangles.begin(), mesh.triangles.end(), std::back_inserter(around), [&](const Triangle& t) {
    return std::any_of(t.begin(), t.end(), [&](std::uint32_t v) { return lips.upper[v] || lips.lower[v]; });
  });
  for (const Triangle& t : trianglesOf(mesh, {PartKind::kSkin, PartKind::kLips, PartKind::kMouthInside})) {
    if (lips.upper[t[0]] && lips.upper[t[1]] && lips.upper[t[2]]) upper.push_back(t);
    if (lips.lower[t[0]] && lips.lower[t[1]] && lips.lower[t[2]]) lower.push_back(t);
  }
  const std::vector<std::uint32_t> upper_vertices = lips.ofOne(true), lower_vertices = lips.ofOne(false);
  VertexPositions rest = mesh.vertices, closed = unlevelled;
  for (std::size_t i = 0; i < binding.levelled.vertices.size(); ++i) {
    const std::uint32_t v = binding.levelled.vertices[i];
    const float way = binding.levelled.ways[i];
    levelled_.push_back({v, static_cast<std::uint32_t>(columnOf(vertexOf(rest, v))), way});
    rest(v, 1) += way;
    closed(v, 1) += way;
  }
  const VertexPositions normals = vertexNormals(closed, around);
  const VertexPositions rest_normals = vertexNormals(rest, around);
  // What faces away from the other lip when the mouth closes is no place that it meets. Slivers of coarse rims face
  // anywhere: one seen from its back pushes lips further into each other the further they part.
  const auto towards = [&closed](std::vector<Triangle> lip, float up) {
    std::erase_if(lip, [&](const Triangle& t) {
      const Vector3f a = vertexOf(closed, t[0]);
      return up * (vertexOf(closed, t[1]) - a).cross(vertexOf(closed, t[2]) - a).y() < 0;
    });
    return lip;
  };
  watchLips(rest, closed, placesOn(rest, upper_vertices, upper), lower_vertices, towards(lower, 1), normals,
            rest_normals);
  watchLips(rest, closed, placesOn(rest, lower_vertices, lower), upper_vertices, towards(upper, -1), normals,
            rest_normals);
  const float cell = lengthOf(kTeethCell);
  // Beside the corners the mouth's inside is one wall that folds: its halves are no lips that meet.
  constexpr float kColumnsBeyond = 1;
  std::erase_if(lips_, [&](const LipWatch& watch) {
    const float column = columnOf(watch.own.in(rest.data()));
    return isCarried(binding, watch.own.ends[0]) && !isBetweenPairs(column + kColumnsBeyond) &&
           !isBetweenPairs(column - kColumnsBeyond);
  });
  upper_teeth_ = TeethShell(mesh.vertices, trianglesOf(mesh, {PartKind::kUpperTeeth}), true, cell);
  lower_teeth_ = TeethShell(mesh.vertices, trianglesOf(mesh, {PartKind::kLowerTeeth}), false, cell);
  watchTeeth(mesh.vertices, upper_vertices, upper_teeth_, false, at_upper_teeth_);
  watchTeeth(mesh.vertices, lower_vertices, upper_teeth_, true, at_upper_teeth_);
  watchTeeth(mesh.vertices, lower_vertices, lower_teeth_, false, at_lower_teeth_);
  boundTeeth(upper_teeth_, at_upper_teeth_);
  boundTeeth(lower_teeth_, at_lower_teeth_);
  for (std::size_t c = 0; c < kColumns; ++c) {
    // Beyond the outermost pairs nothing tells that the lips touch.
    resting_gaps_.push_back(isBetweenPairs(middleOf(c)) ? lengthOf(kTouching) : std::numeric_limits<float>::infinity());
  }
  std::vector<const LipWatch*> all;
  for (const LipWatch& watch : lips_) {
    all.push_back(&watch);
    if (watch.own.isVertex()) watched_columns_.push_back(watch.column);
  }
  std::sort(watched_columns_.begin(), watched_columns_.end());
  watched_columns_.erase(std::unique(watched_columns_.begin(), watched_columns_.end()), watched_columns_.end());
  const std::array<float, kColumns> closed_gaps = gapsSeen(all, closed.data());
  for (std::size_t c = 0; c < kColumns; ++c)
    resting_gaps_[c] = std::min(resting_gaps_[c], std::max(0.0F, closed_gaps[c]));
  drawn_further_.assign(kColumns, 0.0F);
  if (!binding.pressed.empty()) {
    for (std::size_t c = 0; c < kColumns; ++c) drawn_further_[c] = kDrawnFurther * std::max(0.0F, binding.pressed[c]);
    for (std::size_t c = 0; c < kColumns; ++c) resting_gaps_[c] -= binding.pressed[c];
    for (LipWatch& watch : lips_) {
      const float pressed = binding.pressed[watch.column];
      const float told = watch.allowed;
      watch.allowed -= pressed;
      if (pressed > 0) watch.unsure = kUnsure;
      if (pressed > 0 || !restsClosed(watch.own, rest, closed)) continue;
      // What is held apart stays as it is where the lips touch at rest.
      const float lets_in = watch.own.isVertex() ? 0 : lengthOf(kEdgesLetIn);
      watch.allowed =
          std::min(watch.allowed,
                   std::max(told + lets_in, std::min(0.0F, watch.look(closed.data(), lengthOf(kWatched)).distance)));
    }
  }
  draw(mesh.vertices, upper_vertices, -0.5F);
  draw(mesh.vertices, lower_vertices, 0.5F);
}

/// The vertices of one lip, and places between the ends of its edges near the rim.
std::vector<LipPlace> LipGuard::placesOn(const VertexPositions& rest, const std::vector<std::uint32_t>& own,
                                         const std::vector<Triangle>& triangles) const {
  std::vector<LipPlace> places;
  std::set<std::uint32_t> near;
  for (const std::uint32_t v : own) {
    places.push_back({{v, v}, 0});
    if (toRim(vertexOf(rest, v)) <= lengthOf(kEdgesNear)) near.insert(v);
  }
  std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
  for (const Triangle& t : triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const auto edge = std::minmax(t[k], t[(k + 1) % 3]);
      if (near.contains(edge.first) && near.contains(edge.second)) edges.emplace(edge);
    }
  }
  for (const auto& [a, b] : edges) {
    const float length = (vertexOf(rest, a) - vertexOf(rest, b)).norm();
    const auto cuts = std::min<Eigen::Index>(wholePart(std::ceil(length / lengthOf(kWatchEvery))), kMostCuts);
    for (Eigen::Index i = 1; i < cuts; ++i) places.push_back({{a, b}, asFloat(i) / asFloat(cuts)});
  }
  return places;
}

bool LipGuard::restsClosed(const LipPlace& place, const VertexPositions& rest, const VertexPositions& closed) const {
  return (place.in(closed.data()) - place.in(rest.data())).norm() < kStill * mouth_width_;
}

float LipGuard::toRim(const Vector3f& p) const { return asFloat(distanceToLine(p.cast<double>(), rim_)); }

float LipGuard::besideCorners(const Vector3f& p) const {
  const double distance = double{std::min((p - from_).norm(), (p - from_ - along_).norm())} / mouth_width_;
  return asFloat(smoothStep((distance - kAtCorner) / (kOffCorner - kAtCorner)));
}

/// 0 at the right corner of the mouth, kColumns at the left one, and no further.
float LipGuard::columnOf(const Vector3f& p) const {
  const float way = (p - from_).dot(along_) / std::max(along_.squaredNorm(), kLeastLength);
  return std::clamp(way, 0.0F, 0.999F) * asFloat(kColumns);
}

void LipGuard::watchLips(const VertexPositions& rest, const VertexPositions& closed, const std::vector<LipPlace>& own,
                         const std::vector<std::uint32_t>& others, const std::vector<Triangle>& other,
                         const VertexPositions& normals, const VertexPositions& rest_normals) {
  if (asReal(own.size()) * asReal(other.size()) > kMostLooks) {
    throw InputError(fmt::format("found {} vertices and {} triangles at the lips; expected no more than a head has",
                                 own.size(), other.size()));
  }
  const float reach = lengthOf(kWatched);
  // Shapes of dense lips are told by some of their vertices.
  std::vector<std::uint32_t> seen;
  const std::size_t stride = others.size() / kFitVertices + 1;
  for (std::size_t i = 0; i < others.size(); i += stride) seen.push_back(others[i]);
  std::sort(seen.begin(), seen.end(),
            [&](std::uint32_t a, std::uint32_t b) { return std::pair(closed(a, 0), a) < std::pair(closed(b, 0), b); });
  FacingLip near(closed, other, lengthOf(kReach)), near_at_rest(rest, other, lengthOf(kReach));
  for (const LipPlace& here : own) {
    const Vector3f at_rest = here.in(rest.data()), at_closed = here.in(closed.data());
    const auto place = near.facing(at_closed, here.in(normals.data()).normalized());
    if (!place) continue;
    LipWatch watch{};
    watch.own = here;
    std::copy(place->triangle.begin(), place->triangle.end(), watch.corners);
    watch.weights[0] = place->weights[1];
    watch.weights[1] = place->weights[2];
    watch.column = static_cast<std::uint32_t>(columnOf(at_rest));
    watch.firm = besideCorners(at_rest);
    if (watch.firm <= 0) continue;
    watch.takeShape(closed, normals, seen, reach);
    // Where the lips close by moving, the watch cannot tell how they lie at rest.
    watch.allowed = std::min(0.0F, restsClosed(here, rest, closed)
                                       ? watch.look(closed.data(), reach).distance
                                       : near_at_rest.distance(at_rest, here.in(rest_normals.data()).normalized()));
    if (watch.allowed < -lengthOf(kElsewhere)) continue;
    if (!here.isVertex()) watch.allowed -= lengthOf(kEdgesLetIn);
    lips_.push_back(watch);
  }
}

void LipGuard::watchTeeth(const VertexPositions& rest, const std::vector<std::uint32_t>& own, const TeethShell& shell,
                          bool around_edge, std::vector<ToothWatch>& watches) const {
  if (shell.empty()) return;
  const float near = lengthOf(kReach), far = lengthOf(kLipsReach);
  for (const std::uint32_t v : own) {
    const Vector3f p = vertexOf(rest, v);
    const float to_rim = toRim(p);
    if (to_rim > far || (to_rim > near && !shell.isNear(p, 0.5F * near))) continue;
    // As deep as it rests a lip may always lie: rolled in over the teeth it is deeper than what is pushed out of them,
    // and snapped out as soon as a pose brought it nearer.
    const float depth = shell.depthAt(p, std::numeric_limits<float>::infinity(), around_edge).depth;
    watches.push_back({v, around_edge ? 1U : 0U, depth, 0, p});
  }
}

/// How far each watch may move without a look at the teeth.
void LipGuard::boundTeeth(TeethShell& shell, std::vector<ToothWatch>& watches) const {
  if (shell.empty()) return;
  for (const double share : {0.08, 0.04, 0.02, 0.01}) {
    const float margin = lengthOf(share);
    shell.bound(margin);
    for (ToothWatch& watch : watches) {
      if (watch.free <= 0 && !shell.mayTouch(watch.rest)) watch.free = margin * margin;
    }
  }
  shell.bound(lengthOf(kSlips));
}

void LipGuard::draw(const VertexPositions& rest, const std::vector<std::uint32_t>& own, float share) {
  const float reach = lengthOf(kDrawnFrom);
  for (const std::uint32_t v : own) {
    const float distance = toRim(vertexOf(rest, v));
    if (distance >= reach) continue;
    const float column = std::max(0.0F, columnOf(vertexOf(rest, v)) - 0.5F);
    const auto first = std::min(static_cast<std::uint32_t>(column), std::uint32_t{kColumns - 2});
    drawn_.push_back(
        {v, first, std::min(1.0F, column - asFloat(first)), share * asFloat(1 - smoothStep(double{distance / reach}))});
  }
}

}  // namespace mouthpiece
