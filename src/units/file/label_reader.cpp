#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "base/errors.h"
#include "units/file/corpus_tables.h"

namespace mouthpiece {
namespace {

constexpr double kMaxTime = 1e6;  ///< seconds; eleven days

/// Calls read(row, take, index within the take) for each row of `table`, whose rows lie take after take.
template <typename CountOf, typename Read>
void readRowsByTake(SqliteDatabase& database, const char* table, std::size_t takes, CountOf countOf, Read read) {
  CheckedQuery row(database, table);
  for (std::size_t take = 0; take < takes; ++take) {
    for (std::size_t i = 0; i < countOf(take); ++i) {
      if (!row.next())
        throw InputError(database.file(), table,
                         fmt::format("take {} has {} rows; expected {}", take, i, countOf(take)));
      if (row.integer(1) != signedIndex(take))
        row.fail(fmt::format("found take {}; expected {}", row.integer(1), take));
      read(row, take, i);
    }
  }
  if (row.next()) row.fail("is one row too many");
}

std::size_t indexBelow(const CheckedQuery& row, int column, std::size_t size, const char* what) {
  const std::int64_t value = row.integer(column);
  if (value < 0 || value >= signedIndex(size))
    row.fail(fmt::format("found {} {}; expected one of {}", what, value, size));
  return unsignedIndex(value);
}

/// Ranges of a tier follow one another and stay within the take.
PhoneRange readRange(const CheckedQuery& row, int column, std::size_t phones, std::size_t first_free) {
  const std::size_t first = indexBelow(row, column, phones, "phone");
  const std::size_t last = indexBelow(row, column + 1, phones, "phone");
  if (first < first_free || last < first)
    row.fail(fmt::format("found phones {} to {}; expected rising ones from {}", first, last, first_free));
  return {PhoneIndex(first), PhoneIndex(last)};
}

/// Room for a tier when its first row comes; no more than a sentence's, as the file's promise may be a lie.
template <typename Tier>
void reserveRows(Tier& tier, std::size_t index, std::size_t promised) {
  constexpr std::size_t kSentence = 256;
  if (index == 0) tier.reserve(std::min(kSentence, promised));
}

template <typename Tier>
std::size_t firstFreePhone(const Tier& tier) {
  return tier.empty() ? 0 : tier.back().phones.last.value + 1;
}

/// The word or syllable named by a phone must hold it; a phone in none of the tier's ranges names none.
template <typename Tier>
std::optional<std::size_t> readOwner(const CheckedQuery& row, int column, const Tier& tier, std::size_t phone) {
  if (row.isNull(column)) return std::nullopt;
  const std::size_t owner = indexBelow(row, column, tier.size(), "owner");
  if (phone < tier[owner].phones.first.value || phone > tier[owner].phones.last.value)
    row.fail(fmt::format("phone {} does not lie in its word or syllable {}", phone, owner));
  return owner;
}

TimeSpan readSpan(const CheckedQuery& row, int column, const std::vector<LabelledPhone>& before) {
  constexpr double kTolerance = 1e-6;  // seconds; labels come from decimal text
  const TimeSpan span{row.real(column), row.real(column + 1)};
  const bool in_range = span.start >= 0 && span.end <= kMaxTime && span.start < span.end;
  if (!in_range) row.fail(fmt::format("phone from {} s to {} s; expected rising times", span.start, span.end));
  if (!before.empty() && std::abs(span.start - before.back().span.end) > kTolerance) {
    row.fail(fmt::format("phone begins at {} s; expected {} s, where the one before ends", span.start,
                         before.back().span.end));
  }
  return span;
}

}  // namespace

std::vector<SpeechLabels> readLabels(SqliteDatabase& database, const std::vector<LabelCounts>& counts) {
  std::vector<SpeechLabels> labels(counts.size());
  readRowsByTake(
      database, "words", counts.size(), [&](std::size_t take) { return counts[take].words; },
      [&](const CheckedQuery& row, std::size_t take, std::size_t index) {
        auto& words = labels[take].words;
        reserveRows(words, index, counts[take].words);
        words.push_back({std::string(row.text(2)), readRange(row, 3, counts[take].phones, firstFreePhone(words))});
      });
  readRowsByTake(
      database, "syllables", counts.size(), [&](std::size_t take) { return counts[take].syllables; },
      [&](const CheckedQuery& row, std::size_t take, std::size_t index) {
        auto& syllables = labels[take].syllables;
        reserveRows(syllables, index, counts[take].syllables);
        const PhoneRange range = readRange(row, 2, counts[take].phones, firstFreePhone(syllables));
        syllables.push_back({range, static_cast<int>(indexBelow(row, 4, 3, "stress"))});
      });
  readRowsByTake(
      database, "phones", counts.size(), [&](std::size_t take) { return counts[take].phones; },
      [&](const CheckedQuery& row, std::size_t take, std::size_t index) {
        SpeechLabels& own = labels[take];
        reserveRows(own.phones, index, counts[take].phones);
        const auto phone = phoneFromName(row.text(2));
        if (!phone) row.fail(fmt::format("found phone {}; expected an ARPAbet symbol or sil", printable(row.text(2))));
        own.phones.push_back({*phone, readSpan(row, 3, own.phones), readOwner(row, 5, own.words, index),
                              readOwner(row, 6, own.syllables, index)});
      });
  for (std::size_t take = 0; take < labels.size(); ++take) {
    if (const std::string_view fault = faultOf(labels[take]); !fault.empty())
      throw InputError(database.file(), fmt::format("take {}", take), std::string(fault));
  }
  return labels;
}

}  // namespace mouthpiece
