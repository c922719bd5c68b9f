#include "units/selection/unit_candidates.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "base/errors.h"
#include "units/selection/viseme_distance.h"

namespace mouthpiece {
namespace {

template <typename Tier>
bool isOneOf(const Tier& tier, std::size_t first, std::size_t last) {
  return std::any_of(tier.begin(), tier.end(), [&](const auto& entry) {
    return entry.phones.first.value == first && entry.phones.last.value == last;
  });
}

/// One of the two phones may lose the contact of its lips: the neighbouring unit still holds that phone whole.
constexpr double kFarthest = 1.75 * kLostContactDistance;

/// A sentence, word or syllable with at most one phone of context on either side, or a diphone.
bool isPaperUnit(const SpeechLabels& take, std::size_t first, std::size_t length) {
  if (length == 2) return true;
  const std::size_t last = first + length - 1;
  for (const std::size_t left : {0U, 1U}) {
    for (const std::size_t right : {0U, 1U}) {
      const std::size_t core_first = first + left;
      const std::size_t core_last = last - right;
      const bool is_sentence = core_first == 0 && core_last + 1 == take.phones.size();
      if (is_sentence || isOneOf(take.words, core_first, core_last) || isOneOf(take.syllables, core_first, core_last))
        return true;
    }
  }
  return false;
}

}  // namespace

UnitCandidates::UnitCandidates(const SpeechLabels& target, const UnitDatabase& database,
                               const SelectionOptions& options)
    : database_(database), scales_(options.units), backoff_(options.backoff) {
  for (const LabelledPhone& phone : target.phones) phones_.push_back(phone.phone);
}

std::vector<PhonePlace> UnitCandidates::usable(std::vector<PhonePlace> places, std::size_t length) const {
  std::erase_if(places,
                [&](const PhonePlace& place) { return !isOfScale(place, length) || !database_.isSeen(place, length); });
  return places;
}

bool UnitCandidates::isOfScale(const PhonePlace& place, std::size_t length) const {
  return scales_ == UnitScales::kAny || isPaperUnit(database_.takeOf(place).labels, place.phone.value, length);
}

void UnitCandidates::failWithPair(Phone a, Phone b, const char* what) const {
  throw MissingPairError(
      fmt::format("phones {} {}: the corpus {} {}", phoneName(a), phoneName(b), database_.corpus().name, what));
}

bool UnitCandidates::isAnySeen(const std::vector<PhonePlace>& places, std::size_t length) const {
  return std::any_of(places.begin(), places.end(),
                     [&](const PhonePlace& place) { return database_.isSeen(place, length); });
}

CandidateRun UnitCandidates::longest(std::size_t first) const {
  const std::span<const Phone> rest = std::span(phones_).subspan(first);
  LongestMatch match = database_.index().longestMatch(rest);
  std::vector<PhonePlace> places = std::move(match.places);
  for (std::size_t length = match.length; length >= 2; --length) {
    if (length < match.length) places = database_.index().placesOf(rest.first(length));
    std::erase_if(places, [&](const PhonePlace& place) { return !isOfScale(place, length); });
    if (isAnySeen(places, length)) return {length, std::move(places)};
  }
  return {};
}

std::vector<CandidateRun> UnitCandidates::all(std::size_t first) const {
  const std::span<const Phone> rest = std::span(phones_).subspan(first);
  std::vector<CandidateRun> runs;
  for (std::size_t length = database_.index().longestMatch(rest).length; length >= 2; --length) {
    std::vector<PhonePlace> places = usable(database_.index().placesOf(rest.first(length)), length);
    if (!places.empty()) runs.push_back({length, std::move(places)});
  }
  return runs;
}

CandidateRun UnitCandidates::standIns(std::size_t first) const {
  const Phone wanted_a = phones_[first];
  const Phone wanted_b = phones_[first + 1];
  double nearest = kFarthest;
  CandidateRun run{2, {}};
  if (backoff_ == Backoff::kNone) failWithPair(wanted_a, wanted_b, "lacks this pair");
  for (std::size_t a = 0; a < kPhoneCount; ++a) {
    const double distance_a = visemeDistance(wanted_a, static_cast<Phone>(a), PhonePart::kEnd);
    if (distance_a > nearest) continue;
    for (std::size_t b = 0; b < kPhoneCount; ++b) {
      const double distance = distance_a + visemeDistance(wanted_b, static_cast<Phone>(b), PhonePart::kBegin);
      if (distance > nearest || (distance == nearest && !run.places.empty())) continue;
      std::vector<PhonePlace> places = database_.diphones(static_cast<Phone>(a), static_cast<Phone>(b));
      if (!isAnySeen(places, 2)) continue;
      nearest = distance;
      run.places = std::move(places);
    }
  }
  if (run.places.empty()) failWithoutStandIn(first);
  return run;
}

CandidateRun UnitCandidates::seen(CandidateRun run) const {
  std::erase_if(run.places, [&](const PhonePlace& place) { return !database_.isSeen(place, run.length); });
  return run;
}

std::vector<StandIns> UnitCandidates::standInsNear(std::size_t first) const {
  constexpr double kNextToNearest = 0.5;
  const Phone wanted_a = phones_[first];
  const Phone wanted_b = phones_[first + 1];
  if (backoff_ == Backoff::kNone) failWithPair(wanted_a, wanted_b, "lacks this pair");
  std::vector<StandIns> near;
  double farthest = kFarthest;
  for (std::size_t a = 0; a < kPhoneCount; ++a) {
    const double distance_a = visemeDistance(wanted_a, static_cast<Phone>(a), PhonePart::kEnd);
    if (distance_a > farthest) continue;
    for (std::size_t b = 0; b < kPhoneCount; ++b) {
      const double distance = distance_a + visemeDistance(wanted_b, static_cast<Phone>(b), PhonePart::kBegin);
      const std::vector<PhonePlace>& places = database_.diphones(static_cast<Phone>(a), static_cast<Phone>(b));
      if (distance > farthest || places.empty()) continue;
      farthest = std::min(farthest, distance + kNextToNearest);
      near.push_back({distance, places});
    }
  }
  std::erase_if(near, [&](const StandIns& stand_ins) { return stand_ins.distance > farthest; });
  return near;
}

void UnitCandidates::failWithoutStandIn(std::size_t first) const {
  failWithPair(phones_[first], phones_[first + 1], "has neither this pair nor one that looks alike");
}

}  // namespace mouthpiece
