#include "units/phones/phone_span_index.h"

#include <algorithm>
#include <array>
#include <utility>

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

/// Prefix doubling: suffixes sorted by their first `length` phones give, as pairs of ranks, the order by twice as many.
/// The first round packs eight phones into one key, so ordinary speech is sorted after two or three.
std::vector<PhoneColumns::Position> sortedSuffixes(const PhoneColumns& columns) {
  using Position = PhoneColumns::Position;
  const std::vector<Phone>& phones = columns.phones;
  const std::size_t n = phones.size();
  std::vector<Position> suffixes(n);
  if (n == 0) return suffixes;
  std::vector<Position> take_end;
  take_end.reserve(n);
  for (std::size_t take = 0; take < columns.takeCount(); ++take)
    take_end.resize(columns.endOf(TakeIndex(take)), columns.endOf(TakeIndex(take)));
  constexpr std::size_t kPacked = 8;
  std::vector<KeyedSuffix> entries(n), room;
  for (std::size_t i = 0; i < n; ++i) {
    std::uint64_t key = 0;
    for (std::size_t k = 0; k < kPacked; ++k) {
      key = key << 8U | (i + k < take_end[i] ? static_cast<std::uint64_t>(phones[i + k]) + 1 : 0);
    }
    entries[i] = {key, static_cast<Position>(i)};
  }
  std::vector<Position> rank(n);
  for (std::size_t length = kPacked;; length *= 2) {
    radixSort(entries, room);  // equal keys keep the order of the corpus, so the whole order is unique
    Position distinct = 1;
    bool longer_exists = false;
    rank[entries[0].suffix] = 1;
    const auto goesOn = [&](const KeyedSuffix& entry) { return entry.suffix + length < take_end[entry.suffix]; };
    for (std::size_t k = 1; k < n; ++k) {
      const bool same = entries[k].key == entries[k - 1].key;
      if (!same) ++distinct;
      longer_exists = longer_exists || (same && (goesOn(entries[k]) || goesOn(entries[k - 1])));
      rank[entries[k].suffix] = distinct;
    }
    if (!longer_exists) break;  // what is still equal is equal to the end of its take
    for (std::size_t i = 0; i < n; ++i) {
      const std::uint64_t rest = i + length < take_end[i] ? rank[i + length] : 0;
      entries[i] = {std::uint64_t{rank[i]} << 32U | rest, static_cast<Position>(i)};
    }
  }
  for (std::size_t k = 0; k < n; ++k) suffixes[k] = entries[k].suffix;
  return suffixes;
}

PhoneSpanIndex::PhoneSpanIndex(std::shared_ptr<const PhoneColumns> columns)
    : columns_(std::move(columns)), is_last_(columns_->phoneCount()) {
  if (columns_->suffixes.empty()) sorted_ = sortedSuffixes(*columns_);
  suffixes_ = columns_->suffixes.empty() ? sorted_ : columns_->suffixes;
  for (const Position begin : columns_->take_begin) {
    if (begin > 0) is_last_[begin - 1] = true;
  }
}

std::size_t PhoneSpanIndex::commonPrefix(std::span<const Phone> phones, Position suffix) const {
  const std::vector<Phone>& all = columns_->phones;
  std::size_t length = 0;
  while (length < phones.size() && phones[length] == all[suffix + length]) {
    if (is_last_[suffix + length++]) break;
  }
  return length;
}

std::pair<std::size_t, std::size_t> PhoneSpanIndex::rowsOf(std::span<const Phone> phones) const {
  const auto below = [this](Position suffix, std::span<const Phone> wanted) {
    const std::size_t common = commonPrefix(wanted, suffix);
    if (common == wanted.size()) return false;
    return (common > 0 && is_last_[suffix + common - 1]) || columns_->phones[suffix + common] < wanted[common];
  };
  const auto first = std::lower_bound(suffixes_.begin(), suffixes_.end(), phones, below);
  const auto beyond = std::partition_point(
      first, suffixes_.end(), [&](Position suffix) { return commonPrefix(phones, suffix) == phones.size(); });
  return {unsignedIndex(first - suffixes_.begin()), unsignedIndex(beyond - suffixes_.begin())};
}

LongestMatch PhoneSpanIndex::longestMatch(std::span<const Phone> phones) const {
  if (suffixes_.empty() || phones.size() < 2) return {};
  // The suffix nearest in the order shares the longest prefix.
  const std::size_t row = rowsOf(phones).first;
  const std::size_t above = row < suffixes_.size() ? commonPrefix(phones, suffixes_[row]) : 0;
  const std::size_t below = row > 0 ? commonPrefix(phones, suffixes_[row - 1]) : 0;
  const std::size_t length = std::max(above, below);
  if (length < 2) return {};
  return {length, placesOf(phones.first(length))};
}

std::vector<PhonePlace> PhoneSpanIndex::placesOf(std::span<const Phone> phones) const {
  const auto [first, beyond] = rowsOf(phones);
  std::vector<Position> found;
  for (const Position suffix : suffixes_.subspan(first, beyond - first)) {
    if (commonPrefix(phones, suffix) == phones.size()) found.push_back(suffix);
  }
  std::sort(found.begin(), found.end());
  return columns_->placesOf(found.data(), found.data() + found.size());
}

}  // namespace mouthpiece
