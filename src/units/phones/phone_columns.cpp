#include "units/phones/phone_columns.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "base/errors.h"

namespace mouthpiece {
namespace {

template <typename Tier>
unsigned edgesOf(const Tier& tier, std::optional<std::size_t> entry, std::size_t phone) {
  if (!entry) return 0;
  const PhoneRange& range = tier[*entry].phones;
  return (range.first.value == phone ? 1U : 0U) | (range.last.value == phone ? 2U : 0U);  // kBegins..., kEnds...
}

/// Beyond the ends of a part of a line nothing is known: as a pause.
bool isSilent(const SpeechLabels& labels, std::size_t phone) {
  return phone >= labels.phones.size() || labels.phones[phone].phone == Phone::kSil;
}

std::uint8_t marksOf(const SpeechLabels& labels, std::size_t phone) {
  const LabelledPhone& own = labels.phones[phone];
  unsigned marks = edgesOf(labels.syllables, own.syllable, phone) | edgesOf(labels.words, own.word, phone) << 2U;
  if (own.phone != Phone::kSil)  // below zero it wraps and is beyond the end
    marks |= (isSilent(labels, phone - 1) ? kBeginsPhrase : 0U) | (isSilent(labels, phone + 1) ? kEndsPhrase : 0U);
  if (own.syllable && labels.syllables[*own.syllable].stress > 0) marks |= PhoneColumns::kStressed;
  return static_cast<std::uint8_t>(marks);
}

}  // namespace

void PhoneColumns::add(const SpeechLabels& labels, bool is_adapted) {
  MOUTHPIECE_EXPECT(phones.size() + labels.phones.size() <= std::numeric_limits<std::int32_t>::max());
  for (std::size_t i = 0; i < labels.phones.size(); ++i) {
    phones.push_back(labels.phones[i].phone);
    marks.push_back(marksOf(labels, i) | (is_adapted ? kAdapted : 0));
    durations.push_back(labels.phones[i].span.duration());
  }
  take_begin.push_back(static_cast<Position>(phones.size()));
}

PhonePlace PhoneColumns::placeOf(Position position) const {
  // The last take that begins there or before: one without phones begins where the next does.
  const auto after = std::upper_bound(take_begin.begin(), take_begin.end(), position);
  return {TakeIndex(unsignedIndex(after - take_begin.begin()) - 1), PhoneIndex(position - *(after - 1))};
}

std::vector<PhonePlace> PhoneColumns::placesOf(const Position* first, const Position* last) const {
  std::vector<PhonePlace> places;
  places.reserve(unsignedIndex(last - first));
  auto after = take_begin.begin();
  for (; first != last; ++first) {
    std::ptrdiff_t step = 1;  // most are in the same take or soon after it
    while (take_begin.end() - after > step && after[step] <= *first) step *= 2;
    after = std::upper_bound(after, after + std::min(step, take_begin.end() - after), *first);
    places.push_back({TakeIndex(unsignedIndex(after - take_begin.begin()) - 1), PhoneIndex(*first - *(after - 1))});
    --after;
  }
  return places;
}

PhoneFacts PhoneColumns::factsOf(const PhonePlace& place, bool with_logarithms) const {
  constexpr std::size_t kReach = 3;
  const std::size_t begin = take_begin[place.take.value], end = endOf(place.take), own = positionOf(place);
  PhoneFacts facts;
  for (std::size_t i = 0; i < facts.phones.size(); ++i) {
    const std::size_t at = own + i - 2;  // below zero it wraps and is beyond the end
    facts.phones[i] = at >= begin && at < end ? phones[at] : Phone::kSil;
  }
  facts.is_first = own == begin;
  facts.is_last = own + 1 == end;
  facts.edges = marks[own] & 63U;
  facts.is_stressed = (marks[own] & kStressed) != 0;
  facts.duration = durations[own];
  if (!with_logarithms) return facts;
  facts.log_duration = asFloat(std::log(std::max(1e-3, facts.duration)));
  const auto isSpeech = [&](std::size_t at) { return at >= begin && at < end && phones[at] != Phone::kSil; };
  std::size_t first = own, last = own;
  while (own - first < kReach && isSpeech(first - 1)) --first;
  while (last - own < kReach && isSpeech(last + 1)) ++last;
  Seconds length = 0;
  for (std::size_t at = first; at <= last; ++at) length += durations[at];
  facts.log_rate = asFloat(std::log(asReal(last - first + 1) / std::max(length, 1e-3)));
  return facts;
}

std::string_view PhoneColumns::fault() const {
  const std::size_t count = phones.size();
  if (take_begin.empty() || take_begin.front() != 0 || take_begin.back() != count ||
      std::adjacent_find(take_begin.begin(), take_begin.end(), std::greater_equal<>()) != take_begin.end())
    return "takes do not follow each other";
  if (marks.size() != count || durations.size() != count || suffixes.size() != count)
    return "columns are not equally long";
  const auto isPhone = [](Phone phone) { return static_cast<std::size_t>(phone) < kPhoneCount; };
  if (!std::all_of(phones.begin(), phones.end(), isPhone)) return "name phones that there are not";
  if (!std::all_of(durations.begin(), durations.end(), [](Seconds length) { return length > 0 && length <= 1e6; }))
    return "hold times that do not rise";
  if (!std::all_of(suffixes.begin(), suffixes.end(), [count](Position position) { return position < count; }))
    return "name places that there are not";
  return "";
}

}  // namespace mouthpiece
