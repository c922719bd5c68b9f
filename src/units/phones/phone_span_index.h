#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "units/phones/phone_columns.h"

namespace mouthpiece {

/// The longest prefix that occurs, and where it begins; length 0 and no places when not even the first pair occurs.
struct LongestMatch {
  std::size_t length = 0;
  std::vector<PhonePlace> places;  ///< in the order of the corpus
};

/// Where the suffixes of `columns` begin, each to the end of its take, in the order of their phones; of equal ones the
/// earlier first. O(n log n) for n phones, whatever they repeat.
std::vector<PhoneColumns::Position> sortedSuffixes(const PhoneColumns& columns);

/// Finds runs of phones in the takes of a corpus: a suffix array over all phone labels. A run never crosses from one
/// take into the next. Immutable, safe to share.
class PhoneSpanIndex {
 public:
  /// Not null. Sorts the suffixes where `columns` has none; trusts those that it has only so far that each place that
  /// is found says what was asked for.
  explicit PhoneSpanIndex(std::shared_ptr<const PhoneColumns> columns);

  /// O(length * log n + places).
  [[nodiscard]] LongestMatch longestMatch(std::span<const Phone> phones) const;

  /// Every place where all of `phones` occurs; same cost. Everywhere, when `phones` is empty.
  [[nodiscard]] std::vector<PhonePlace> placesOf(std::span<const Phone> phones) const;

  [[nodiscard]] const PhoneColumns& columns() const { return *columns_; }
  [[nodiscard]] std::size_t phoneCount() const { return columns_->phoneCount(); }

 private:
  using Position = PhoneColumns::Position;
  [[nodiscard]] std::size_t commonPrefix(std::span<const Phone> phones, Position suffix) const;
  /// The rows whose suffixes begin with `phones`; without any both are where they would be.
  [[nodiscard]] std::pair<std::size_t, std::size_t> rowsOf(std::span<const Phone> phones) const;

  std::shared_ptr<const PhoneColumns> columns_;
  std::vector<Position> sorted_;        ///< here, where the columns have none
  std::span<const Position> suffixes_;  ///< those, or the columns'
  std::vector<bool> is_last_;           ///< by phone: the take ends there
};

}  // namespace mouthpiece
