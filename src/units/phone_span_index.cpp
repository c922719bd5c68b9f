#include "units/phone_span_index.h"

#include <algorithm>
#include <numeric>

namespace mouthpiece {

PhoneSpanIndex::PhoneSpanIndex(const std::vector<std::vector<Phone>>& takes) {
  for (std::size_t take = 0; take < takes.size(); ++take) {
    const std::size_t end = phones_.size() + takes[take].size();
    for (std::size_t phone = 0; phone < takes[take].size(); ++phone) {
      phones_.push_back(takes[take][phone]);
      take_end_.push_back(end);
      places_.push_back({TakeIndex(take), PhoneIndex(phone)});
    }
  }
  sortSuffixes();
  measureCommonPrefixes();
}

/// Prefix doubling: suffixes sorted by their first `length` phones give, as pairs of ranks, the order by twice as many.
/// The first round packs eight phones into one key, so ordinary speech is sorted after two or three.
void PhoneSpanIndex::sortSuffixes() {
  const std::size_t n = phones_.size();
  suffixes_.resize(n);
  std::iota(suffixes_.begin(), suffixes_.end(), std::size_t{0});
  if (n == 0) return;
  constexpr std::size_t kPacked = 8;
  std::vector<std::uint64_t> key(n);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t k = 0; k < kPacked; ++k) {
      const std::uint64_t symbol = i + k < take_end_[i] ? static_cast<std::uint64_t>(phones_[i + k]) + 1 : 0;
      key[i] = key[i] << 8U | symbol;
    }
  }
  // Equal keys keep the order of the corpus, so the whole order is unique.
  const auto by_key = [&](std::size_t a, std::size_t b) { return key[a] != key[b] ? key[a] < key[b] : a < b; };
  std::vector<std::uint64_t> rank(n);
  for (std::size_t length = kPacked;; length *= 2) {
    std::sort(suffixes_.begin(), suffixes_.end(), by_key);
    std::uint64_t distinct = 1;
    bool longer_exists = false;
    rank[suffixes_[0]] = 1;
    const auto goesOn = [&](std::size_t suffix) { return suffix + length < take_end_[suffix]; };
    for (std::size_t k = 1; k < n; ++k) {
      const bool same = key[suffixes_[k]] == key[suffixes_[k - 1]];
      if (!same) ++distinct;
      longer_exists = longer_exists || (same && (goesOn(suffixes_[k]) || goesOn(suffixes_[k - 1])));
      rank[suffixes_[k]] = distinct;
    }
    if (!longer_exists) return;  // what is still equal is equal to the end of its take
    for (std::size_t i = 0; i < n; ++i) {
      key[i] = rank[i] << 32U | (i + length < take_end_[i] ? rank[i + length] : 0);
    }
  }
}

/// Kasai et al. 2001: walking the suffixes in the order of the text, the common prefix shrinks by one at most.
void PhoneSpanIndex::measureCommonPrefixes() {
  const std::size_t n = phones_.size();
  common_prefix_.assign(n, 0);
  std::vector<std::size_t> row_of(n);
  for (std::size_t k = 0; k < n; ++k) row_of[suffixes_[k]] = k;
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
    common_prefix_[row_of[i]] = common;
    if (common > 0) --common;
  }
}

std::size_t PhoneSpanIndex::commonPrefix(std::span<const Phone> phones, std::size_t suffix) const {
  const std::size_t most = std::min(phones.size(), take_end_[suffix] - suffix);
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
  return static_cast<std::size_t>(row - suffixes_.begin());
}

/// The rows beside `row` that share `length` phones with it.
std::vector<PhonePlace> PhoneSpanIndex::placesAround(std::size_t row, std::size_t length) const {
  std::size_t first = row;
  while (first > 0 && common_prefix_[first] >= length) --first;
  std::size_t last = row;
  while (last + 1 < suffixes_.size() && common_prefix_[last + 1] >= length) ++last;
  std::vector<PhonePlace> places;
  places.reserve(last - first + 1);
  for (std::size_t k = first; k <= last; ++k) places.push_back(places_[suffixes_[k]]);
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
