#include "deform/mesh/mesh_graph.h"

#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <queue>

namespace mouthpiece {

MeshGraph::MeshGraph(const FaceMesh& mesh, const std::function<bool(std::uint32_t vertex)>& may_weld) {
  const auto count = static_cast<std::size_t>(mesh.vertices.rows());
  std::vector<std::pair<std::uint32_t, Link>> all;
  const auto join = [&](std::uint32_t a, std::uint32_t b) {
    const float length = (mesh.vertices.row(a) - mesh.vertices.row(b)).norm();
    all.push_back({a, {b, length}});
    all.push_back({b, {a, length}});
  };
  for (const Triangle& triangle : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) join(triangle[k], triangle[(k + 1) % 3]);
  }
  std::map<std::array<float, 3>, std::uint32_t> places;
  for (std::uint32_t v = 0; v < count; ++v) {
    if (!may_weld(v)) continue;
    const auto [place, is_new] =
        places.emplace(std::array{mesh.vertices(v, 0), mesh.vertices(v, 1), mesh.vertices(v, 2)}, v);
    if (!is_new) join(place->second, v);
  }
  first_.assign(count + 1, 0);
  for (const auto& [from, link] : all) ++first_[from + 1];
  for (std::size_t v = 0; v < count; ++v) first_[v + 1] += first_[v];
  links_.resize(all.size());
  std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
  for (const auto& [from, link] : all) links_[next[from]++] = link;
}

MeshGraph::Reach MeshGraph::reachFrom(const std::vector<std::uint32_t>& seeds,
                                      const std::function<bool(std::uint32_t vertex)>& may_pass) const {
  const std::size_t count = first_.size() - 1;
  Reach reach{std::vector<double>(count, std::numeric_limits<double>::infinity()),
              std::vector<std::int32_t>(count, -1)};
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
    for (std::size_t l = first_[vertex]; l < first_[vertex + 1]; ++l) {
      const Link& link = links_[l];
      const double further = distance + static_cast<double>(link.length);
      if (further >= reach.distance[link.to] || !may_pass(link.to)) continue;
      reach.distance[link.to] = further;
      reach.source[link.to] = reach.source[vertex];
      queue.emplace(further, link.to);
    }
  }
  return reach;
}

std::vector<std::uint32_t> MeshGraph::components() const {
  const std::size_t count = first_.size() - 1;
  constexpr auto kNone = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> component(count, kNone);
  std::uint32_t parts = 0;
  std::vector<std::uint32_t> stack;
  for (std::uint32_t start = 0; start < count; ++start) {
    if (component[start] != kNone) continue;
    component[start] = parts;
    stack.push_back(start);
    while (!stack.empty()) {
      const std::uint32_t vertex = stack.back();
      stack.pop_back();
      for (std::size_t l = first_[vertex]; l < first_[vertex + 1]; ++l) {
        if (component[links_[l].to] != kNone) continue;
        component[links_[l].to] = parts;
        stack.push_back(links_[l].to);
      }
    }
    ++parts;
  }
  return component;
}

}  // namespace mouthpiece
