#include "units/selection/viterbi.h"

#include <algorithm>
#include <limits>

#include "base/errors.h"

namespace mouthpiece {
namespace {

/// A unit and the cheapest way to it.
struct Node {
  SelectedUnit unit;
  double path_cost = std::numeric_limits<double>::infinity();
  std::optional<std::size_t> before;
};

std::vector<SelectedUnit> cheapestUnits(const UnitCosts& costs, std::size_t first, const CandidateRun& run,
                                        std::size_t keep) {
  std::vector<SelectedUnit> units;
  for (const PhonePlace& place : run.places) {
    SelectedUnit unit{{PhoneIndex(first), PhoneIndex(first + run.length - 1)}, place, 0, 0, false, {}};
    unit.target_cost = costs.targetCost(unit.phones, place);
    units.push_back(unit);
  }
  std::stable_sort(units.begin(), units.end(),
                   [](const SelectedUnit& a, const SelectedUnit& b) { return a.target_cost < b.target_cost; });
  if (units.size() > keep) units.resize(keep);
  return units;
}

/// All units that begin at phone `first`; stand-ins only where there is no other.
std::vector<SelectedUnit> unitsFrom(std::size_t first, const UnitCandidates& candidates, const UnitCosts& costs,
                                    const SelectionOptions& options) {
  const std::size_t keep = std::max<std::size_t>(1, options.candidates_kept);
  std::vector<SelectedUnit> units;
  for (const CandidateRun& run : candidates.all(first)) {
    const auto kept = cheapestUnits(costs, first, run, keep);
    units.insert(units.end(), kept.begin(), kept.end());
  }
  if (!units.empty()) return units;
  units = cheapestUnits(costs, first, candidates.seen(candidates.standIns(first)), keep);
  for (SelectedUnit& unit : units) {
    unit.is_backoff = true;
    unit.target_cost += options.weights.backoff;
  }
  return units;
}

/// Finds the best way to `node` among the units that end where it begins.
void connect(Node& node, const std::vector<Node>& nodes, const std::vector<std::size_t>& ending, const UnitCosts& costs,
             double unit_cost) {
  const double own = node.unit.target_cost + unit_cost;
  for (const std::size_t index : ending) {
    const Node& before = nodes[index];
    if (before.path_cost + own >= node.path_cost) continue;
    const std::size_t phones = before.unit.phones.last.value - before.unit.phones.first.value;
    const double join = costs.joinCost(node.unit.phones.first, advance(before.unit.source, phones), node.unit.source);
    if (before.path_cost + own + join >= node.path_cost) continue;
    node.path_cost = before.path_cost + own + join;
    node.unit.join_cost = join;
    node.before = index;
  }
}

}  // namespace

std::vector<SelectedUnit> selectByViterbi(const SpeechLabels& target, const UnitCandidates& candidates,
                                          const UnitCosts& costs, const SelectionOptions& options) {
  const std::size_t last = target.phones.size() - 1;
  std::vector<Node> nodes;
  std::vector<std::vector<std::size_t>> ending_at(last + 1);
  for (std::size_t first = 0; first < last; ++first) {
    if (first > 0 && ending_at[first].empty()) continue;  // no cover comes by here
    for (SelectedUnit& unit : unitsFrom(first, candidates, costs, options)) {
      Node node{unit, std::numeric_limits<double>::infinity(), std::nullopt};
      if (first == 0) {
        node.path_cost = unit.target_cost + options.weights.unit;
      } else {
        connect(node, nodes, ending_at[first], costs, options.weights.unit);
      }
      ending_at[unit.phones.last.value].push_back(nodes.size());
      nodes.push_back(node);
    }
  }
  // Every phone reached has a unit that leads on, so the end was reached.
  MOUTHPIECE_EXPECT(!ending_at[last].empty());
  std::optional<std::size_t> at =
      *std::min_element(ending_at[last].begin(), ending_at[last].end(),
                        [&](std::size_t a, std::size_t b) { return nodes[a].path_cost < nodes[b].path_cost; });
  std::vector<SelectedUnit> units;
  for (; at; at = nodes[*at].before) units.push_back(nodes[*at].unit);
  std::reverse(units.begin(), units.end());
  return units;
}

}  // namespace mouthpiece
