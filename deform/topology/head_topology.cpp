#include "deform/topology/head_topology.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <map>
#include <optional>
#include <queue>

#include "deform/mesh/face_mesh.h"

namespace mouthpiece {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

/// Which of two kinds a shared vertex has: the larger.
int rankOf(PartKind kind) {
  return kind == PartKind::kLips ? 3 : kind == PartKind::kSkin ? 2 : kind == PartKind::kMouthInside ? 1 : 0;
}

/// Vertices on an edge that one triangle alone has.
std::vector<bool> verticesAtEdges(const FaceMesh& mesh) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
  edges.reserve(3 * mesh.triangles.size());
  for (const Triangle& t : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) edges.push_back(std::minmax(t[k], t[(k + 1) % 3]));
  }
  std::sort(edges.begin(), edges.end());
  std::vector<bool> at_edge(mesh.vertexCount(), false);
  for (std::size_t i = 0; i < edges.size();) {
    const std::size_t first = i;
    while (i < edges.size() && edges[i] == edges[first]) ++i;
    if (i == first + 1) at_edge[edges[first].first] = at_edge[edges[first].second] = true;
  }
  return at_edge;
}

}  // namespace

std::vector<PartKind> vertexKinds(const FaceMesh& mesh) {
  std::vector<PartKind> kinds(mesh.vertexCount(), PartKind::kOther);
  std::vector<bool> seen(kinds.size(), false);
  for (const MeshPart& part : mesh.parts) {
    for (const Triangle& triangle : trianglesOf(mesh, part)) {
      for (const std::uint32_t v : triangle) {
        if (!seen[v] || rankOf(part.kind) > rankOf(kinds[v])) kinds[v] = part.kind;
        seen[v] = true;
      }
    }
  }
  return kinds;
}

double distanceToLine(const Eigen::Vector3d& p, const std::vector<Eigen::Vector3d>& line) {
  double nearest = kInfinite;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const Eigen::Vector3d& a = line[i];
    const Eigen::Vector3d ab = line[(i + 1) % line.size()] - a;
    const double way = std::clamp((p - a).dot(ab) / std::max(ab.squaredNorm(), 1e-300), 0.0, 1.0);
    nearest = std::min(nearest, (p - a - way * ab).norm());
  }
  return nearest;
}

/// What the mesh alone tells: kinds, places, edges, and which vertices stand in one place.
struct HeadTopology::Net {
  struct Link {
    std::uint32_t to;
    float length;
    bool is_double;  ///< to a vertex in the same place, which no edge joins
  };
  std::vector<PartKind> kinds;
  VertexPositions places;
  std::vector<Triangle> around_mouth;  ///< triangles of what lips may be
  std::vector<std::size_t> first;      ///< links of vertex i: [first[i], first[i + 1])
  std::vector<Link> links;

  explicit Net(const FaceMesh& mesh)
      : kinds(vertexKinds(mesh)),
        places(mesh.vertices),
        around_mouth(trianglesOf(mesh, {PartKind::kSkin, PartKind::kLips, PartKind::kMouthInside})) {
    std::vector<std::pair<std::uint32_t, Link>> all;
    const auto join = [&](std::uint32_t a, std::uint32_t b, bool is_double) {
      const float length = (places.row(a) - places.row(b)).norm();
      all.push_back({a, {b, length, is_double}});
      all.push_back({b, {a, length, is_double}});
    };
    for (const Triangle& triangle : mesh.triangles) {
      for (std::size_t k = 0; k < 3; ++k) join(triangle[k], triangle[(k + 1) % 3], false);
    }
    // Lashes and beards stay apart from the skin that they are rooted in.
    std::vector<bool> stands_off(kinds.size(), false);
    for (const MeshPart& part : mesh.parts) {
      for (const Triangle& triangle : trianglesOf(mesh, part)) {
        for (const std::uint32_t v : triangle) stands_off[v] = stands_off[v] || part.stands_off;
      }
    }
    // A seam runs where surfaces end. Two that go on through one place, each with what lies around it, only touch, as
    // closed lips do before a mouth bag.
    const std::vector<bool> is_at_edge = verticesAtEdges(mesh);
    std::map<std::array<float, 3>, std::array<std::optional<std::uint32_t>, 2>> first_at;  // at an edge, and within
    for (std::uint32_t v = 0; v < kinds.size(); ++v) {
      if (stands_off[v]) continue;
      auto& [at_edge, within] = first_at[{places(v, 0), places(v, 1), places(v, 2)}];
      if (at_edge) join(*at_edge, v, true);
      if (is_at_edge[v] && within && !at_edge) join(*within, v, true);
      auto& own = is_at_edge[v] ? at_edge : within;
      if (!own) own = v;
    }
    first.assign(kinds.size() + 1, 0);
    for (const auto& [from, link] : all) ++first[from + 1];
    for (std::size_t v = 0; v < kinds.size(); ++v) first[v + 1] += first[v];
    links.resize(all.size());
    std::vector<std::size_t> next(first.begin(), first.end() - 1);
    for (const auto& [from, link] : all) links[next[from]++] = link;
  }

  [[nodiscard]] std::span<const Link> linksOf(std::uint32_t v) const {
    return std::span(links).subspan(first[v], first[v + 1] - first[v]);
  }
};

HeadTopology::HeadTopology(const FaceMesh& mesh, const FaceOpenings& openings)
    : HeadTopology(std::make_shared<const Net>(mesh), openings) {}

HeadTopology HeadTopology::openedAt(const FaceOpenings& openings) const { return {net_, openings}; }

HeadTopology::HeadTopology(std::shared_ptr<const Net> net, const FaceOpenings& openings)
    : net_(std::move(net)), at_lips_(kinds().size()), forbidden_(kinds().size(), 0) {
  for (std::size_t v = 0; v < at_lips_.size(); ++v)
    at_lips_[v] = distanceToLine(pointAt(net_->places, v), openings.lip_line) < openings.lips_reach;
  findPieces();
  if (openings.mouth) lip_line_ = traceLipLine(net_->places, net_->around_mouth, *openings.mouth);
  if (lip_line_ && lip_line_->is_parted) findInside();
  const auto anywhere = [](std::uint32_t) { return true; };
  std::uint32_t upper = kUpperLip;
  for (const FaceOpenings::Sides& sides : openings.sides) {
    const std::uint32_t lower = 2 * upper;
    const bool is_traced = upper == kUpperLip && lip_line_ && lip_line_->is_parted;
    Reach up = reachFrom(is_traced ? lip_line_->upper_skin : nearestSkin(sides.upper), anywhere);
    Reach down = reachFrom(is_traced ? lip_line_->lower_skin : nearestSkin(sides.lower), anywhere);
    for (std::size_t v = 0; v < forbidden_.size(); ++v) {
      if (std::isfinite(up.distance[v]) && std::isfinite(down.distance[v]))
        forbidden_[v] |= up.distance[v] <= down.distance[v] ? lower : upper;
    }
    if (upper == kUpperLip) {
      to_upper_lip_ = std::move(up.distance);
      to_lower_lip_ = std::move(down.distance);
    }
    upper *= 4;
  }
}

const std::vector<PartKind>& HeadTopology::kinds() const { return net_->kinds; }

double HeadTopology::lowerShare(std::size_t vertex) const {
  const double both = to_upper_lip_[vertex] + to_lower_lip_[vertex];
  return std::isfinite(both) && both > 0 ? to_upper_lip_[vertex] / both : 0.5;
}

std::optional<std::uint32_t> HeadTopology::nearestSkin(const Eigen::Vector3d& place) const {
  const Eigen::RowVector3f at = place.transpose().cast<float>();
  float nearest = std::numeric_limits<float>::infinity();
  std::optional<std::uint32_t> found;
  for (std::uint32_t v = 0; v < kinds().size(); ++v) {
    if (!isSkin(kinds()[v])) continue;
    const float squared = (net_->places.row(v) - at).squaredNorm();
    if (squared >= nearest) continue;
    nearest = squared;
    found = v;
  }
  return found;
}

std::vector<std::uint32_t> HeadTopology::nearestSkin(const std::vector<Eigen::Vector3d>& places) const {
  std::vector<std::uint32_t> found;
  for (const Eigen::Vector3d& place : places) {
    if (const auto vertex = nearestSkin(place)) found.push_back(*vertex);
  }
  return found;
}

/// Dijkstra's way from many places at once.
HeadTopology::Reach HeadTopology::reachFrom(const std::vector<std::uint32_t>& seeds,
                                            const std::function<bool(std::uint32_t vertex)>& may_pass,
                                            double longest) const {
  Reach reach{std::vector<double>(kinds().size(), kInfinite), std::vector<std::int32_t>(kinds().size(), -1)};
  using Entry = std::pair<double, std::uint32_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  for (const std::uint32_t seed : seeds) {
    reach.distance[seed] = 0;
    reach.source[seed] = static_cast<std::int32_t>(seed);
    queue.emplace(0.0, seed);
  }
  while (!queue.empty()) {
    const auto [distance, vertex] = queue.top();
    queue.pop();
    if (distance > reach.distance[vertex]) continue;
    for (const Net::Link& link : net_->linksOf(vertex)) {
      if (link.is_double && at_lips_[vertex]) continue;
      const double further = distance + std::min(longest, double{link.length});
      if (further >= reach.distance[link.to] || !may_pass(link.to)) continue;
      reach.distance[link.to] = further;
      reach.source[link.to] = reach.source[vertex];
      queue.emplace(further, link.to);
    }
  }
  return reach;
}

/// What is nearer to the mouth's inside than to the lips' fronts, seen along the mesh.
void HeadTopology::findInside() {
  std::vector<std::uint32_t> seeds = lip_line_->inside;
  std::vector<bool> is_inside(kinds().size(), false);
  for (const std::uint32_t v : seeds) is_inside[v] = true;
  seeds.insert(seeds.end(), lip_line_->upper_skin.begin(), lip_line_->upper_skin.end());
  seeds.insert(seeds.end(), lip_line_->lower_skin.begin(), lip_line_->lower_skin.end());
  const Reach reach = reachFrom(seeds, [](std::uint32_t) { return true; });
  in_mouth_.assign(kinds().size(), false);
  for (std::size_t v = 0; v < in_mouth_.size(); ++v)
    in_mouth_[v] = reach.source[v] >= 0 && is_inside[unsignedIndex(reach.source[v])];
}

void HeadTopology::findPieces() {
  constexpr auto kNone = std::numeric_limits<std::uint32_t>::max();
  pieces_.assign(kinds().size(), kNone);
  std::uint32_t count = 0;
  std::vector<std::uint32_t> stack;
  for (std::uint32_t start = 0; start < pieces_.size(); ++start) {
    if (pieces_[start] != kNone) continue;
    stack.push_back(start);
    pieces_[start] = count;
    while (!stack.empty()) {
      const std::uint32_t vertex = stack.back();
      stack.pop_back();
      for (const Net::Link& link : net_->linksOf(vertex)) {
        if (pieces_[link.to] != kNone || (link.is_double && at_lips_[vertex])) continue;
        pieces_[link.to] = count;
        stack.push_back(link.to);
      }
    }
    ++count;
  }
}

}  // namespace mouthpiece
