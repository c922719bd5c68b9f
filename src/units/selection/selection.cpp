#include "units/selection/selection.h"

#include <algorithm>
#include <limits>

#include "units/selection/lattice.h"

namespace mouthpiece {
namespace {

using Places = std::vector<PhonePlace>;

PhoneRange rangeOf(std::size_t first, std::size_t length) {
  return {PhoneIndex(first), PhoneIndex(first + length - 1)};
}

/// A place and what it costs: the cheaper one first, of equal ones the earlier in the corpus.
using RankedPlace = std::pair<double, PhonePlace>;

/// The `keep` cheapest, and, beside them, those that go on where a unit of `ending` ends; in the order of their cost.
void keepCheapest(std::vector<RankedPlace>& ranked, std::size_t keep, const std::vector<SelectedUnit>& ending) {
  keep = std::max<std::size_t>(1, keep);
  if (ranked.size() > keep) {
    Places next;
    for (const SelectedUnit& unit : ending) next.push_back(lastPlace(unit));
    std::sort(next.begin(), next.end());
    const auto rest = ranked.begin() + signedIndex(keep);
    std::nth_element(ranked.begin(), rest, ranked.end());
    ranked.erase(std::remove_if(rest, ranked.end(),
                                [&](const RankedPlace& place) {
                                  return !std::binary_search(next.begin(), next.end(), place.second);
                                }),
                 ranked.end());
  }
  std::sort(ranked.begin(), ranked.end());
}

/// What all policies stand on: the line, the corpus, what it offers and what that costs.
class PolicyBase : public SelectionPolicy {
 public:
  template <typename Weights>
  PolicyBase(const SpeechLabels& target, const UnitDatabase& database, const SelectionOptions& options,
             const Weights& weights)
      : target_(target),
        database_(database),
        options_(options),
        candidates_(target, database, options),
        costs_(costsOf(weights)),
        unit_cost_(weights["unit"]),
        stand_in_cost_(weights["stand-in"]) {}

  [[nodiscard]] double joinCost(const SelectedUnit& before, const SelectedUnit& after) const override {
    const PhonePlace left = lastPlace(before);
    const double sound = options_.sound_join_cost ? options_.sound_join_cost(left, after.source) : 0;
    return costs_.joinCost(after.phones.first, left, after.source) + sound;
  }

 protected:
  const SpeechLabels& target_;
  const UnitDatabase& database_;
  const SelectionOptions& options_;
  UnitCandidates candidates_;
  SelectionCosts costs_;
  double unit_cost_, stand_in_cost_;

 private:
  [[nodiscard]] SelectionCosts costsOf(const SelectionWeights& weights) const { return {target_, database_, weights}; }
  [[nodiscard]] SelectionCosts costsOf(const LatticeWeights& weights) const {
    return {target_, database_, weights, options_.predicted.get()};
  }
};

/// EDGE 5.1.1: from each phone the longest fragment, then on from its last phone. The paper's inner loop never ends
/// when not even the pair (i, i + 1) was captured: here a stand-in takes its place, so i always rises.
class GreedyPolicy : public PolicyBase {
 public:
  GreedyPolicy(const SpeechLabels& target, const UnitDatabase& database, const SelectionOptions& options)
      : PolicyBase(target, database, options, options.weights) {}

  [[nodiscard]] std::vector<SelectedUnit> offer(std::size_t first,
                                                const std::vector<SelectedUnit>& ending) const override {
    CandidateRun run = candidates_.longest(first);
    const bool is_backoff = run.places.empty();
    if (is_backoff) run = candidates_.nearestStandIns(first);
    SelectedUnit unit = cheapest(rangeOf(first, run.length), run, ending.empty() ? nullptr : &ending.front());
    unit.is_backoff = is_backoff;
    if (is_backoff) unit.target_cost += stand_in_cost_;
    return {unit};
  }

  [[nodiscard]] std::vector<SelectedUnit> finish(std::vector<SelectedUnit> units) const override {
    for (std::size_t i = 1; i < units.size() && options_.units == UnitScales::kAny; ++i) {
      if (!units[i - 1].is_backoff && !units[i].is_backoff) moveCut(units[i - 1], units[i]);
    }
    return units;
  }

 private:
  /// The cheapest of the run's places that were seen, one of which there is, given the unit before. What the labels say
  /// comes first: motion is loaded and looked at only where it could still change the choice, and of a large corpus'
  /// places at most at `kMostLookedAt`.
  [[nodiscard]] SelectedUnit cheapest(const PhoneRange& range, const CandidateRun& run,
                                      const SelectedUnit* before) const {
    constexpr std::size_t kMostLookedAt = 50;
    std::vector<RankedPlace> by_labels;
    for (const PhonePlace& place : run.places) by_labels.emplace_back(costs_.labelCost(range, place), place);
    std::sort(by_labels.begin(), by_labels.end());
    std::optional<SelectedUnit> best;
    std::size_t looked_at = 0;
    for (const auto& [label_cost, place] : by_labels) {
      const double least = best ? best->target_cost + best->join_cost : std::numeric_limits<double>::infinity();
      if (label_cost >= least || (best && looked_at >= kMostLookedAt)) break;
      ++looked_at;
      if (!database_.isSeen(place, run.length)) continue;
      SelectedUnit unit{range, place, costs_.targetCost(range, place), 0, false, {}};
      if (unit.target_cost >= least) continue;
      if (before != nullptr) unit.join_cost = joinCost(*before, unit);
      if (unit.target_cost + unit.join_cost < least) best = unit;
    }
    return best.value();
  }

  /// Greedy cuts as late as it can, inside a phone whose continuation `before` was captured with is the wrong one.
  /// Where `after` was captured with the right phones before it too, the cut may lie at any of them: it moves to where
  /// the lips agree best. Both units still share exactly one phone.
  void moveCut(SelectedUnit& before, SelectedUnit& after) const {
    SelectedUnit shorter = before;
    SelectedUnit longer = after;
    while (shorter.phones.first.value + 1 < shorter.phones.last.value && longer.source.phone.value > 0) {
      --shorter.phones.last.value;
      --longer.phones.first.value;
      --longer.source.phone.value;
      const std::size_t cut = longer.phones.first.value;
      const bool fits = database_.phoneAt(longer.source).phone == target_.phones[cut].phone;
      if (!fits || !database_.isSeen(longer.source, longer.phones.last.value - cut + 1)) return;
      longer.join_cost = joinCost(shorter, longer);
      if (longer.join_cost >= after.join_cost) continue;
      shorter.target_cost = costs_.targetCost(shorter.phones, shorter.source);
      longer.target_cost = costs_.targetCost(longer.phones, longer.source);
      before = shorter;
      after = longer;
    }
  }
};

/// The cheapest `candidates_kept` fragments of every run of phones; stand-ins only where there is no other.
class FragmentPolicy : public PolicyBase {
 public:
  FragmentPolicy(const SpeechLabels& target, const UnitDatabase& database, const SelectionOptions& options)
      : PolicyBase(target, database, options, options.weights) {}

  [[nodiscard]] double unitCost() const override { return unit_cost_; }

  [[nodiscard]] std::vector<SelectedUnit> offer(std::size_t first,
                                                const std::vector<SelectedUnit>& /*ending*/) const override {
    std::vector<SelectedUnit> units;
    for (const CandidateRun& run : candidates_.all(first)) addCheapest(first, run, false, units);
    if (units.empty()) addCheapest(first, candidates_.seen(candidates_.nearestStandIns(first)), true, units);
    return units;
  }

 private:
  void addCheapest(std::size_t first, const CandidateRun& run, bool is_backoff,
                   std::vector<SelectedUnit>& units) const {
    const PhoneRange range = rangeOf(first, run.length);
    std::vector<RankedPlace> ranked;
    for (const PhonePlace& place : run.places) ranked.emplace_back(costs_.targetCost(range, place), place);
    keepCheapest(ranked, options_.candidates_kept, {});
    for (const auto& [cost, place] : ranked)
      units.push_back({range, place, cost + (is_backoff ? stand_in_cost_ : 0), 0, is_backoff, {}});
  }
};

/// Pair by pair: a change of place costs a join, and going on in the same take nothing, so units of every length
/// compete. The `pairs_kept` cheapest places of each pair, and those that go on from one kept for the pair before.
class PairPolicy : public PolicyBase {
 public:
  PairPolicy(const SpeechLabels& target, const UnitDatabase& database, const SelectionOptions& options)
      : PolicyBase(target, database, options, options.lattice.value_or(database.corpus().lattice_weights)) {}

  [[nodiscard]] double leastJoinCost() const override { return unit_cost_; }

  [[nodiscard]] double joinCost(const SelectedUnit& before, const SelectedUnit& after) const override {
    return lastPlace(before) == after.source ? 0 : PolicyBase::joinCost(before, after) + unit_cost_;
  }

  [[nodiscard]] std::vector<SelectedUnit> offer(std::size_t first,
                                                const std::vector<SelectedUnit>& ending) const override {
    const PhoneRange range = rangeOf(first, 2);
    if (first < options_.settled.size() && options_.settled[first]) return {settledPair(range)};
    std::vector<RankedPlace> ranked;
    const auto add = [&](const Places& places, double extra) {
      for (const PhonePlace& place : likeliest(first, places)) {
        const double cost = costs_.targetCost(range, place) + extra;
        if (cost < std::numeric_limits<double>::infinity()) ranked.emplace_back(cost, place);
      }
    };
    add(candidates_.placesOfPair(target_.phones[first].phone, target_.phones[first + 1].phone), 0);
    const bool is_backoff = ranked.empty();
    if (is_backoff) {
      for (const StandIns& stand_ins : candidates_.standInsNear(first))
        add(stand_ins.places, stand_in_cost_ + stand_ins.distance);
    }
    if (ranked.empty()) candidates_.failWithoutStandIn(first);
    keepCheapest(ranked, options_.pairs_kept, ending);
    std::vector<SelectedUnit> units;
    for (const auto& [cost, place] : ranked) units.push_back({range, place, cost, 0, is_backoff, {}});
    return units;
  }

  /// Pairs that follow each other in a take are one unit.
  [[nodiscard]] std::vector<SelectedUnit> finish(std::vector<SelectedUnit> pairs) const override {
    std::vector<SelectedUnit> units;
    for (const SelectedUnit& pair : pairs) {
      const bool goes_on =
          !units.empty() && !pair.is_backoff && !units.back().is_backoff && lastPlace(units.back()) == pair.source;
      if (!goes_on) {
        units.push_back(pair);
        continue;
      }
      units.back().phones.last = pair.phones.last;
      units.back().target_cost += pair.target_cost;
    }
    return units;
  }

 private:
  [[nodiscard]] SelectedUnit settledPair(const PhoneRange& range) const {
    const PhonePlace place = *options_.settled[range.first.value];
    const auto isSaid = [&](PhoneIndex phone, const PhonePlace& at) {
      return database_.phoneAt(at).phone == target_.phones[phone.value].phone;
    };
    const bool is_backoff = !isSaid(range.first, place) || !isSaid(range.last, advance(place, 1));
    return {range, place, 0, 0, is_backoff, {}};
  }

  /// Of very many places those whose labels suit: the others are not looked at.
  [[nodiscard]] Places likeliest(std::size_t first, const Places& places) const {
    const std::size_t keep = std::max(options_.pairs_kept, options_.pairs_looked_at);
    if (places.size() <= keep) return places;
    std::vector<RankedPlace> rough;
    rough.reserve(places.size());
    for (const PhonePlace& place : places) rough.emplace_back(costs_.roughCost(first, place), place);
    std::nth_element(rough.begin(), rough.begin() + signedIndex(keep), rough.end());
    Places kept;
    for (std::size_t i = 0; i < keep; ++i) kept.push_back(rough[i].second);
    return kept;
  }
};

/// The take that says all of the line in the line's own time: nothing suits it better, whatever is predicted.
std::optional<SelectedUnit> takeInItsOwnTime(const SpeechLabels& target, const UnitDatabase& database) {
  std::vector<Phone> phones;
  for (const LabelledPhone& phone : target.phones) phones.push_back(phone.phone);
  for (const PhonePlace& place : database.index().placesOf(phones)) {
    if (isSaidAlike(target, database.takeOf(place).labels) && database.isSeen(place, phones.size()))
      return SelectedUnit{rangeOf(0, phones.size()), place, 0, 0, false, {}};
  }
  return std::nullopt;
}

template <typename Tier>
std::size_t wholeEntries(const Tier& tier, std::size_t first, std::size_t last) {
  return unsignedIndex(std::count_if(tier.begin(), tier.end(), [&](const auto& entry) {
    return first <= entry.phones.first.value && entry.phones.last.value <= last;
  }));
}

/// Other seen places of the corpus that say the target's phones `range`, the cheapest first.
std::vector<SelectedUnit> cheapestPlaces(const SpeechLabels& target, const UnitDatabase& database,
                                         const SelectionCosts& costs, const PhoneRange& range, const PhonePlace& own,
                                         std::size_t most) {
  constexpr std::size_t kMostLookedAt = 200;
  std::vector<Phone> wanted;
  for (std::size_t i = range.first.value; i <= range.last.value; ++i) wanted.push_back(target.phones[i].phone);
  std::vector<SelectedUnit> candidates;
  std::size_t looked_at = 0;
  for (const PhonePlace& place : database.index().placesOf(wanted)) {
    if (place == own) continue;
    if (++looked_at > kMostLookedAt) break;
    candidates.push_back({range, place, costs.targetCost(range, place), 0, false, {}});
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const SelectedUnit& a, const SelectedUnit& b) { return a.target_cost < b.target_cost; });
  // Whether a place was seen is read from the file: only of those that may be offered.
  std::vector<SelectedUnit> seen;
  for (const SelectedUnit& candidate : candidates) {
    if (seen.size() == most) break;
    if (database.isSeen(candidate.source, wanted.size())) seen.push_back(candidate);
  }
  return seen;
}

std::vector<SelectedUnit> cheapestOthers(const SpeechLabels& target, const UnitDatabase& database,
                                         const SelectionCosts& costs, const SelectedUnit& unit, std::size_t most) {
  const std::size_t begin = unit.phones.first.value, end = unit.phones.last.value + 1;
  std::vector<bool> has_offer(end - begin, false);
  std::vector<SelectedUnit> others;
  for (std::size_t count = end - begin; count >= 2; --count) {
    std::vector<bool> has_longer = has_offer;
    for (std::size_t first = begin; first + count <= end; ++first) {
      const auto covered = has_longer.begin() + signedIndex(first - begin);
      if (std::all_of(covered, covered + signedIndex(count), [](bool is) { return is; })) continue;
      const std::vector<SelectedUnit> found =
          cheapestPlaces(target, database, costs, rangeOf(first, count), advance(unit.source, first - begin), most);
      others.insert(others.end(), found.begin(), found.end());
      if (!found.empty()) std::fill_n(has_offer.begin() + signedIndex(first - begin), signedIndex(count), true);
    }
  }
  return others;
}

}  // namespace

std::vector<SelectedUnit> selectUnits(const SpeechLabels& target, const UnitDatabase& database,
                                      const SelectionOptions& options) {
  const std::size_t phones = target.phones.size();
  if (phones < 2) return {};
  if (options.method == SelectionMethod::kGreedy) return cheapestCover(phones, GreedyPolicy(target, database, options));
  const bool has_prediction = database.corpus().trajectory_model != nullptr;
  const bool joins_sound = static_cast<bool>(options.sound_join_cost);  // sound wants long fragments
  if (!has_prediction || joins_sound || options.units != UnitScales::kAny)
    return cheapestCover(phones, FragmentPolicy(target, database, options));
  if (options.settled.empty()) {
    if (const auto take = takeInItsOwnTime(target, database)) return {*take};
  }
  return cheapestCover(phones, PairPolicy(target, database, options));
}

std::vector<std::vector<SelectedUnit>> otherUnits(const SpeechLabels& target, const UnitDatabase& database,
                                                  std::span<const SelectedUnit> units, std::size_t most) {
  const Corpus& corpus = database.corpus();
  const SelectionCosts costs = corpus.trajectory_model != nullptr
                                   ? SelectionCosts(target, database, corpus.lattice_weights)
                                   : SelectionCosts(target, database, SelectionWeights());
  std::vector<std::vector<SelectedUnit>> others;
  for (const SelectedUnit& unit : units) others.push_back(cheapestOthers(target, database, costs, unit, most));
  return others;
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
