#pragma once

#include "units/selection/selection.h"
#include "units/selection/unit_database.h"

namespace mouthpiece {

/// The costs of one target utterance's candidates. Refers to the utterance and the database.
class UnitCosts {
 public:
  UnitCosts(const SpeechLabels& target, const UnitDatabase& database, const SelectionOptions& options);

  /// Duration, context, word position and stress of the fragment at `source` for the phones `range`: from labels alone.
  [[nodiscard]] double labelCost(const PhoneRange& range, const PhonePlace& source) const;
  /// The same and closures, which only the fragment's motion tells.
  [[nodiscard]] double targetCost(const PhoneRange& range, const PhonePlace& source) const;

  /// Least mismatch of the lips inside the target's phone `shared`, which ends one unit as the corpus' phone `before`
  /// and begins the next one as `after`.
  [[nodiscard]] double joinCost(PhoneIndex shared, const PhonePlace& before, const PhonePlace& after) const;

 private:
  struct Place {  ///< of a phone in its word
    bool begins_word = false;
    bool ends_word = false;
    bool stressed = false;
  };
  [[nodiscard]] static Place placeOf(const SpeechLabels& labels, std::size_t phone);
  [[nodiscard]] double contextCost(const PhoneRange& range, const PhonePlace& source) const;

  const SpeechLabels& target_;
  const UnitDatabase& database_;
  SelectionWeights weights_;
  decltype(SelectionOptions::sound_join_cost) sound_join_cost_;
};

/// `place` moved on by `phones` phones.
inline PhonePlace advance(const PhonePlace& place, std::size_t phones) {
  return {place.take, PhoneIndex(place.phone.value + phones)};
}

}  // namespace mouthpiece
