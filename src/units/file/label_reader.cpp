#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "base/errors.h"
#include "units/file/corpus_tables.h"

namespace mouthpiece {
namespace {

constexpr double kMaxTime = 1e6;  ///< seconds; eleven days

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

/// The next `count` rows, all of `take`.
template <typename Read>
void readRows(CheckedQuery& row, const std::string& file, std::size_t take, std::size_t count, const Read& read) {
  for (std::size_t i = 0; i < count; ++i) {
    if (!row.next())
      throw InputError(file, row.table(), fmt::format("take {} has {} rows; expected {}", take, i, count));
    if (row.integer(1) != signedIndex(take)) row.fail(fmt::format("found take {}; expected {}", row.integer(1), take));
    read(i);
  }
}

}  // namespace

LabelReader::LabelReader(SqliteDatabase& database)
    : file_(database.file()),
      words_(database, "words"),
      syllables_(database, "syllables"),
      phones_(database, "phones") {}

LabelReader::LabelReader(SqliteDatabase& database, CheckedQuery::FromId anywhere)
    : file_(database.file()),
      words_(database, "words", anywhere),
      syllables_(database, "syllables", anywhere),
      phones_(database, "phones", anywhere) {}

void LabelReader::startAt(const LabelCounts& before) {
  words_.startAt(signedIndex(before.words));
  syllables_.startAt(signedIndex(before.syllables));
  phones_.startAt(signedIndex(before.phones));
}

SpeechLabels LabelReader::read(std::size_t take, const LabelCounts& counts) {
  SpeechLabels labels;
  readRows(words_, file_, take, counts.words, [&](std::size_t index) {
    reserveRows(labels.words, index, counts.words);
    labels.words.push_back(
        {std::string(words_.text(2)), readRange(words_, 3, counts.phones, firstFreePhone(labels.words))});
  });
  readRows(syllables_, file_, take, counts.syllables, [&](std::size_t index) {
    reserveRows(labels.syllables, index, counts.syllables);
    const PhoneRange range = readRange(syllables_, 2, counts.phones, firstFreePhone(labels.syllables));
    labels.syllables.push_back({range, static_cast<int>(indexBelow(syllables_, 4, 3, "stress"))});
  });
  readRows(phones_, file_, take, counts.phones, [&](std::size_t index) {
    reserveRows(labels.phones, index, counts.phones);
    const auto phone = phoneFromName(phones_.text(2));
    if (!phone)
      phones_.fail(fmt::format("found phone {}; expected an ARPAbet symbol or sil", printable(phones_.text(2))));
    labels.phones.push_back({*phone, readSpan(phones_, 3, labels.phones), readOwner(phones_, 5, labels.words, index),
                             readOwner(phones_, 6, labels.syllables, index)});
  });
  if (const std::string_view fault = faultOf(labels); !fault.empty())
    throw InputError(file_, fmt::format("take {}", take), std::string(fault));
  return labels;
}

void LabelReader::expectEnd() {
  for (CheckedQuery* rows : {&words_, &syllables_, &phones_}) {
    if (rows->next()) rows->fail("is one row too many");
  }
}

}  // namespace mouthpiece
