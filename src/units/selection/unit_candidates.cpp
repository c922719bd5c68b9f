#include <fmt/format.h>

#include <algorithm>

#include "base/errors.h"
#include "units/costs/viseme_distance.h"
#include "units/selection/lattice.h"

namespace mouthpiece {
namespace {

/// One of the two phones may lose the contact of its lips: the neighbouring unit still holds that phone whole.
constexpr double kFarthest = 1.75 * kLostContactDistance;

/// A sentence, word or syllable with at most one phone of context on either side, or a diphone.
bool isPaperUnit(const PhoneColumns& columns, const PhonePlace& place, std::size_t length) {
  if (length == 2) return true;
  const auto marksAt = [&](std::size_t phone) { return columns.marks[columns.positionOf(advance(place, phone))]; };
  const auto isEntry = [&](std::size_t first, std::size_t last, unsigned begins, unsigned ends) {
    for (std::size_t i = first; i <= last; ++i) {
      if (((marksAt(i) & begins) != 0) != (i == first)) return false;
    }
    return (marksAt(last) & ends) != 0;
  };
  for (const std::size_t left : {0U, 1U}) {
    for (const std::size_t right : {0U, 1U}) {
      const std::size_t first = left, last = length - 1 - right;
      const bool is_sentence =
          place.phone.value + first == 0 && place.phone.value + last + 1 == columns.phoneCount(place.take);
      if (is_sentence || isEntry(first, last, kBeginsWord, kEndsWord) ||
          isEntry(first, last, kBeginsSyllable, kEndsSyllable))
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

std::vector<PhonePlace> UnitCandidates::placesOfPair(Phone a, Phone b) const {
  constexpr std::size_t kMost = 10'000;
  return database_.diphones(a, b, kMost);
}

bool UnitCandidates::isOfScale(const PhonePlace& place, std::size_t length) const {
  return scales_ == UnitScales::kAny || isPaperUnit(database_.columns(), place, length);
}

void UnitCandidates::failWithPair(std::size_t first, const char* what) const {
  throw MissingPairError(fmt::format("phones {} {}: the corpus {} {}", phoneName(phones_[first]),
                                     phoneName(phones_[first + 1]), database_.corpus().name, what));
}

void UnitCandidates::failWithoutStandIn(std::size_t first) const {
  failWithPair(first, "has neither this pair nor one that looks alike");
}

bool UnitCandidates::isAnySeen(const std::vector<PhonePlace>& places, std::size_t length) const {
  return std::any_of(places.begin(), places.end(),
                     [&](const PhonePlace& place) { return database_.isSeen(place, length); });
}

CandidateRun UnitCandidates::seen(CandidateRun run) const {
  std::erase_if(run.places, [&](const PhonePlace& place) { return !database_.isSeen(place, run.length); });
  return run;
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
    CandidateRun run{length, database_.index().placesOf(rest.first(length))};
    std::erase_if(run.places, [&](const PhonePlace& place) { return !isOfScale(place, length); });
    run = seen(std::move(run));
    if (!run.places.empty()) runs.push_back(std::move(run));
  }
  return runs;
}

std::vector<StandIns> UnitCandidates::standIns(std::size_t first, double beyond_nearest, bool only_seen) const {
  if (backoff_ == Backoff::kNone) failWithPair(first, "lacks this pair");
  std::vector<StandIns> near;
  double farthest = kFarthest;
  for (std::size_t a = 0; a < kPhoneCount; ++a) {
    const double distance_a = visemeDistance(phones_[first], Phone(a), PhonePart::kEnd);
    if (distance_a > farthest) continue;
    for (std::size_t b = 0; b < kPhoneCount; ++b) {
      const double distance = distance_a + visemeDistance(phones_[first + 1], Phone(b), PhonePart::kBegin);
      if (distance > farthest || !database_.hasDiphone(Phone(a), Phone(b))) continue;
      std::vector<PhonePlace> places = placesOfPair(Phone(a), Phone(b));
      if (only_seen && !isAnySeen(places, 2)) continue;
      farthest = std::min(farthest, distance + beyond_nearest);
      near.push_back({distance, std::move(places)});
    }
  }
  std::erase_if(near, [&](const StandIns& stand_ins) { return stand_ins.distance > farthest; });
  return near;
}

CandidateRun UnitCandidates::nearestStandIns(std::size_t first) const {
  const std::vector<StandIns> near = standIns(first, 0, true);
  if (near.empty()) failWithoutStandIn(first);
  return {2, near.front().places};
}

std::vector<StandIns> UnitCandidates::standInsNear(std::size_t first) const {
  constexpr double kNextToNearest = 0.5;
  return standIns(first, kNextToNearest, false);
}

}  // namespace mouthpiece
