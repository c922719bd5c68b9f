#include "units/selection/selection.h"

#include <algorithm>
#include <limits>

#include "units/selection/lattice.h"
#include "units/selection/unit_candidates.h"
#include "units/selection/unit_costs.h"
#include "units/selection/viterbi.h"

namespace mouthpiece {
namespace {

PhoneRange rangeOf(std::size_t first, std::size_t length) {
  return {PhoneIndex(first), PhoneIndex(first + length - 1)};
}

/// The corpus phone that ends `unit`.
PhonePlace lastPlace(const SelectedUnit& unit) {
  return advance(unit.source, unit.phones.last.value - unit.phones.first.value);
}

/// The cheapest of the run's places that were seen, given the unit before; nothing where none of those looked at was.
/// What the labels say comes first: motion is loaded and looked at only where it could still change the choice, and of
/// a large corpus' places at most at `kMostLookedAt`.
std::optional<SelectedUnit> cheapest(const UnitCosts& costs, const UnitDatabase& database, std::size_t first,
                                     const CandidateRun& run, const SelectedUnit* before) {
  constexpr std::size_t kMostLookedAt = 50;
  const PhoneRange range = rangeOf(first, run.length);
  std::vector<std::pair<double, PhonePlace>> by_labels;
  for (const PhonePlace& place : run.places) by_labels.emplace_back(costs.labelCost(range, place), place);
  std::sort(by_labels.begin(), by_labels.end());
  std::optional<SelectedUnit> best;
  std::size_t looked_at = 0;
  for (const auto& [label_cost, place] : by_labels) {
    const double least = best ? best->target_cost + best->join_cost : std::numeric_limits<double>::infinity();
    if (label_cost >= least || (best && looked_at >= kMostLookedAt)) break;
    ++looked_at;
    if (!database.isSeen(place, run.length)) continue;
    SelectedUnit unit{range, place, costs.targetCost(range, place), 0, false, {}};
    if (unit.target_cost >= least) continue;
    if (before != nullptr) unit.join_cost = costs.joinCost(PhoneIndex(first), lastPlace(*before), place);
    if (unit.target_cost + unit.join_cost < least) best = unit;
  }
  return best;
}

/// Greedy cuts as late as it can, inside a phone whose continuation `before` was captured with is the wrong one. Where
/// `after` was captured with the right phones before it too, the cut may lie at any of them: it moves to where the lips
/// agree best. Both units still share exactly one phone.
void moveCut(const SpeechLabels& target, const UnitDatabase& database, const UnitCosts& costs, SelectedUnit& before,
             SelectedUnit& after) {
  SelectedUnit shorter = before;
  SelectedUnit longer = after;
  while (shorter.phones.first.value + 1 < shorter.phones.last.value && longer.source.phone.value > 0) {
    --shorter.phones.last.value;
    --longer.phones.first.value;
    --longer.source.phone.value;
    const PhoneIndex cut = longer.phones.first;
    const bool fits = database.phoneAt(longer.source).phone == target.phones[cut.value].phone;
    if (!fits || !database.isSeen(longer.source, longer.phones.last.value - cut.value + 1)) return;
    longer.join_cost = costs.joinCost(cut, lastPlace(shorter), longer.source);
    if (longer.join_cost >= after.join_cost) continue;
    shorter.target_cost = costs.targetCost(shorter.phones, shorter.source);
    longer.target_cost = costs.targetCost(longer.phones, longer.source);
    before = shorter;
    after = longer;
  }
}

/// EDGE 5.1.1: from phone i the longest fragment, then on from its last phone. The paper's inner loop never ends when
/// not even the pair (i, i + 1) was captured: here a stand-in takes its place, so i always rises.
std::vector<SelectedUnit> selectGreedily(const SpeechLabels& target, const UnitDatabase& database,
                                         const UnitCandidates& candidates, const UnitCosts& costs,
                                         const SelectionOptions& options) {
  std::vector<SelectedUnit> units;
  for (std::size_t i = 0; i + 1 < target.phones.size();) {
    CandidateRun run = candidates.longest(i);
    const bool is_backoff = run.places.empty();
    if (is_backoff) run = candidates.standIns(i);
    SelectedUnit unit = cheapest(costs, database, i, run, units.empty() ? nullptr : &units.back()).value();
    unit.is_backoff = is_backoff;
    if (is_backoff) unit.target_cost += options.weights.backoff;
    const bool may_move =
        options.units == UnitScales::kAny && !units.empty() && !is_backoff && !units.back().is_backoff;
    if (may_move) moveCut(target, database, costs, units.back(), unit);
    i = unit.phones.last.value;
    units.push_back(unit);
  }
  return units;
}

template <typename Tier>
std::size_t wholeEntries(const Tier& tier, std::size_t first, std::size_t last) {
  return static_cast<std::size_t>(std::count_if(tier.begin(), tier.end(), [&](const auto& entry) {
    return first <= entry.phones.first.value && entry.phones.last.value <= last;
  }));
}

}  // namespace

std::optional<SelectionMethod> selectionMethodFromName(std::string_view name) {
  if (name == "greedy") return SelectionMethod::kGreedy;
  if (name == "viterbi") return SelectionMethod::kViterbi;
  return std::nullopt;
}

std::optional<UnitScales> unitScalesFromName(std::string_view name) {
  if (name == "any") return UnitScales::kAny;
  if (name == "paper") return UnitScales::kPaper;
  return std::nullopt;
}

std::vector<SelectedUnit> selectUnits(const SpeechLabels& target, const UnitDatabase& database,
                                      const SelectionOptions& options) {
  if (target.phones.size() < 2) return {};
  const UnitCandidates candidates(target, database, options);
  const bool joins_sound = static_cast<bool>(options.sound_join_cost);  // sound wants long fragments
  if (options.method == SelectionMethod::kViterbi && options.units == UnitScales::kAny && hasLattice(database) &&
      !joins_sound) {
    return selectByLattice(target, database, candidates, options);
  }
  const UnitCosts costs(target, database, options);
  if (options.method == SelectionMethod::kViterbi) return selectByViterbi(target, candidates, costs, options);
  return selectGreedily(target, database, candidates, costs, options);
}

std::string_view scaleOf(const SpeechLabels& take, PhoneIndex first, std::size_t phone_count) {
  const std::size_t last = first.value + phone_count - 1;
  if (phone_count == take.phones.size()) return "sentence";
  const std::size_t words = wholeEntries(take.words, first.value, last);
  if (words > 1) return "phrase";
  if (words == 1) return "word";
  if (wholeEntries(take.syllables, first.value, last) > 0) return "syllable";
  return phone_count == 2 ? "diphone" : "span";
}

}  // namespace mouthpiece
