#include "units/selection/lattice.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/errors.h"

namespace mouthpiece {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// A unit and the cheapest way to it.
struct Node {
  SelectedUnit unit;
  double path_cost = kInfinity;
  std::optional<std::size_t> before;
};

class Search {
 public:
  Search(std::size_t phones, const SelectionPolicy& policy) : policy_(policy), ending_at_(phones) {}

  std::vector<SelectedUnit> run() {
    const std::size_t last = ending_at_.size() - 1;
    for (std::size_t first = 0; first < last; ++first) {
      if (first > 0 && ending_at_[first].empty()) continue;  // no cover comes by here
      extendFrom(first);
    }
    return policy_.finish(cheapestPath(ending_at_[last]));
  }

 private:
  void extendFrom(std::size_t first) {
    std::vector<std::size_t>& by_cost = ending_at_[first];
    std::vector<SelectedUnit> ending;
    for (const std::size_t index : by_cost) ending.push_back(nodes_[index].unit);
    std::vector<SelectedUnit> offered = policy_.offer(first, ending);
    std::stable_sort(by_cost.begin(), by_cost.end(),
                     [&](std::size_t a, std::size_t b) { return nodes_[a].path_cost < nodes_[b].path_cost; });
    for (SelectedUnit& unit : offered) {
      Node node{std::move(unit), first == 0 ? 0.0 : kInfinity, std::nullopt};
      if (first > 0) connect(node, by_cost);
      node.path_cost += node.unit.target_cost + policy_.unitCost();
      ending_at_[node.unit.phones.last.value].push_back(nodes_.size());
      nodes_.push_back(std::move(node));
    }
  }

  /// Finds the best way to `node` among the units that end where it begins.
  void connect(Node& node, const std::vector<std::size_t>& by_cost) const {
    const auto comeFrom = [&](std::size_t index) {
      const double join = policy_.joinCost(nodes_[index].unit, node.unit);
      if (nodes_[index].path_cost + join >= node.path_cost) return;
      node.path_cost = nodes_[index].path_cost + join;
      node.unit.join_cost = join;
      node.before = index;
    };
    for (const std::size_t index : by_cost) {  // first, since it makes most others too dear to look at
      if (lastPlace(nodes_[index].unit) == node.unit.source) comeFrom(index);
    }
    for (const std::size_t index : by_cost) {
      if (nodes_[index].path_cost + policy_.leastJoinCost() >= node.path_cost) break;
      comeFrom(index);
    }
  }

  [[nodiscard]] std::vector<SelectedUnit> cheapestPath(const std::vector<std::size_t>& ending) const {
    MOUTHPIECE_EXPECT(!ending.empty());  // every phone reached has a unit that leads on
    std::optional<std::size_t> at = *std::min_element(ending.begin(), ending.end(), [&](std::size_t a, std::size_t b) {
      return nodes_[a].path_cost < nodes_[b].path_cost;
    });
    MOUTHPIECE_EXPECT(nodes_[*at].path_cost < kInfinity);
    std::vector<SelectedUnit> units;
    for (; at; at = nodes_[*at].before) units.push_back(nodes_[*at].unit);
    std::reverse(units.begin(), units.end());
    return units;
  }

  const SelectionPolicy& policy_;
  std::vector<Node> nodes_;
  std::vector<std::vector<std::size_t>> ending_at_;  ///< by phone
};

}  // namespace

std::vector<SelectedUnit> cheapestCover(std::size_t phones, const SelectionPolicy& policy) {
  return Search(phones, policy).run();
}

}  // namespace mouthpiece
