#include <algorithm>

#include "units/selection/lattice.h"

namespace mouthpiece {

bool isCovered(const SpeechLabels& target, const UnitDatabase& database, const SelectionOptions& options) {
  const UnitCandidates candidates(target, database, options);
  const auto is_seen = [&](const PhonePlace& place) {
    return database.shapeOf(place).captured().allFinite() && database.shapeOf(advance(place, 1)).captured().allFinite();
  };
  const auto any_seen = [&](const std::vector<PhonePlace>& places) {
    return std::any_of(places.begin(), places.end(), is_seen);
  };
  for (std::size_t first = 0; first + 1 < target.phones.size(); ++first) {
    if (any_seen(database.diphones(target.phones[first].phone, target.phones[first + 1].phone))) continue;
    if (options.backoff == Backoff::kNone) return false;
    const std::vector<StandIns> near = candidates.standInsNear(first);
    if (std::none_of(near.begin(), near.end(), [&](const StandIns& own) { return any_seen(own.places); })) return false;
  }
  return true;
}

}  // namespace mouthpiece
