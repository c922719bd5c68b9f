#include "deform/topology/welding.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <bit>
#include <boost/functional/hash.hpp>
#include <boost/iterator/counting_iterator.hpp>
#include <boost/pending/disjoint_sets.hpp>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>

#include "deform/mesh/face_mesh.h"

namespace mouthpiece {
namespace {

using Eigen::Vector3d;
using Place = std::array<float, 3>;

/// Directions around an edge that are nearer than this are one: lips that touch, or cross a little, not a thin solid.
constexpr double kSameDirection = 0.5;
/// More triangles than this at an edge are no surface and stay apart.
constexpr std::size_t kMostAtOneEdge = 64;

/// A triangle's edge, from `from` to `to` as the triangle goes round.
struct HalfEdge {
  std::uint32_t from, to, across;  ///< `across`: the triangle's third vertex
  std::uint32_t part;
};

/// Which border edges may be sewn to each other.
enum class Sewn { kAll, kBetweenParts };

/// Edges in one place, by the places of their ends, the lesser first.
using EdgePlaces = std::map<std::pair<Place, Place>, std::vector<HalfEdge>>;

class Sewing {
 public:
  Sewing(const FaceMesh& mesh, Sewn sewn) : mesh_(mesh), sewn_(sewn), sets_(mesh.vertexCount()) {}

  void sewAll(const EdgePlaces& places) {
    for (const auto& [ends, edges] : places) {
      if (edges.size() <= kMostAtOneEdge) sew(ends, edges);
    }
    // From now on each set is called by the least of its vertices.
    const boost::counting_iterator<std::size_t> first(0), last(mesh_.vertexCount());
    sets_.normalize_sets(first, last);
  }

  std::size_t rootOf(std::uint32_t v) { return sets_.find_set(v); }

  [[nodiscard]] Place placeOf(std::uint32_t v) const {
    return {mesh_.vertices(v, 0), mesh_.vertices(v, 1), mesh_.vertices(v, 2)};
  }

 private:
  using Ends = std::pair<Place, Place>;
  [[nodiscard]] std::vector<double> anglesOf(const Ends& ends, const std::vector<HalfEdge>& edges) const {
    const Vector3d origin(ends.first[0], ends.first[1], ends.first[2]);
    const Vector3d axis = (Vector3d(ends.second[0], ends.second[1], ends.second[2]) - origin).normalized();
    const Vector3d x = axis.unitOrthogonal(), y = axis.cross(x);
    std::vector<double> angles;
    for (const HalfEdge& edge : edges) {
      const Vector3d way = pointAt(mesh_.vertices, edge.across) - origin;
      angles.push_back(std::atan2(way.dot(y), way.dot(x)));
    }
    return angles;
  }

  /// From a triangle through the solid behind it to another that goes the other way along the edge.
  static double turnBetween(double from, double to) {
    const double turn = std::fmod(from - to + 4 * std::numbers::pi, 2 * std::numbers::pi);
    return turn < kSameDirection ? turn + 2 * std::numbers::pi : turn;
  }

  /// Each edge to one that goes the other way: to the other side of the solid behind it, the next one that way round.
  void sew(const Ends& ends, const std::vector<HalfEdge>& edges) {
    const std::vector<double> angles = anglesOf(ends, edges);
    std::vector<bool> is_taken(edges.size(), false);
    for (std::size_t e = 0; e < edges.size(); ++e) {
      if (placeOf(edges[e].from) != ends.first) continue;
      double least = std::numeric_limits<double>::infinity();
      std::size_t other = edges.size();
      for (std::size_t i = 0; i < edges.size(); ++i) {
        if (is_taken[i] || placeOf(edges[i].from) == ends.first) continue;
        if (sewn_ == Sewn::kBetweenParts && edges[i].part == edges[e].part) continue;
        const double turn = turnBetween(angles[e], angles[i]);
        if (turn >= least) continue;
        least = turn;
        other = i;
      }
      if (other == edges.size()) continue;
      is_taken[other] = true;
      sets_.union_set(edges[e].from, edges[other].to);
      sets_.union_set(edges[e].to, edges[other].from);
    }
  }

  const FaceMesh& mesh_;
  Sewn sewn_;
  boost::disjoint_sets_with_storage<> sets_;
};

/// Edges that one triangle alone has, by vertex number, of parts that may be sewn; `edge_count`: all edges.
std::vector<HalfEdge> borderEdges(const FaceMesh& mesh, std::size_t& edge_count) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> uses;
  for (const Triangle& t : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) ++uses[std::minmax(t[k], t[(k + 1) % 3])];
  }
  edge_count = uses.size();
  std::vector<HalfEdge> border;
  for (std::uint32_t part = 0; part < mesh.parts.size(); ++part) {
    for (const Triangle& t : trianglesOf(mesh, mesh.parts[part])) {
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t from = t[k], to = t[(k + 1) % 3];
        if (uses[std::minmax(from, to)] == 1) border.push_back({from, to, t[(k + 2) % 3], part});
      }
    }
  }
  return border;
}

/// Whether two parts, neither of them hair rooted in the other, have vertices of their own in one place.
bool partsMeet(const FaceMesh& mesh) {
  if (mesh.parts.size() < 2) return false;
  constexpr std::uint32_t kNobody = ~0U;
  std::vector<std::uint32_t> part_of(mesh.vertexCount(), kNobody);
  // The first vertex at each place, at its hash or where the next ones are free.
  std::vector<std::uint32_t> first_at(std::bit_ceil(2 * mesh.vertexCount()), kNobody);
  const auto placeOf = [&](std::uint32_t v) -> Place {
    return {mesh.vertices(v, 0), mesh.vertices(v, 1), mesh.vertices(v, 2)};
  };
  for (std::uint32_t part = 0; part < mesh.parts.size(); ++part) {
    if (mesh.parts[part].stands_off) continue;
    for (const Triangle& triangle : trianglesOf(mesh, mesh.parts[part])) {
      for (const std::uint32_t v : triangle) {
        if (part_of[v] != kNobody) continue;
        part_of[v] = part;
        const Place place = placeOf(v);
        std::size_t slot = boost::hash<Place>()(place) & (first_at.size() - 1);
        while (first_at[slot] != kNobody && placeOf(first_at[slot]) != place) slot = (slot + 1) & (first_at.size() - 1);
        if (first_at[slot] == kNobody) first_at[slot] = v;
        if (part_of[first_at[slot]] != part) return true;
      }
    }
  }
  return false;
}

}  // namespace

VertexPositions Welding::weldedFromGiven(const VertexPositions& given) const { return given(given_of, Eigen::all); }

void Welding::givenFromWelded(const VertexPositions& welded, VertexPositions& given) const {
  given.resize(signedIndex(welded_of.size()), 3);
  for (std::size_t v = 0; v < welded_of.size(); ++v) given.row(signedIndex(v)) = welded.row(welded_of[v]);
}

Welding weldSplitTriangles(const FaceMesh& mesh) {
  // A surface has half as many vertices as triangles, apart from its seams; one in pieces more than triangles.
  const bool may_be_torn = mesh.vertexCount() >= mesh.triangles.size();
  if (!may_be_torn && !partsMeet(mesh)) return {};
  std::size_t edge_count = 0;
  const std::vector<HalfEdge> border = borderEdges(mesh, edge_count);
  const Sewn sewn = may_be_torn && 2 * border.size() >= edge_count ? Sewn::kAll : Sewn::kBetweenParts;
  Sewing sewing(mesh, sewn);
  EdgePlaces places;
  for (const HalfEdge& edge : border) {
    if (sewn == Sewn::kBetweenParts && mesh.parts[edge.part].stands_off) continue;
    const Place from = sewing.placeOf(edge.from), to = sewing.placeOf(edge.to);
    if (from != to) places[std::minmax(from, to)].push_back(edge);
  }
  sewing.sewAll(places);
  Welding welding;
  welding.welded_of.resize(mesh.vertexCount());
  constexpr std::uint32_t kNone = ~0U;
  std::vector<std::uint32_t> number_of(mesh.vertexCount(), kNone);  // by root: a set is called by its first vertex
  for (std::uint32_t v = 0; v < welding.welded_of.size(); ++v) {
    std::uint32_t& number = number_of[sewing.rootOf(v)];
    if (number == kNone) {
      number = static_cast<std::uint32_t>(welding.given_of.size());
      welding.given_of.push_back(v);
    }
    welding.welded_of[v] = number;
  }
  if (welding.given_of.size() == welding.welded_of.size()) return {};
  welding.mesh.vertices = welding.weldedFromGiven(mesh.vertices);
  welding.mesh.triangles = mesh.triangles;
  for (Triangle& triangle : welding.mesh.triangles) {
    for (std::uint32_t& v : triangle) v = welding.welded_of[v];
  }
  welding.mesh.parts = mesh.parts;
  welding.mesh.metres_per_unit = mesh.metres_per_unit;
  return welding;
}

}  // namespace mouthpiece
