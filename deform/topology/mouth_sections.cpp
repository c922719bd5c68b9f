#include "deform/topology/mouth_sections.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <map>

namespace mouthpiece {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// Lengths as shares of the mouth's width.
constexpr double kRegion = 1.6;      ///< triangles further from the mouth's middle are not looked at
constexpr double kBeyondRed = 0.08;  ///< outlines start this far above and below the hints

/// Sections are cut beside round numbers, where symmetric meshes have whole rows of vertices.
constexpr double kOffMiddle = 1.234e-5;

struct EdgeCut {
  std::uint32_t low, high;  ///< places of the edge's ends
  bool operator==(const EdgeCut& other) const = default;
};

struct EdgeCutHash {
  std::size_t operator()(const EdgeCut& cut) const {
    return std::hash<std::uint64_t>()((std::uint64_t{cut.low} << 32U) ^ (cut.high * 0x9e3779b9U));
  }
};

/// Points at steps along an outline.
void resample(Outline& outline) {
  std::vector<OutlinePoint> even;
  for (std::size_t i = 0; i + 1 < outline.points.size(); ++i) {
    const OutlinePoint &from = outline.points[i], &to = outline.points[i + 1];
    if (from.way > MouthSections::kOutline) break;
    even.push_back(from);
    const int cuts = static_cast<int>(std::min(64.0, std::floor((to.way - from.way) / MouthSections::kStep)));
    for (int k = 1; k <= cuts; ++k) {
      const double share = k / (cuts + 1.0);
      even.push_back({from.at + share * (to.at - from.at), from.a, from.b, from.way + share * (to.way - from.way)});
    }
  }
  if (outline.points.back().way <= MouthSections::kOutline + MouthSections::kStep)
    even.push_back(outline.points.back());
  outline.points = std::move(even);
}

}  // namespace

/// Its cuts through edges and triangles.
struct MouthSections::Plane {
  struct Node {
    Vector2d at;
    std::vector<std::uint32_t> pieces;
  };
  struct Piece {
    std::uint32_t triangle;
    std::array<std::uint32_t, 2> nodes;
    std::array<std::array<std::uint32_t, 2>, 2> edges;  ///< vertices of the edges cut
  };
  std::vector<Node> nodes;
  std::vector<Piece> pieces;
};

MouthSections::MouthSections(const VertexPositions& vertices, std::span<const Triangle> triangles,
                             const MouthHints& hints)
    : vertices_(vertices), hints_(hints), origin_(hints.corner_right) {
  across_ = hints.corner_left - hints.corner_right;
  width_ = across_.norm();
  across_ /= width_;
  up_ = hints.upper - hints.lower;
  up_ -= up_.dot(across_) * across_;
  // Clicks on lips that are thin tell less of where is up than the head itself.
  up_ = (up_ / width_ + 0.2 * (Vector3d::UnitY() - across_.y() * across_)).normalized();
  forward_ = across_.cross(up_);
  takeRegion(triangles);
}

bool MouthSections::isMouth() const {
  return width_ > 0 && std::isfinite(width_) && across_.allFinite() && forward_.allFinite() && forward_.z() > 0.2 &&
         !region_.empty();
}

void MouthSections::takeRegion(std::span<const Triangle> triangles) {
  const Vector3d middle = 0.5 * (hints_.corner_right + hints_.corner_left);
  std::map<std::array<float, 3>, std::uint32_t> first_at;
  for (const Triangle& triangle : triangles) {
    const Vector3d p = pointAt(vertices_, triangle[0]);
    if (!((p - middle).norm() < kRegion * width_)) continue;
    region_.push_back(triangle);
    for (const std::uint32_t v : triangle) {
      if (place_.contains(v)) continue;
      const auto found = first_at.try_emplace({vertices_(v, 0), vertices_(v, 1), vertices_(v, 2)}, v).first;
      place_[v] = found->second;
      way_[found->second] = wayOf(pointAt(vertices_, v));
    }
  }
  places_.reserve(region_.size());
  ways_.reserve(region_.size());
  for (const Triangle& triangle : region_) {
    auto& places = places_.emplace_back();
    auto& ways = ways_.emplace_back();
    for (std::size_t k = 0; k < 3; ++k) {
      places[k] = place_.at(triangle[k]);
      ways[k] = way_.at(places[k]);
    }
  }
}

Vector2d MouthSections::inSection(const Vector3d& p) const {
  return {(p - origin_).dot(forward_) / width_, (p - origin_).dot(up_) / width_};
}

Vector3d MouthSections::inSpace(double way, const Vector2d& p) const {
  return origin_ + width_ * (way * across_ + p.x() * forward_ + p.y() * up_);
}

double MouthSections::wayOf(const Vector3d& p) const { return (p - origin_).dot(across_) / width_; }

std::pair<Vector2d, double> MouthSections::expected(double way) const {
  const Vector2d left = inSection(hints_.corner_left);
  const Vector2d middle = 0.5 * (inSection(hints_.upper) + inSection(hints_.lower));
  const double inside = std::clamp(way, 0.0, 1.0), bow = 4 * inside * (1 - inside);
  const double half = 0.5 * (inSection(hints_.upper) - inSection(hints_.lower)).norm();
  return {way * left + bow * (middle - 0.5 * left), half * (0.3 + 0.7 * bow)};
}

MouthSections::Plane MouthSections::cut(double way) const {
  Plane plane;
  std::unordered_map<EdgeCut, std::uint32_t, EdgeCutHash> number;
  for (std::uint32_t t = 0; t < region_.size(); ++t) {
    const std::array<double, 3>& ways = ways_[t];
    const bool above[3] = {ways[0] >= way, ways[1] >= way, ways[2] >= way};
    if (above[0] == above[1] && above[1] == above[2]) continue;
    Plane::Piece piece{t, {}, {}};
    std::size_t count = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t next = (k + 1) % 3;
      if (above[k] == above[next]) continue;
      std::uint32_t low = places_[t][k], high = places_[t][next];
      piece.edges[count] = {region_[t][k], region_[t][next]};
      if (low > high) std::swap(low, high);
      const auto [at, is_new] = number.try_emplace({low, high}, static_cast<std::uint32_t>(plane.nodes.size()));
      if (is_new) {
        const double a = way_.at(low), b = way_.at(high);
        const Vector3d from = pointAt(vertices_, low), to = pointAt(vertices_, high);
        plane.nodes.push_back({inSection(from + (way - a) / (b - a) * (to - from)), {}});
      }
      plane.nodes[at->second].pieces.push_back(static_cast<std::uint32_t>(plane.pieces.size()));
      piece.nodes[count++] = at->second;
    }
    plane.pieces.push_back(piece);
  }
  return plane;
}

/// The foremost piece at a height, near a depth.
std::optional<std::uint32_t> MouthSections::frontAt(const Plane& plane, const Vector2d& near) {
  std::optional<std::uint32_t> front;
  double most = near.x() - 0.5, limit = near.x() + 0.5;
  for (std::uint32_t i = 0; i < plane.pieces.size(); ++i) {
    const Vector2d &a = plane.nodes[plane.pieces[i].nodes[0]].at, &b = plane.nodes[plane.pieces[i].nodes[1]].at;
    if ((a.y() >= near.y()) == (b.y() >= near.y())) continue;
    const double depth = a.x() + (near.y() - a.y()) / (b.y() - a.y()) * (b.x() - a.x());
    if (depth <= most || depth > limit) continue;
    most = depth;
    front = i;
  }
  return front;
}

/// The piece beyond a node; `joins`: no edge of the mesh joins the two.
std::optional<std::uint32_t> MouthSections::beyond(const Plane& plane, std::uint32_t from, std::size_t end,
                                                   bool& joins) const {
  const Plane::Piece& piece = plane.pieces[from];
  const std::array<std::uint32_t, 2>& edge = piece.edges[end];
  std::optional<std::uint32_t> touching;
  for (const std::uint32_t other : plane.nodes[piece.nodes[end]].pieces) {
    if (other == from) continue;
    const Plane::Piece& next = plane.pieces[other];
    const std::size_t its_end = next.nodes[0] == piece.nodes[end] ? 0 : 1;
    const std::array<std::uint32_t, 2>& its_edge = next.edges[its_end];
    if (std::minmax(edge[0], edge[1]) == std::minmax(its_edge[0], its_edge[1])) {
      joins = false;
      return other;
    }
    // Two triangles on one side of an edge are no surface.
    if (place_.at(edge[0]) == place_.at(its_edge[1])) touching = other;
  }
  joins = touching.has_value();
  return touching;
}

/// From the middle of a piece over its node `end`; until the surface ends, `goal` is reached or far enough.
Outline MouthSections::follow(const Plane& plane, std::uint32_t start, std::size_t end,
                              std::optional<std::uint32_t> goal, double longest) const {
  Outline outline;
  const auto& first = plane.pieces[start];
  const Vector2d from = 0.5 * (plane.nodes[first.nodes[0]].at + plane.nodes[first.nodes[1]].at);
  outline.points.push_back({from, first.edges[1 - end][0], first.edges[1 - end][1], 0});
  std::uint32_t piece = start;
  while (true) {
    const Plane::Node& node = plane.nodes[plane.pieces[piece].nodes[end]];
    const double way = outline.points.back().way + (node.at - outline.points.back().at).norm();
    const auto& edge = plane.pieces[piece].edges[end];
    outline.points.push_back({node.at, edge[0], edge[1], way});
    if (way > longest || outline.points.size() > plane.pieces.size() + 2) break;
    bool joins = false;
    const auto next = beyond(plane, piece, end, joins);
    if (!next || *next == start) break;
    if (joins) outline.joins.push_back(way);
    end = plane.pieces[*next].nodes[0] == plane.pieces[piece].nodes[end] ? 1 : 0;
    piece = *next;
    if (goal && piece == *goal) {
      outline.joined = way;
      break;
    }
  }
  return outline;
}

/// The way of the two that a piece offers which is lower (`sign` -1) or higher (1) a little further on.
Outline MouthSections::followTowards(const Plane& plane, std::uint32_t start, double sign,
                                     std::optional<std::uint32_t> goal, double longest) const {
  const auto heightAhead = [&](std::size_t end) {
    const Outline ahead = follow(plane, start, end, goal, kAhead);
    return ahead.points.back().at.y();
  };
  const std::size_t end = sign * heightAhead(0) > sign * heightAhead(1) ? 0 : 1;
  return follow(plane, start, end, goal, longest);
}

std::optional<MouthSections::Outlines> MouthSections::outlinesAt(double way) const {
  const Plane plane = cut(way + kOffMiddle);
  const auto [middle, half] = expected(way);
  const auto above = frontAt(plane, middle + Vector2d(0, half + kBeyondRed));
  const auto below = frontAt(plane, middle - Vector2d(0, half + kBeyondRed));
  if (!above || !below || *above == *below) return std::nullopt;
  Outlines outlines{followTowards(plane, *above, -1, below, 6 * kOutline),
                    followTowards(plane, *below, 1, above, 6 * kOutline)};
  // A way that leads to the other start only one way round is one way all the same.
  if (outlines.upper.joined.has_value() != outlines.lower.joined.has_value()) {
    const double joined = outlines.upper.joined.value_or(outlines.lower.joined.value_or(0));
    outlines.upper.joined = outlines.lower.joined = joined;
  }
  resample(outlines.upper);
  resample(outlines.lower);
  return outlines;
}

}  // namespace mouthpiece
