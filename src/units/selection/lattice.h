#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "units/costs/cost_terms.h"
#include "units/selection/selection.h"
#include "units/selection/unit_database.h"

namespace mouthpiece {

/// Captured fragments that hold phones [first, first + length) of the line.
struct CandidateRun {
  std::size_t length = 0;
  std::vector<PhonePlace> places;
};

/// Places of a pair of phones that looks alike, and how alike (the sum of both visemeDistance()).
struct StandIns {
  double distance = 0;
  std::vector<PhonePlace> places;
};

/// Offers the fragments that may serve a line, from phone to phone.
class UnitCandidates {
 public:
  UnitCandidates(const SpeechLabels& target, const UnitDatabase& database, const SelectionOptions& options);

  /// Where the pair occurs: of a hundred hours' places some evenly spread ones, since more offer nothing better.
  [[nodiscard]] std::vector<PhonePlace> placesOfPair(Phone a, Phone b) const;
  /// The longest allowed run from `first` on of which a place at least was seen; length 0 when there is none of two
  /// phones or more.
  [[nodiscard]] CandidateRun longest(std::size_t first) const;
  /// Every run, longest first, its seen places.
  [[nodiscard]] std::vector<CandidateRun> all(std::size_t first) const;
  /// The run's places that were seen.
  [[nodiscard]] CandidateRun seen(CandidateRun run) const;
  /// The nearest diphone by viseme class of which a place at least was seen, for the pair (first, first + 1). Throws
  /// MissingPairError when none is near, or there shall be none.
  [[nodiscard]] CandidateRun nearestStandIns(std::size_t first) const;
  /// All pairs next to as near as the nearest, whether their motion was seen or not; empty when none is near. Throws
  /// MissingPairError when there shall be none.
  [[nodiscard]] std::vector<StandIns> standInsNear(std::size_t first) const;
  /// Throws MissingPairError.
  [[noreturn]] void failWithoutStandIn(std::size_t first) const;

 private:
  [[nodiscard]] bool isOfScale(const PhonePlace& place, std::size_t length) const;
  [[nodiscard]] bool isAnySeen(const std::vector<PhonePlace>& places, std::size_t length) const;
  [[nodiscard]] std::vector<StandIns> standIns(std::size_t first, double beyond_nearest, bool only_seen) const;
  [[noreturn]] void failWithPair(std::size_t first, const char* what) const;

  std::vector<Phone> phones_;
  const UnitDatabase& database_;
  UnitScales scales_;
  Backoff backoff_;
};

/// Target and join costs of what is offered for a line: the terms of a table (units/costs/cost_terms.h), summed. Refers
/// to the line and the database. For one thread.
class SelectionCosts {
 public:
  /// Fragments of any length, by labels and captured lips.
  SelectionCosts(const SpeechLabels& target, const UnitDatabase& database, const SelectionWeights& weights);
  /// Pairs, by labels and PhoneShapes. Needs a corpus with a trajectory model; what it predicts for the line may be
  /// null.
  SelectionCosts(const SpeechLabels& target, const UnitDatabase& database, const LatticeWeights& weights,
                 const PredictedLine* predicted = nullptr);

  /// Of the fragment at `place` for the phones `range`; infinite where a pair was not seen.
  [[nodiscard]] double targetCost(const PhoneRange& range, const PhonePlace& place) const;
  /// Of a fragment: no more than its target cost, and told by labels alone.
  [[nodiscard]] double labelCost(const PhoneRange& range, const PhonePlace& place) const;
  /// Of a pair: durations and nearest neighbours, told at once: to leave the worst of very many places out before
  /// anything of their takes is looked at.
  [[nodiscard]] double roughCost(std::size_t first, const PhonePlace& place) const;
  /// Of going from a fragment in which `before` plays phone `shared` of the line to one in which `after` does: the
  /// least mismatch over the points of the phone.
  [[nodiscard]] double joinCost(PhoneIndex shared, const PhonePlace& before, const PhonePlace& after) const;

 private:
  template <typename Value>
  struct Weighted {
    double weight;
    Value value;
  };
  SelectionCosts(const SpeechLabels& target, const UnitDatabase& database, const CostWeights& weights, bool of_pairs);
  [[nodiscard]] double sum(const PhoneRange& range, const PhonePlace& place, bool look_at_motion) const;
  [[nodiscard]] double phoneCost(std::size_t phone, const PhonePlace& place, const PhoneFacts& found, bool look) const;
  [[nodiscard]] PhoneFacts found(const PhonePlace& place) const;
  /// Fill differences_ and velocities_.
  void comparePairs(PhoneIndex shared, const PhonePlace& before, const PhonePlace& after) const;
  void compareLips(PhoneIndex shared, const PhonePlace& before, const PhonePlace& after) const;

  const SpeechLabels& target_;
  const UnitDatabase& database_;
  bool of_pairs_;
  std::vector<Weighted<CostTerm::OfPhone>> phone_terms_;
  std::vector<Weighted<CostTerm::OfEnds>> end_terms_;
  std::vector<Weighted<CostTerm::OfJoin>> join_terms_;
  double duration_weight_ = 0, neighbour_weight_ = 0;
  std::vector<PhoneFacts> wanted_;
  // Of pairs only:
  double closed_mm_ = 0;
  PhoneShapes::Matrix predicted_;
  std::vector<float> openings_;  ///< lip opening in mm of one unit of each component
  mutable PhoneShapes::Matrix differences_, velocities_;
};

/// Which units may begin at a phone, and what it costs to go from one to the next: what sets the methods apart.
class SelectionPolicy {
 public:
  virtual ~SelectionPolicy() = default;
  /// The units that begin at phone `first`, given those that end there. Throws MissingPairError when there is none.
  [[nodiscard]] virtual std::vector<SelectedUnit> offer(std::size_t first,
                                                        const std::vector<SelectedUnit>& ending) const = 0;
  /// Of `after` behind `before`, which ends where it begins.
  [[nodiscard]] virtual double joinCost(const SelectedUnit& before, const SelectedUnit& after) const = 0;
  /// Of each unit, beside its target cost.
  [[nodiscard]] virtual double unitCost() const { return 0; }
  /// No join costs less, but where a unit goes on from the one before in the capture.
  [[nodiscard]] virtual double leastJoinCost() const { return 0; }
  /// The cheapest row of units as it is to be played.
  [[nodiscard]] virtual std::vector<SelectedUnit> finish(std::vector<SelectedUnit> units) const { return units; }
};

/// The row of offered units that covers the line's phones, neighbours sharing one, with the least sum of target, join
/// and unit costs: exact dynamic programming.
std::vector<SelectedUnit> cheapestCover(std::size_t phones, const SelectionPolicy& policy);

/// The corpus phone that ends `unit`.
inline PhonePlace lastPlace(const SelectedUnit& unit) {
  return advance(unit.source, unit.phones.last.value - unit.phones.first.value);
}

}  // namespace mouthpiece
