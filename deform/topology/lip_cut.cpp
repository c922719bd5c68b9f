#include "deform/topology/lip_cut.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <queue>
#include <set>

#include "base/errors.h"
#include "deform/topology/skin_layers.h"
#include "deform/topology/welding.h"

namespace mouthpiece {
namespace {

using Eigen::Vector3d;

// Lengths as shares of the mouth's width.
constexpr double kBeside = 0.02;    ///< a way this far beside the line costs double
constexpr double kFarthest = 0.2;   ///< and none leads further off
constexpr double kLoopOff = 0.2;    ///< a hole's edge lies no further from the line, on average
constexpr double kLoopWide = 0.5;   ///< and is no narrower
constexpr double kSkinThick = 0.1;  ///< a bag lies so far behind the skin
constexpr double kNarrowing = 0.2;  ///< or comes nearer to its middle by such steps of its own width and height

/// Rows of a bag from the upper rim to the lower one: how far back and up they lie, in shares of the mouth's width, and
/// of the way from the upper rim to the lower one. Teeth and a tongue have room in it.
struct BagRow {
  double back, up, lower;
};
constexpr std::array kBag{BagRow{0.08, 0.03, 0},  BagRow{0.12, 0.2, 0},  BagRow{0.25, 0.36, 0}, BagRow{0.7, 0.36, 0.1},
                          BagRow{1, 0.2, 0.3},    BagRow{1.1, 0, 0.5},   BagRow{1, -0.2, 0.7},  BagRow{0.7, -0.36, 0.9},
                          BagRow{0.25, -0.36, 1}, BagRow{0.12, -0.2, 1}, BagRow{0.08, -0.03, 1}};

/// Nearest place on an open line.
Vector3d nearestOn(const std::vector<Vector3d>& line, const Vector3d& p) {
  Vector3d nearest = line.front();
  for (std::size_t i = 0; i + 1 < line.size(); ++i) {
    const Vector3d ab = line[i + 1] - line[i];
    const double way = std::clamp((p - line[i]).dot(ab) / std::max(ab.squaredNorm(), 1e-300), 0.0, 1.0);
    const Vector3d place = line[i] + way * ab;
    if ((place - p).norm() < (nearest - p).norm()) nearest = place;
  }
  return nearest;
}

/// A vertex that looks like `like`.
std::uint32_t addVertex(GrownMesh& cut, const Vector3d& place, std::uint32_t like) {
  FaceMesh& mesh = cut.mesh;
  cut.parents.push_back(like);
  const auto number = static_cast<std::uint32_t>(mesh.vertexCount());
  mesh.vertices.conservativeResize(number + 1, Eigen::NoChange);
  mesh.vertices.row(number) = place.transpose().cast<float>();
  if (!mesh.texture_coordinates.empty()) mesh.texture_coordinates.push_back(mesh.texture_coordinates[like]);
  if (!mesh.vertex_colors.empty()) mesh.vertex_colors.push_back(mesh.vertex_colors[like]);
  return number;
}

/// Joins two rims, both from the right corner to the left one, by a part of its own that faces into the mouth.
void addBag(GrownMesh& cut, const std::vector<std::uint32_t>& upper, const std::vector<std::uint32_t>& lower) {
  FaceMesh& mesh = cut.mesh;
  const SkinLayers skin(mesh.vertices, trianglesOf(mesh, {PartKind::kSkin, PartKind::kLips}));
  Vector3d across = pointAt(mesh.vertices, upper.back()) - pointAt(mesh.vertices, upper.front());
  const double width = across.norm();
  across /= width;
  const Vector3d up = (Vector3d::UnitY() - across.y() * across).normalized(), back = -across.cross(up);
  const auto wayOf = [](const std::vector<std::uint32_t>& row, std::size_t i) {
    return asReal(i) / asReal(row.size() - 1);
  };
  const auto onLower = [&](double way) -> Vector3d {
    const double place = way * asReal(lower.size() - 1);
    const std::size_t i = std::min(unsignedIndex(wholePart(place)), lower.size() - 2);
    const double share = place - asReal(i);
    return (1 - share) * pointAt(mesh.vertices, lower[i]) + share * pointAt(mesh.vertices, lower[i + 1]);
  };
  const Vector3d middle = 0.5 * (pointAt(mesh.vertices, upper.front()) + pointAt(mesh.vertices, upper.back()));
  // `low`: how high it should be, `high`: how high it may be where there is a hole in place of skin.
  const auto behindSkin = [&](const Vector3d& before, const Vector3d& rim, const Vector3d& deep, const Vector3d& low,
                              const Vector3d& high) -> Vector3d {
    const double thick = std::min(kSkinThick * width, deep.norm());
    const auto isBehind = [&](const Vector3d& place) {
      return skin.isBehind(place, thick) && skin.isBehind(0.5 * (before + place), 0.5 * thick);
    };
    Vector3d place = rim + deep + low;
    if (!low.isZero() && isBehind(place)) return place;
    place = rim + deep + high;
    for (double share = 1; share > 0 && !high.isZero() && !isBehind(place); share -= kNarrowing)
      place = rim + deep + share * high - (1 - share) * (rim - middle).dot(across) * across;
    return place;
  };
  std::vector<std::vector<std::uint32_t>> rows{upper};
  for (const BagRow& place : kBag) {
    auto& row = rows.emplace_back();
    for (std::size_t i = 0; i < upper.size(); ++i) {
      const double way = wayOf(upper, i);
      // Low at the corners: skin that comes down there less than the lip does would lie before the bag.
      const double bulge = std::max(0.0, std::sin(std::numbers::pi * way));
      const double deep = std::sqrt(bulge) * width;
      const bool is_corner = i == 0 || i + 1 == upper.size();
      const Vector3d rim = (1 - place.lower) * pointAt(mesh.vertices, upper[i]) + place.lower * onLower(way);
      row.push_back(is_corner ? upper[i]
                              : addVertex(cut,
                                          behindSkin(pointAt(mesh.vertices, rows[rows.size() - 2][i]), rim,
                                                     deep * place.back * back, bulge * width * place.up * up,
                                                     deep * place.up * up),
                                          upper[i]));
    }
  }
  rows.push_back(lower);
  MeshPart bag{.name = "mouth_inside", .kind = PartKind::kMouthInside, .first_triangle = mesh.triangles.size()};
  bag.base_color = {0.25F, 0.05F, 0.05F, 1.0F};
  const auto add = [&](const Triangle& t) {
    if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) mesh.triangles.push_back(t);
  };
  for (std::size_t r = 0; r + 1 < rows.size(); ++r) {
    const auto &here = rows[r], &next = rows[r + 1];
    for (std::size_t i = 0, j = 0; i + 1 < here.size() || j + 1 < next.size();) {
      const bool along_here = j + 1 == next.size() || (i + 1 < here.size() && wayOf(here, i + 1) <= wayOf(next, j + 1));
      if (along_here) {
        add({here[i + 1], here[i], next[j]});
        ++i;
      } else {
        add({here[i], next[j], next[j + 1]});
        ++j;
      }
    }
  }
  bag.triangle_count = mesh.triangles.size() - bag.first_triangle;
  mesh.parts.push_back(bag);
}

/// Which vertices count as one in an edge.
enum class OneIf { kTheSame, kInOnePlace };

/// The closed edges of the skin around a mouth, each once round with its own skin to the left.
std::vector<std::vector<std::uint32_t>> closedEdges(const FaceMesh& mesh, OneIf one_if) {
  std::map<std::array<float, 3>, std::uint32_t> first_at;
  std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
  for (Triangle t : trianglesOf(mesh, {PartKind::kSkin, PartKind::kLips, PartKind::kMouthInside})) {
    for (std::uint32_t& v : t) {
      if (one_if == OneIf::kInOnePlace)
        v = first_at.try_emplace({mesh.vertices(v, 0), mesh.vertices(v, 1), mesh.vertices(v, 2)}, v).first->second;
    }
    for (std::size_t k = 0; k < 3; ++k) edges.emplace(t[k], t[(k + 1) % 3]);
  }
  std::map<std::uint32_t, std::uint32_t> next;
  for (const auto& [a, b] : edges) {
    if (!edges.contains({b, a})) next[a] = b;
  }
  std::vector<std::vector<std::uint32_t>> loops;
  while (!next.empty()) {
    std::vector<std::uint32_t> loop;
    std::uint32_t last = 0;
    for (auto at = next.begin(); at != next.end(); at = next.find(last)) {
      loop.push_back(at->first);
      last = at->second;
      next.erase(at);
    }
    if (last == loop.front()) loops.push_back(std::move(loop));
  }
  return loops;
}

/// The one of `loops` that lies nearest to the line and is wide enough; empty where none is.
std::vector<std::uint32_t> aroundLine(const FaceMesh& mesh, const LipLine& line,
                                      const std::vector<std::vector<std::uint32_t>>& loops) {
  const Vector3d across = line.corner_left - line.corner_right;
  const double width = across.norm();
  std::vector<std::uint32_t> best;
  double nearest = kLoopOff * width;
  for (const std::vector<std::uint32_t>& loop : loops) {
    double off = 0, least = std::numeric_limits<double>::infinity(), most = -least;
    for (const std::uint32_t v : loop) {
      const Vector3d p = pointAt(mesh.vertices, v);
      off +=
          std::min((p - nearestOn(line.upper, p)).norm(), (p - nearestOn(line.lower, p)).norm()) / asReal(loop.size());
      least = std::min(least, p.dot(across) / width);
      most = std::max(most, p.dot(across) / width);
    }
    if (loop.size() < 6 || off >= nearest || most - least < kLoopWide * width) continue;
    nearest = off;
    best = loop;
  }
  return best;
}

/// The edge of the hole between the lips, right corner to left corner over either lip; empty where there is none.
/// Lips that touch have places in common, but no vertices; a seam of a texture that runs into the hole has both.
std::array<std::vector<std::uint32_t>, 2> holeBetween(const FaceMesh& mesh, const LipLine& line) {
  const Welding welding = weldSplitTriangles(mesh);
  const FaceMesh& whole = welding.isNothing() ? mesh : welding.mesh;
  std::vector<std::uint32_t> best = aroundLine(whole, line, closedEdges(whole, OneIf::kTheSame));
  if (best.empty()) best = aroundLine(whole, line, closedEdges(whole, OneIf::kInOnePlace));
  if (best.empty()) return {};
  const Vector3d across = line.corner_left - line.corner_right;
  const auto isRighter = [&](std::uint32_t a, std::uint32_t b) {
    return pointAt(whole.vertices, a).dot(across) < pointAt(whole.vertices, b).dot(across);
  };
  std::rotate(best.begin(), std::min_element(best.begin(), best.end(), isRighter), best.end());
  const auto left = std::max_element(best.begin(), best.end(), isRighter);
  // Its own skin to the left, the edge leads over the upper lip first.
  std::vector<std::uint32_t> upper(best.begin(), left + 1), lower(left, best.end());
  lower.push_back(best.front());
  std::reverse(lower.begin(), lower.end());
  if (!welding.isNothing()) {
    for (std::vector<std::uint32_t>* rim : {&upper, &lower}) {
      for (std::uint32_t& v : *rim) v = welding.given_of[v];
    }
  }
  return {upper, lower};
}

class Cutter {
 public:
  Cutter(const FaceMesh& mesh, const LipLine& line) : mesh_(mesh), line_(line.upper), out_{mesh, {}} {
    across_ = line.corner_left - line.corner_right;
    width_ = across_.norm();
    across_ /= width_;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      for (const std::uint32_t v : mesh.triangles[t]) {
        if ((pointAt(mesh.vertices, v) - nearestOn(line_, pointAt(mesh.vertices, v))).norm() < kFarthest * width_)
          near_.insert(v);
      }
    }
    for (const MeshPart& part : mesh.parts) {
      if (isSkin(part.kind)) {
        for (std::size_t t = part.first_triangle; t < part.first_triangle + part.triangle_count; ++t)
          skin_.push_back(t);
      }
    }
  }

  GrownMesh cut() {
    findPath();
    drawOntoLine();
    partLips();
    addBag(out_, path_, lower_);
    return std::move(out_);
  }

 private:
  [[nodiscard]] Vector3d at(std::uint32_t v) const { return pointAt(mesh_.vertices, v); }

  [[nodiscard]] std::uint32_t nearestVertex(const Vector3d& place) const {
    std::uint32_t best = 0;
    double least = std::numeric_limits<double>::infinity();
    for (const std::size_t t : skin_) {
      for (const std::uint32_t v : mesh_.triangles[t]) {
        const double distance = (at(v) - place).norm();
        if (distance >= least) continue;
        least = distance;
        best = v;
      }
    }
    return best;
  }

  /// Dijkstra's way from corner to corner along edges, dear away from the line.
  void findPath() {
    std::map<std::uint32_t, std::set<std::uint32_t>> joined;
    for (const std::size_t t : skin_) {
      const Triangle& triangle = mesh_.triangles[t];
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t a = triangle[k], b = triangle[(k + 1) % 3];
        if (!near_.contains(a) || !near_.contains(b)) continue;
        joined[a].insert(b);
        joined[b].insert(a);
      }
    }
    const std::uint32_t start = nearestVertex(line_.front()), goal = nearestVertex(line_.back());
    std::map<std::uint32_t, double> cost{{start, 0}};
    std::map<std::uint32_t, std::uint32_t> from;
    using Entry = std::pair<double, std::uint32_t>;
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
    queue.emplace(0.0, start);
    while (!queue.empty()) {
      const auto [so_far, v] = queue.top();
      queue.pop();
      if (v == goal) break;
      if (so_far > cost[v]) continue;
      for (const std::uint32_t next : joined[v]) {
        const Vector3d middle = 0.5 * (at(v) + at(next));
        const double beside = (middle - nearestOn(line_, middle)).norm() / (kBeside * width_);
        const double further = so_far + (at(v) - at(next)).norm() * (1 + beside * beside);
        const auto known = cost.find(next);
        if (known != cost.end() && known->second <= further) continue;
        cost[next] = further;
        from[next] = v;
        queue.emplace(further, next);
      }
    }
    if (!from.contains(goal) || start == goal)
      throw InputError("found no edges between the corners of the mouth; expected one surface of skin");
    for (std::uint32_t v = goal; v != start; v = from.at(v)) path_.push_back(v);
    path_.push_back(start);
    std::reverse(path_.begin(), path_.end());
    if (path_.size() < 4)
      throw InputError("found fewer than four vertices between the corners of the mouth; expected a finer mesh");
  }

  void drawOntoLine() {
    for (std::size_t i = 1; i + 1 < path_.size(); ++i) {
      const Vector3d place = nearestOn(line_, at(path_[i]));
      double shortest = std::numeric_limits<double>::infinity();
      for (const std::size_t n : {i - 1, i + 1}) shortest = std::min(shortest, (at(path_[i]) - at(path_[n])).norm());
      // A vertex that went further would turn its triangles over.
      const Vector3d move = place - at(path_[i]);
      const double share = std::min(1.0, 0.4 * shortest / std::max(move.norm(), 1e-300));
      out_.mesh.vertices.row(path_[i]) += (share * move).transpose().cast<float>();
    }
  }

  /// Triangles under the path get vertices of their own.
  void partLips() {
    std::set<std::pair<std::uint32_t, std::uint32_t>> along;
    for (std::size_t i = 0; i + 1 < path_.size(); ++i) along.emplace(path_[i], path_[i + 1]);
    std::set<std::uint32_t> inner(path_.begin() + 1, path_.end() - 1);
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::size_t> by_edge;
    std::vector<std::size_t> stack;
    for (const std::size_t t : skin_) {
      const Triangle& triangle = mesh_.triangles[t];
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t a = triangle[k], b = triangle[(k + 1) % 3];
        by_edge[{a, b}] = t;
        // Seen from outside the path leads to the right, and what lies under it has its edges the other way round.
        if (along.contains({b, a})) stack.push_back(t);
      }
    }
    std::set<std::size_t> lower(stack.begin(), stack.end());
    while (!stack.empty()) {
      const Triangle triangle = mesh_.triangles[stack.back()];
      stack.pop_back();
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t a = triangle[k], b = triangle[(k + 1) % 3];
        if (along.contains({a, b}) || along.contains({b, a}) || (!inner.contains(a) && !inner.contains(b))) continue;
        const auto beyond = by_edge.find({b, a});
        if (beyond != by_edge.end() && lower.insert(beyond->second).second) stack.push_back(beyond->second);
      }
    }
    std::map<std::uint32_t, std::uint32_t> doubles;
    for (const std::uint32_t v : path_)
      lower_.push_back(inner.contains(v) ? (doubles[v] = addVertex(out_, pointAt(out_.mesh.vertices, v), v)) : v);
    for (const std::size_t t : lower) {
      for (std::uint32_t& v : out_.mesh.triangles[t]) {
        if (const auto own = doubles.find(v); own != doubles.end()) v = own->second;
      }
    }
  }

  const FaceMesh& mesh_;
  const std::vector<Vector3d>& line_;
  GrownMesh out_;
  Vector3d across_;
  double width_ = 0;
  std::set<std::uint32_t> near_;
  std::vector<std::size_t> skin_;            ///< numbers of triangles
  std::vector<std::uint32_t> path_, lower_;  ///< the rims, right to left: upper (the mesh's own vertices), lower
};

}  // namespace

GrownMesh withMouthBag(const FaceMesh& mesh, const LipLine& line) {
  GrownMesh made{mesh, {}};
  const auto [upper, lower] = holeBetween(mesh, line);
  if (upper.size() > 2 && lower.size() > 2) addBag(made, upper, lower);
  return made;
}

GrownMesh cutLips(const FaceMesh& mesh, const LipLine& line) {
  if (line.is_parted) throw InputError("found lips that are apart already; expected lips in one surface");
  return Cutter(mesh, line).cut();
}

}  // namespace mouthpiece
