#include "units/selection/lattice.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "base/errors.h"
#include "units/selection/pair_costs.h"
#include "units/selection/unit_costs.h"

namespace mouthpiece {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

/// The places offered for one pair of the line, and the cheapest way to each.
struct Column {
  std::vector<PairCandidate> candidates;
  bool is_backoff = false;
  std::vector<float> path_cost;
  std::vector<float> join_cost;
  std::vector<std::uint32_t> before;  ///< in the column before
};

bool cheaper(const PairCandidate& a, const PairCandidate& b) {
  return a.cost != b.cost ? a.cost < b.cost : a.place < b.place;
}

/// The `keep` cheapest, and those that go on from a place of the column before: in the order of their cost.
void keepCheapest(std::vector<PairCandidate>& candidates, std::size_t keep, const Column* before) {
  if (candidates.size() <= keep) return std::sort(candidates.begin(), candidates.end(), cheaper);
  std::nth_element(candidates.begin(), candidates.begin() + static_cast<std::ptrdiff_t>(keep), candidates.end(),
                   cheaper);
  std::vector<PairCandidate> rest(candidates.begin() + static_cast<std::ptrdiff_t>(keep), candidates.end());
  candidates.resize(keep);
  if (before != nullptr) {
    std::vector<PhonePlace> next;
    for (const PairCandidate& known : before->candidates) next.push_back(advance(known.place, 1));
    std::sort(next.begin(), next.end());
    for (const PairCandidate& candidate : rest) {
      if (std::binary_search(next.begin(), next.end(), candidate.place)) candidates.push_back(candidate);
    }
  }
  std::sort(candidates.begin(), candidates.end(), cheaper);
}

/// The take that says all of the line in the line's own time: nothing suits it better, whatever is predicted.
std::optional<SelectedUnit> takeInItsOwnTime(const SpeechLabels& target, const UnitDatabase& database) {
  std::vector<Phone> phones;
  for (const LabelledPhone& phone : target.phones) phones.push_back(phone.phone);
  for (const PhonePlace& place : database.index().placesOf(phones)) {
    if (isSaidAlike(target, database.takeOf(place).labels) && database.isSeen(place, phones.size()))
      return SelectedUnit{{PhoneIndex(0), PhoneIndex(phones.size() - 1)}, place, 0, 0, false};
  }
  return std::nullopt;
}

class Lattice {
 public:
  Lattice(const SpeechLabels& target, const UnitDatabase& database, const UnitCandidates& candidates,
          const SelectionOptions& options)
      : target_(target),
        database_(database),
        candidates_(candidates),
        options_(options),
        weights_(options.lattice.value_or(database.corpus().lattice_weights)),
        costs_(target, database, weights_) {}

  std::vector<SelectedUnit> cheapestUnits() {
    for (std::size_t first = 0; first + 1 < target_.phones.size(); ++first) {
      columns_.push_back(offer(first));
      connect(first);
    }
    return unitsOf(cheapestPath());
  }

 private:
  Column offer(std::size_t first) const {
    Column column;
    const auto add = [&](const std::vector<PhonePlace>& places, double extra) {
      for (const PhonePlace& place : likeliest(first, places)) {
        const float cost = costs_.targetCost(first, place) + static_cast<float>(extra);
        if (cost < kInfinity) column.candidates.push_back({place, cost});
      }
    };
    add(database_.diphones(target_.phones[first].phone, target_.phones[first + 1].phone), 0);
    if (column.candidates.empty()) {
      column.is_backoff = true;
      for (const StandIns& stand_ins : candidates_.standInsNear(first)) {
        add(stand_ins.places, weights_.backoff + stand_ins.distance);
      }
    }
    if (column.candidates.empty()) candidates_.failWithoutStandIn(first);
    keepCheapest(column.candidates, std::max<std::size_t>(1, options_.pairs_kept),
                 columns_.empty() ? nullptr : &columns_.back());
    return column;
  }

  /// Of very many places those whose labels suit: the others are not looked at.
  std::vector<PhonePlace> likeliest(std::size_t first, const std::vector<PhonePlace>& places) const {
    const std::size_t keep = std::max(options_.pairs_kept, options_.pairs_looked_at);
    if (places.size() <= keep) return places;
    std::vector<PairCandidate> rough;
    rough.reserve(places.size());
    for (const PhonePlace& place : places) rough.push_back({place, costs_.roughCost(first, place)});
    std::nth_element(rough.begin(), rough.begin() + static_cast<std::ptrdiff_t>(keep), rough.end(), cheaper);
    std::vector<PhonePlace> kept;
    for (std::size_t i = 0; i < keep; ++i) kept.push_back(rough[i].place);
    return kept;
  }

  /// Finds the cheapest way to each place of the column of `first`.
  void connect(std::size_t first) {
    Column& column = columns_[first];
    const std::size_t count = column.candidates.size();
    column.path_cost.assign(count, kInfinity);
    column.join_cost.assign(count, 0);
    column.before.assign(count, kNone);
    if (first == 0) {
      for (std::size_t i = 0; i < count; ++i) column.path_cost[i] = column.candidates[i].cost;
      return;
    }
    const Column& before = columns_[first - 1];
    std::vector<std::uint32_t> by_cost(before.candidates.size());
    for (std::uint32_t i = 0; i < by_cost.size(); ++i) by_cost[i] = i;
    std::sort(by_cost.begin(), by_cost.end(),
              [&](std::uint32_t a, std::uint32_t b) { return before.path_cost[a] < before.path_cost[b]; });
    const auto unit = static_cast<float>(weights_.unit);
    for (std::size_t i = 0; i < count; ++i) {
      const PairCandidate& own = column.candidates[i];
      float best = kInfinity;
      const auto comeFrom = [&](std::uint32_t j, float join) {
        if (before.path_cost[j] + join >= best) return;
        best = before.path_cost[j] + join;
        column.before[i] = j;
        column.join_cost[i] = join;
      };
      for (std::uint32_t j = 0; j < by_cost.size(); ++j) {  // going on in the same take costs nothing
        if (advance(before.candidates[j].place, 1) == own.place) comeFrom(j, 0);
      }
      for (const std::uint32_t j : by_cost) {
        if (before.path_cost[j] + unit >= best) break;
        comeFrom(j, joinCost(first, advance(before.candidates[j].place, 1), own.place));
      }
      column.path_cost[i] = best + own.cost;
    }
  }

  [[nodiscard]] float joinCost(std::size_t shared, const PhonePlace& before, const PhonePlace& after) const {
    const double sound = options_.sound_join_cost ? options_.sound_join_cost(before, after) : 0;
    return costs_.joinCost(shared, before, after) + static_cast<float>(sound);
  }

  /// One place a pair, by its number in the column.
  [[nodiscard]] std::vector<std::size_t> cheapestPath() const {
    const Column& last = columns_.back();
    const auto least = std::min_element(last.path_cost.begin(), last.path_cost.end());
    std::vector<std::size_t> path(columns_.size());
    path.back() = static_cast<std::size_t>(least - last.path_cost.begin());
    for (std::size_t i = columns_.size() - 1; i > 0; --i) {
      MOUTHPIECE_EXPECT(columns_[i].before[path[i]] != kNone);
      path[i - 1] = columns_[i].before[path[i]];
    }
    return path;
  }

  /// Pairs that follow each other in a take are one unit.
  [[nodiscard]] std::vector<SelectedUnit> unitsOf(const std::vector<std::size_t>& path) const {
    std::vector<SelectedUnit> units;
    for (std::size_t i = 0; i < path.size(); ++i) {
      const PairCandidate& pair = columns_[i].candidates[path[i]];
      const bool goes_on = i > 0 && !columns_[i].is_backoff && !units.back().is_backoff &&
                           advance(columns_[i - 1].candidates[path[i - 1]].place, 1) == pair.place;
      if (!goes_on) {
        units.push_back(
            {{PhoneIndex(i), PhoneIndex(i)}, pair.place, 0, columns_[i].join_cost[path[i]], columns_[i].is_backoff});
      }
      units.back().phones.last = PhoneIndex(i + 1);
      units.back().target_cost += pair.cost;
    }
    return units;
  }

  const SpeechLabels& target_;
  const UnitDatabase& database_;
  const UnitCandidates& candidates_;
  const SelectionOptions& options_;
  LatticeWeights weights_;
  PairCosts costs_;
  std::vector<Column> columns_;
};

}  // namespace

bool hasLattice(const UnitDatabase& database) { return database.corpus().trajectory_model != nullptr; }

std::vector<SelectedUnit> selectByLattice(const SpeechLabels& target, const UnitDatabase& database,
                                          const UnitCandidates& candidates, const SelectionOptions& options) {
  if (const auto take = takeInItsOwnTime(target, database)) return {*take};
  return Lattice(target, database, candidates, options).cheapestUnits();
}

}  // namespace mouthpiece
