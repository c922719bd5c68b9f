#include "heads/coarse_heads.h"

#include <CGAL/Polygon_mesh_processing/connected_components.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/Bounded_normal_change_filter.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/Count_stop_predicate.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/LindstromTurk_cost.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/LindstromTurk_placement.h>
#include <CGAL/Surface_mesh_simplification/edge_collapse.h>
#include <CGAL/boost/graph/Euler_operations.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <queue>

#include "deform/topology/head_topology.h"
#include "heads/head_changes.h"
#include "retarget/placing/anchors.h"

namespace mouthpiece::test {
namespace {

namespace pmp = CGAL::Polygon_mesh_processing;
namespace sms = CGAL::Surface_mesh_simplification;
using Eigen::Vector3d;
using Vertex = SkinSurface::Vertex_index;
using IsRim = SkinSurface::Property_map<SkinSurface::Edge_index, bool>;

constexpr double kRestsOpenMm = 0.5;
constexpr std::size_t kLeastRimEdges = 6;
constexpr double kFinerAtMouth = 3000;  ///< times what a collapse costs elsewhere
constexpr double kMouthReach = 0.55;    ///< mouth widths from its middle where cost has fallen to 0.61 of that

Vector3d placeOf(const SkinSurface& surface, Vertex v) {
  const auto& p = surface.point(v);
  return {p.x(), p.y(), p.z()};
}

bool isOnRim(const SkinSurface& surface, const IsRim& is_rim, Vertex v) {
  for (const auto h : surface.halfedges_around_target(surface.halfedge(v))) {
    if (is_rim[surface.edge(h)]) return true;
  }
  return false;
}

/// Rims stay as they are; all else goes where the surface changes least.
struct KeepingRims : sms::LindstromTurk_placement<SkinSurface> {
  IsRim is_rim;
  template <typename Profile>
  boost::optional<typename Profile::Point> operator()(const Profile& edge) const {
    const bool first = isOnRim(edge.surface_mesh(), is_rim, edge.v0()),
               second = isOnRim(edge.surface_mesh(), is_rim, edge.v1());
    if (first && second) return boost::none;
    if (first) return edge.p0();
    if (second) return edge.p1();
    return sms::LindstromTurk_placement<SkinSurface>::operator()(edge);
  }
};

struct FinerAtMouth : sms::LindstromTurk_cost<SkinSurface> {
  Vector3d mouth;
  double reach = 1;
  template <typename Profile>
  boost::optional<double> operator()(const Profile& edge,
                                     const boost::optional<typename Profile::Point>& placement) const {
    const auto cost = sms::LindstromTurk_cost<SkinSurface>::operator()(edge, placement);
    if (!cost) return cost;
    const Vector3d off = Vector3d(edge.p0().x(), edge.p0().y(), edge.p0().z()) - mouth;
    return *cost * (1 + kFinerAtMouth * std::exp(-0.5 * off.squaredNorm() / (reach * reach)));
  }
};

/// The vertices of one lip's rim, corner to corner, and where they shall be.
struct Rim {
  std::vector<std::uint32_t> vertices;
  std::vector<Vector3d> places;
};

/// Places on a rim at even ways across the mouth; the ends are the corners.
std::vector<Vector3d> evenPlaces(const std::vector<Vector3d>& rim, const Vector3d& right, const Vector3d& left,
                                 std::size_t edges) {
  std::vector<Vector3d> line{right};
  line.insert(line.end(), rim.begin(), rim.end());
  line.push_back(left);
  std::vector<double> way{0};
  for (std::size_t i = 1; i < line.size(); ++i) way.push_back(way.back() + (line[i] - line[i - 1]).norm());
  std::vector<Vector3d> places;
  for (std::size_t k = 0; k <= edges; ++k) {
    const double wanted = way.back() * asReal(k) / asReal(edges);
    const auto next = std::clamp<std::ptrdiff_t>(std::lower_bound(way.begin(), way.end(), wanted) - way.begin(), 1,
                                                 static_cast<std::ptrdiff_t>(way.size()) - 1);
    const auto i = static_cast<std::size_t>(next);
    const double share = (wanted - way[i - 1]) / std::max(way[i] - way[i - 1], 1e-12);
    places.emplace_back(line[i - 1] + share * (line[i] - line[i - 1]));
  }
  return places;
}

/// For each place the nearest vertex that `may` be it, none twice; empty where there are too few.
std::vector<std::uint32_t> verticesAt(const FaceMesh& mesh, const std::vector<Vector3d>& places,
                                      std::vector<bool>& may) {
  std::vector<std::uint32_t> found;
  for (const Vector3d& place : places) {
    double nearest = std::numeric_limits<double>::infinity();
    std::uint32_t at = 0;
    for (std::uint32_t v = 0; v < may.size(); ++v) {
      const double off = may[v] ? (pointAt(mesh.vertices, v) - place).norm() : nearest;
      if (off >= nearest) continue;
      nearest = off;
      at = v;
    }
    if (!std::isfinite(nearest)) return {};
    may[at] = false;
    found.push_back(at);
  }
  return found;
}

/// Both rims, the corners in both; nullopt where the lips are one surface.
std::optional<std::array<Rim, 2>> rimsOf(const ClickedHead& head, const HeadTopology& topology, std::size_t edges) {
  const std::optional<LipLine>& line = topology.lipLine();
  if (!line || !line->is_parted) return std::nullopt;
  std::array<Rim, 2> rims;
  for (std::size_t lip = 0; lip < 2; ++lip)
    rims[lip].places = evenPlaces(lip == 0 ? line->upper : line->lower, line->corner_right, line->corner_left, edges);
  const double closed = kRestsOpenMm / head.mm_per_unit;
  for (std::size_t k = 0; k <= edges; ++k) {
    if ((rims[0].places[k] - rims[1].places[k]).norm() >= closed) continue;
    rims[0].places[k] = rims[1].places[k] = 0.5 * (rims[0].places[k] + rims[1].places[k]);
  }
  std::vector<bool> any(head.mesh.vertexCount());
  for (std::size_t v = 0; v < any.size(); ++v) any[v] = std::isfinite(topology.wayToUpperLip()[v]);
  const std::vector<std::uint32_t> corners =
      verticesAt(head.mesh, {rims[0].places.front(), rims[0].places.back()}, any);
  if (corners.empty()) return std::nullopt;
  for (std::size_t lip = 0; lip < 2; ++lip) {
    std::vector<bool> may = any;
    for (std::size_t v = 0; v < may.size(); ++v) may[v] = may[v] && (topology.lowerShare(v) < 0.5) == (lip == 0);
    const auto inner = verticesAt(head.mesh, {rims[lip].places.begin() + 1, rims[lip].places.end() - 1}, may);
    if (inner.empty()) return std::nullopt;
    rims[lip].vertices = {corners[0]};
    rims[lip].vertices.insert(rims[lip].vertices.end(), inner.begin(), inner.end());
    rims[lip].vertices.push_back(corners[1]);
  }
  return rims;
}

/// Halfedges from `from` to `to`, the shorter the nearer they keep to the straight line between them; only over
/// vertices that may be passed. Empty: no way.
std::vector<SkinSurface::Halfedge_index> wayBetween(const SkinSurface& surface, Vertex from, Vertex to,
                                                    const std::vector<bool>& may_pass) {
  const Vector3d start = placeOf(surface, from), along = placeOf(surface, to) - start;
  const auto off = [&](Vertex v) {
    const Vector3d p = placeOf(surface, v) - start;
    return (p - std::clamp(p.dot(along) / along.squaredNorm(), 0.0, 1.0) * along).norm() / along.norm();
  };
  std::map<Vertex, std::pair<double, SkinSurface::Halfedge_index>> best;
  using Entry = std::pair<double, Vertex>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  best[from] = {0, {}};
  queue.emplace(0.0, from);
  while (!queue.empty()) {
    const auto [way, v] = queue.top();
    queue.pop();
    if (v == to) break;
    if (way > best.at(v).first) continue;
    for (const auto arriving : surface.halfedges_around_target(surface.halfedge(v))) {
      const auto h = surface.opposite(arriving);
      const Vertex next = surface.target(h);
      if (next != to && !may_pass[next.idx()]) continue;
      const double length = (placeOf(surface, next) - placeOf(surface, v)).norm();
      const double further = way + length * (1 + 4 * off(next));
      const auto [at, is_new] = best.try_emplace(next, further, h);
      if (!is_new && at->second.first <= further) continue;
      at->second = {further, h};
      queue.emplace(further, next);
    }
  }
  std::vector<SkinSurface::Halfedge_index> way;
  for (Vertex v = to; v != from; v = surface.source(way.back())) {
    const auto at = best.find(v);
    if (at == best.end()) return {};
    way.push_back(at->second.second);
  }
  std::reverse(way.begin(), way.end());
  return way;
}

/// Draws rims on a surface whose vertices are numbered as those of a mesh.
class RimDrawing {
 public:
  RimDrawing(SkinSurface& surface, std::vector<bool> may_pass)
      : is_rim(surface.add_property_map<SkinSurface::Edge_index, bool>("e:rim", false).first),
        surface_(surface),
        may_pass_(std::move(may_pass)) {
    for (std::size_t v = 0; v < may_pass_.size(); ++v) now_.emplace_back(static_cast<std::uint32_t>(v));
  }

  /// Between its vertices a rim has one edge each, or the few that the surface allows. False where no way leads on.
  bool draw(const Rim& rim) {
    for (const std::uint32_t v : rim.vertices) may_pass_[v] = false;
    for (std::size_t k = 0; k + 1 < rim.vertices.size(); ++k) {
      if (!join(rim.vertices[k], rim.vertices[k + 1])) return false;
    }
    for (std::size_t k = 0; k < rim.vertices.size(); ++k) {
      const Vector3d& p = rim.places[k];
      surface_.point(now_[rim.vertices[k]]) = {p.x(), p.y(), p.z()};
    }
    return true;
  }

  IsRim is_rim;

 private:
  bool join(std::uint32_t from, std::uint32_t to) {
    std::vector<SkinSurface::Halfedge_index> way = wayBetween(surface_, now_[from], now_[to], may_pass_);
    if (way.empty()) return false;
    for (std::size_t i = 0; i + 1 < way.size(); ++i) {
      const Vertex first = surface_.source(way[i]), middle = surface_.target(way[i]),
                   next = surface_.target(way[i + 1]);
      may_pass_[middle.idx()] = false;
      if (!CGAL::Euler::does_satisfy_link_condition(surface_.edge(way[i]), surface_)) {
        is_rim[surface_.edge(way[i])] = true;
        continue;
      }
      const auto place = surface_.point(first);
      const Vertex kept = CGAL::Euler::collapse_edge(surface_.edge(way[i]), surface_, is_rim);
      surface_.point(kept) = place;
      for (Vertex& v : now_) {
        if (v == first) v = kept;
      }
      may_pass_[kept.idx()] = false;
      way[i + 1] = surface_.halfedge(kept, next);
      if (!way[i + 1].is_valid()) return false;
    }
    is_rim[surface_.edge(way.back())] = true;
    return true;
  }

  SkinSurface& surface_;
  std::vector<bool> may_pass_;
  std::vector<Vertex> now_;  ///< what a vertex has become
};

/// Only what hangs together with the face stays; `has_bag`: what is behind the rims, too.
void keepFace(SkinSurface& surface, const IsRim& is_rim, const Vector3d& on_face, bool has_bag) {
  const auto dropAllBut = [&](bool rims_part) {
    auto piece = surface.add_property_map<SkinSurface::Face_index, std::size_t>("f:piece", 0).first;
    const IsRim parts =
        rims_part ? is_rim : surface.add_property_map<SkinSurface::Edge_index, bool>("e:none", false).first;
    pmp::connected_components(surface, piece, CGAL::parameters::edge_is_constrained_map(parts));
    double nearest = std::numeric_limits<double>::infinity();
    std::size_t face = 0;
    for (const auto f : surface.faces()) {
      const double off = (placeOf(surface, surface.target(surface.halfedge(f))) - on_face).norm();
      if (off >= nearest) continue;
      nearest = off;
      face = piece[f];
    }
    pmp::keep_connected_components(surface, std::vector<std::size_t>{face}, piece);
  };
  dropAllBut(false);
  if (!has_bag) dropAllBut(true);
}

/// `head` has its skin alone.
void dropAllButSkin(FaceMesh& mesh) {
  std::vector<Triangle> triangles = trianglesOf(mesh, {PartKind::kSkin, PartKind::kLips, PartKind::kMouthInside});
  mesh.parts = {{.name = "skin", .kind = PartKind::kSkin, .triangle_count = triangles.size()}};
  mesh.triangles = std::move(triangles);
}

}  // namespace

std::optional<ClickedHead> coarsened(const ClickedHead& head, const CoarseHead& as) {
  ClickedHead made = head;
  dropAllButSkin(made.mesh);
  const HeadTopology topology(made.mesh, openingsOf(made.mesh, made.clicks, "clicks"));
  const auto rims = rimsOf(made, topology, as.rim_edges);
  if (!rims) return std::nullopt;
  const Vector3d mouth = 0.5 * (clickOf(head, "LIP_UP_MID") + clickOf(head, "LIP_LO_MID"));
  bool is_drawn = true;
  changeSkin(made, [&](SkinSurface& surface) {
    std::vector<bool> may_pass(surface.number_of_vertices());
    for (std::size_t v = 0; v < may_pass.size(); ++v)
      may_pass[v] = v < made.mesh.vertexCount() && std::isfinite(topology.wayToUpperLip()[v]);
    RimDrawing drawing(surface, may_pass);
    is_drawn = drawing.draw((*rims)[0]) && drawing.draw((*rims)[1]);
    if (!is_drawn) return;
    keepFace(surface, drawing.is_rim, clickOf(head, "NOSE_TIP"), as.has_bag);
    KeepingRims placement;
    placement.is_rim = drawing.is_rim;
    FinerAtMouth cost;
    cost.mouth = mouth;
    cost.reach = kMouthReach * kMouthMm / head.mm_per_unit;
    // A closed surface has half as many faces more than edges: 3 edges of 2 faces each.
    sms::edge_collapse(surface, sms::Count_stop_predicate<SkinSurface>(as.faces * 3 / 2),
                       CGAL::parameters::edge_is_constrained_map(drawing.is_rim)
                           .get_cost(cost)
                           .get_placement(placement)
                           .filter(sms::Bounded_normal_change_filter<>()));
  });
  if (!is_drawn) return std::nullopt;
  made.changes += fmt::format(", {} faces, {} edges a rim{}", made.mesh.triangles.size(), as.rim_edges,
                              as.has_bag ? "" : ", a hole for a mouth");
  return made;
}

std::optional<ClickedHead> coarseHead(const ClickedHead& head, unsigned seed) {
  Chance chance(seed);
  ClickedHead made = head;
  shape(made, chance);
  setScale(made);
  const std::array<std::size_t, 3> faces{500, 1000, 2000};
  const auto most_edges = static_cast<std::size_t>(chance.number(7, 16));
  CoarseHead as{.faces = faces[seed % faces.size()], .rim_edges = most_edges, .has_bag = !chance.happens(1.0 / 3)};
  // A head may have no more vertices itself.
  std::optional<ClickedHead> coarse;
  for (; !coarse && as.rim_edges >= kLeastRimEdges; --as.rim_edges) coarse = coarsened(made, as);
  if (!coarse) return coarse;
  coarse->name = fmt::format("{} coarse {}", head.name, seed);
  jitter(*coarse, chance);
  return coarse;
}

}  // namespace mouthpiece::test
