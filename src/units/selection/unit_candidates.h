#pragma once

#include <vector>

#include "units/selection/selection.h"
#include "units/selection/unit_database.h"

namespace mouthpiece {

/// Fragments that hold phones [first, first + length) of the target.
struct CandidateRun {
  std::size_t length = 0;
  std::vector<PhonePlace> places;
};

/// Places of a pair of phones that looks alike, and how alike (the sum of both visemeDistance()).
struct StandIns {
  double distance = 0;
  std::vector<PhonePlace> places;
};

/// Offers the fragments that may serve a target, from phone to phone.
class UnitCandidates {
 public:
  UnitCandidates(const SpeechLabels& target, const UnitDatabase& database, const SelectionOptions& options);

  /// The longest allowed run from `first` on of which a place at least was seen; length 0 when there is none of two
  /// phones or more.
  [[nodiscard]] CandidateRun longest(std::size_t first) const;
  /// Every run, longest first, its seen places.
  [[nodiscard]] std::vector<CandidateRun> all(std::size_t first) const;
  /// Stand-ins for the pair (first, first + 1): the nearest diphones by viseme class of which a place at least was
  /// seen. Throws MissingPairError when none is near, or there shall be none.
  [[nodiscard]] CandidateRun standIns(std::size_t first) const;
  /// The run's places that were seen.
  [[nodiscard]] CandidateRun seen(CandidateRun run) const;
  /// All pairs next to as near as the nearest, whether their motion was seen or not; empty when none is near. Throws
  /// MissingPairError when there shall be none.
  [[nodiscard]] std::vector<StandIns> standInsNear(std::size_t first) const;
  /// Throws MissingPairError.
  [[noreturn]] void failWithoutStandIn(std::size_t first) const;

 private:
  [[nodiscard]] bool isOfScale(const PhonePlace& place, std::size_t length) const;
  [[nodiscard]] bool isAnySeen(const std::vector<PhonePlace>& places, std::size_t length) const;
  [[noreturn]] void failWithPair(Phone a, Phone b, const char* what) const;
  [[nodiscard]] std::vector<PhonePlace> usable(std::vector<PhonePlace> places, std::size_t length) const;

  std::vector<Phone> phones_;
  const UnitDatabase& database_;
  UnitScales scales_;
  Backoff backoff_;
};

}  // namespace mouthpiece
