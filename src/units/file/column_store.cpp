// The table `phone_columns`: what selection asks of all phones (units/phones/phone_columns.h), each column a row.
#include <fmt/format.h>

#include <algorithm>
#include <cstring>

#include "base/errors.h"
#include "units/file/corpus_tables.h"
#include "units/phones/phone_span_index.h"

namespace mouthpiece {
namespace {

constexpr std::size_t kMostPhones = 100'000'000;  ///< 8 bytes of each must fit a row of SQLite

/// Calls column(name, numbers) for each, in the order of the file.
template <typename Stored, typename Column>
void forEachColumn(Stored& stored, const Column& column) {
  column("take begin", stored.columns->take_begin);
  column("word begin", stored.word_begin);
  column("syllable begin", stored.syllable_begin);
  column("phones", stored.columns->phones);
  column("marks", stored.columns->marks);
  column("durations", stored.columns->durations);
  column("suffixes", stored.columns->suffixes);
}

StoredColumns columnsToStore(const Corpus& corpus) {
  StoredColumns stored{std::make_shared<PhoneColumns>(phoneColumnsOf(corpus)), {0}, {0}};
  stored.columns->suffixes = sortedSuffixes(*stored.columns);
  for (const CorpusTake& take : corpus.takes) {
    stored.word_begin.push_back(stored.word_begin.back() + static_cast<std::uint32_t>(take.labels.words.size()));
    stored.syllable_begin.push_back(stored.syllable_begin.back() +
                                    static_cast<std::uint32_t>(take.labels.syllables.size()));
  }
  return stored;
}

}  // namespace

void writeColumns(CheckedInsert rows, const Corpus& corpus) {
  std::size_t phones = 0;
  for (const CorpusTake& take : corpus.takes) phones += take.labels.phones.size();
  if (phones > kMostPhones) return;
  const StoredColumns stored = columnsToStore(corpus);
  std::int64_t id = 0;
  forEachColumn(stored, [&](std::string_view name, const auto& numbers) {
    const std::string_view bytes(reinterpret_cast<const char*>(numbers.data()),
                                 numbers.size() * sizeof(*numbers.data()));
    rows.integer(id++).text(name).blob(bytes).insert();
  });
}

StoredColumns readColumns(SqliteDatabase& database, std::size_t takes) {
  StoredColumns stored;
  CheckedQuery row(database, "phone_columns");
  if (!row.next()) return stored;
  stored.columns = std::make_shared<PhoneColumns>();
  bool is_first = true;
  forEachColumn(stored, [&](std::string_view name, auto& numbers) {
    if (!std::exchange(is_first, false) && !row.next()) row.fail(fmt::format("has no {}", name));
    if (row.text(1) != name) row.fail(fmt::format("found {}; expected {}", printable(row.text(1)), name));
    const std::string_view bytes = row.blob(2);
    constexpr std::size_t kSize = sizeof(*numbers.data());
    if (bytes.size() % kSize != 0) row.fail(fmt::format("found {} bytes; expected {} a number", bytes.size(), kSize));
    numbers.resize(bytes.size() / kSize);
    if (!bytes.empty()) std::memcpy(numbers.data(), bytes.data(), bytes.size());
  });
  if (row.next()) row.fail("is one row too many");
  if (const std::string_view fault = stored.columns->fault(); !fault.empty())
    throw InputError(database.file(), "phone_columns", std::string(fault));
  const auto isOfTakes = [&](const std::vector<std::uint32_t>& begin) {
    return begin.size() == takes + 1 && std::is_sorted(begin.begin(), begin.end());
  };
  if (!isOfTakes(stored.columns->take_begin) || !isOfTakes(stored.word_begin) || !isOfTakes(stored.syllable_begin))
    throw InputError(database.file(), "phone_columns", fmt::format("are not those of {} takes", takes));
  return stored;
}

std::string faultOfColumns(SqliteDatabase& database, const Corpus& corpus) {
  const StoredColumns found = readColumns(database, corpus.takes.size());
  if (found.columns == nullptr) return "";
  const StoredColumns expected = columnsToStore(corpus);
  const bool is_same = found.word_begin == expected.word_begin && found.syllable_begin == expected.syllable_begin &&
                       *found.columns == *expected.columns;
  return is_same ? "" : "phone_columns: differ from the labels";
}

}  // namespace mouthpiece
