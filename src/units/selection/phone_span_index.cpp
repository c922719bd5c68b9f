#include "units/selection/phone_span_index.h"

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

#include "base/errors.h"

namespace mouthpiece {
namespace {

/// A suffix and what it is sorted by.
struct KeyedSuffix {
  std::uint64_t key;
  std::uint32_t suffix;
};

/// By key; equal keys keep their order. Digits from the lowest up, those that are the same in all keys skipped.
void radixSort(std::vector<KeyedSuffix>& entries, std::vector<KeyedSuffix>& room) {
  constexpr unsigned kDigitBits = 11;
  constexpr std::size_t kDigits = std::size_t{1} << kDigitBits;
  room.resize(entries.size());
  for (unsigned shift = 0; shift < 64; shift += kDigitBits) {
    const auto digitOf = [&](const KeyedSuffix& entry) { return (entry.key >> shift) % kDigits; };
    std::array<std::uint32_t, kDigits> next{};
    for (const KeyedSuffix& entry : entries) ++next[digitOf(entry)];
    if (next[digitOf(entries.front())] == entries.size()) continue;
    std::uint32_t before = 0;
    for (std::uint32_t& count : next) before += std::exchange(count, before);
    for (const KeyedSuffix& entry : entries) room[next[digitOf(entry)]++] = entry;
    entries.swap(room);
  }
}

}  // namespace

PhoneSpanIndex::PhoneSpanIndex(const std::vector<std::vector<Phone>>& takes) {
  std::size_t count = 0;
  for (const std::vector<Phone>& take : takes) count += take.size();
  MOUTHPIECE_EXPECT(count <= std::numeric_limits<std::int32_t>::max());
  phones_.reserve(count);
  take_end_.reserve(count);
  take_begin_.reserve(takes.size());
  for (const std::vector<Phone>& take : takes) {
    take_begin_.push_back(static_cast<Position>(phones_.size()));
    phones_.insert(phones_.end(), take.begin(), take.end());
    take_end_.resize(phones_.size(), static_cast<Position>(phones_.size()));
  }
  sortSuffixes();
  measureCommonPrefixes();
}

PhonePlace PhoneSpanIndex::placeOf(Position position) const {
  // The last take that begins there or before: one without phones begins where the next does.
  const auto after = std::upper_bound(take_begin_.begin(), take_begin_.end(), position);
  return {TakeIndex(unsignedIndex(after - take_begin_.begin()) - 1), PhoneIndex(position - *(after - 1))};
}

/// Prefix doubling: suffixes sorted by their first `length` phones give, as pairs of ranks, the order by twice as many.
/// The first round packs eight phones into one key, so ordinary speech is sorted after two or three.
void PhoneSpanIndex::sortSuffixes() {
  const std::size_t n = phones_.size();
  suffixes_.resize(n);
  if (n == 0) return;
  constexpr std::size_t kPacked = 8;
  std::vector<KeyedSuffix> entries(n), room;
  for (std::size_t i = 0; i < n; ++i) {
    std::uint64_t key = 0;
    for (std::size_t k = 0; k < kPacked; ++k) {
      key = key << 8U | (i + k < take_end_[i] ? static_cast<std::uint64_t>(phones_[i + k]) + 1 : 0);
    }
    entries[i] = {key, static_cast<Position>(i)};
  }
  std::vector<Position> rank(n);
  for (std::size_t length = kPacked;; length *= 2) {
    radixSort(entries, room);  // equal keys keep the order of the corpus, so the whole order is unique
    Position distinct = 1;
    bool longer_exists = false;
    rank[entries[0].suffix] = 1;
    const auto goesOn = [&](const KeyedSuffix& entry) { return entry.suffix + length < take_end_[entry.suffix]; };
    for (std::size_t k = 1; k < n; ++k) {
      const bool same = entries[k].key == entries[k - 1].key;
      if (!same) ++distinct;
      longer_exists = longer_exists || (same && (goesOn(entries[k]) || goesOn(entries[k - 1])));
      rank[entries[k].suffix] = distinct;
    }
    if (!longer_exists) break;  // what is still equal is equal to the end of its take
    for (std::size_t i = 0; i < n; ++i) {
      const std::uint64_t rest = i + length < take_end_[i] ? rank[i + length] : 0;
      entries[i] = {std::uint64_t{rank[i]} << 32U | rest, static_cast<Position>(i)};
    }
  }
  for (std::size_t k = 0; k < n; ++k) suffixes_[k] = entries[k].suffix;
}

/// Kasai et al. 2001: walking the suffixes in the order of the text, the common prefix shrinks by one at most.
void PhoneSpanIndex::measureCommonPrefixes() {
  const std::size_t n = phones_.size();
  common_prefix_.assign(n, 0);
  std::vector<Position> row_of(n);
  for (std::size_t k = 0; k < n; ++k) row_of[suffixes_[k]] = static_cast<Position>(k);
  std::size_t common = 0;
  for (std::size_t i = 0; i < n; ++i) {
    if (row_of[i] == 0) {
      common = 0;
      continue;
    }
    const std::size_t other = suffixes_[row_of[i] - 1];
    while (i + common < take_end_[i] && other + common < take_end_[other] &&
           phones_[i + common] == phones_[other + common]) {
      ++common;
    }
    common_prefix_[row_of[i]] = static_cast<Position>(common);
    if (common > 0) --common;
  }
}

std::size_t PhoneSpanIndex::commonPrefix(std::span<const Phone> phones, std::size_t suffix) const {
  const std::size_t most = std::min<std::size_t>(phones.size(), take_end_[suffix] - suffix);
  std::size_t length = 0;
  while (length < most && phones[length] == phones_[suffix + length]) ++length;
  return length;
}

/// First row whose suffix is not below `phones`.
std::size_t PhoneSpanIndex::lowerBound(std::span<const Phone> phones) const {
  const auto below = [this](std::size_t suffix, std::span<const Phone> wanted) {
    const std::size_t common = commonPrefix(wanted, suffix);
    if (common == wanted.size()) return false;
    return suffix + common == take_end_[suffix] || phones_[suffix + common] < wanted[common];
  };
  const auto row = std::lower_bound(suffixes_.begin(), suffixes_.end(), phones, below);
  return unsignedIndex(row - suffixes_.begin());
}

/// The rows beside `row` that share `length` phones with it.
std::vector<PhonePlace> PhoneSpanIndex::placesAround(std::size_t row, std::size_t length) const {
  std::size_t first = row;
  while (first > 0 && common_prefix_[first] >= length) --first;
  std::size_t last = row;
  while (last + 1 < suffixes_.size() && common_prefix_[last + 1] >= length) ++last;
  std::vector<PhonePlace> places;
  places.reserve(last - first + 1);
  for (std::size_t k = first; k <= last; ++k) places.push_back(placeOf(suffixes_[k]));
  std::sort(places.begin(), places.end());
  return places;
}

LongestMatch PhoneSpanIndex::longestMatch(std::span<const Phone> phones) const {
  if (suffixes_.empty() || phones.size() < 2) return {};
  // The suffix nearest in the order shares the longest prefix.
  const std::size_t row = lowerBound(phones);
  const std::size_t above = row < suffixes_.size() ? commonPrefix(phones, suffixes_[row]) : 0;
  const std::size_t below = row > 0 ? commonPrefix(phones, suffixes_[row - 1]) : 0;
  const std::size_t length = std::max(above, below);
  if (length < 2) return {};
  return {length, placesAround(above >= below ? row : row - 1, length)};
}

std::vector<PhonePlace> PhoneSpanIndex::placesOf(std::span<const Phone> phones) const {
  const std::size_t row = lowerBound(phones);
  if (row == suffixes_.size() || commonPrefix(phones, suffixes_[row]) < phones.size()) return {};
  return placesAround(row, phones.size());
}

}  // namespace mouthpiece
