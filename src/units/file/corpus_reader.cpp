#include <fmt/format.h>
#include <sqlite3.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <optional>
#include <span>
#include <unordered_set>

#include "base/errors.h"
#include "base/text_encoding.h"
#include "motion/position_limits.h"
#include "units/file/corpus_tables.h"
#include "units/file/packed_rows.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kMaxTakes = 1'000'000;

std::uint32_t bigEndian32(std::string_view header, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) value = value << 8U | static_cast<unsigned char>(header[at + i]);
  return value;
}

bool isDatabase(std::string_view bytes) { return bytes.starts_with(std::string_view("SQLite format 3\0", 16)); }

/// Tells apart, before SQLite sees the file: no file, no database, another database, a newer corpus, a cut one. Returns
/// the format version.
std::uint32_t checkHeader(const fs::path& path) {
  const std::string file = path.string();
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (!fs::exists(status)) throw InputError(file, "", "no such file");
  if (!fs::is_regular_file(status)) throw InputError(file, "", "is no regular file; expected a corpus database");
  const std::uint64_t size = fs::file_size(path, error);
  std::ifstream stream(path, std::ios::binary);
  if (error || !stream) throw InputError(file, "", fmt::format("cannot be read: {}", std::strerror(errno)));
  std::string header(100, '\0');
  stream.read(header.data(), std::ssize(header));
  if (!stream || !isDatabase(header)) {
    header.resize(unsignedIndex(stream.gcount()));
    const std::string_view kind = kindOfNoText(header);
    throw InputError(
        file, "",
        fmt::format("is {}; expected a file made by `corpus build`", kind.empty() ? "no corpus database" : kind));
  }
  if (!beginsAsCorpus(header))
    throw InputError(file, "", "is an SQLite database but no corpus; expected a file made by `corpus build`");
  const std::uint32_t version = bigEndian32(header, 60);
  if (version > static_cast<std::uint32_t>(kCorpusFormatVersion)) {
    throw InputError(file, "",
                     fmt::format("has corpus format version {}, made by a newer Mouthpiece; expected at most {}",
                                 version, kCorpusFormatVersion));
  }
  if (version == 0)
    throw InputError(file, "", fmt::format("has corpus format version 0; expected {}", kCorpusFormatVersion));
  const std::uint64_t page = bigEndian32(header, 16) >> 16U;
  const std::uint64_t expected = (page == 1 ? 65536 : page) * bigEndian32(header, 28);
  if (size < expected) throw InputError(file, "", fmt::format("is cut off: {} bytes; expected {}", size, expected));
  return version;
}

std::span<const CorpusTable> tablesOf(std::uint32_t version) {
  return std::span(kCorpusTables).first(kTablesOfVersion.at(version - 1));
}

/// The tables are ours to the letter: no view, trigger, index or computed column can run or hide behind their names.
void checkSchema(SqliteDatabase& database, std::uint32_t version) {
  struct Found {
    std::span<const CorpusTable> tables;
    std::size_t count = 0;
    bool as_ours = true;
  } found{tablesOf(version)};
  const auto visit = [](void* context, int columns, char** values, char**) {
    auto& state = *static_cast<Found*>(context);
    const auto* table = state.count < state.tables.size() ? &state.tables[state.count] : nullptr;
    ++state.count;
    state.as_ours =
        state.as_ours && table != nullptr && columns == 1 && values[0] != nullptr && table->sql == values[0];
    return state.as_ours ? 0 : 1;
  };
  const int code =
      sqlite3_exec(database.handle(), "SELECT sql FROM sqlite_schema ORDER BY rowid", visit, &found, nullptr);
  if (code != SQLITE_OK && code != SQLITE_ABORT) database.fail(code);
  if (!found.as_ours || found.count != found.tables.size()) {
    throw InputError(database.file(), "", fmt::format("its tables are not those of corpus format version {}", version));
  }
}

/// Returns the number of takes that the file promises.
std::size_t readMeta(SqliteDatabase& database, Corpus& corpus) {
  CheckedQuery row(database, "meta");
  std::optional<std::size_t> takes;
  while (row.next()) {
    const std::string_view key = row.text(1);
    const std::string_view value = row.text(2);
    if (key == "takes") {
      std::int64_t count = -1;
      const auto [end, code] = std::from_chars(value.data(), value.data() + value.size(), count);
      if (code != std::errc() || end != value.data() + value.size() || count < 0 || count > kMaxTakes) {
        row.fail(fmt::format("found {} takes; expected 0 to {}", printable(value), kMaxTakes));
      }
      takes = unsignedIndex(count);
    } else if (key.starts_with("log:")) {
      corpus.build_log.emplace(key.substr(4), value);
    } else {
      row.fail(fmt::format("found key {}; expected takes or log:...", printable(key)));
    }
  }
  if (!takes) throw InputError(database.file(), "meta", "has no number of takes");
  return *takes;
}

MarkerLayout readLayout(SqliteDatabase& database) {
  CheckedQuery row(database, "layout");
  if (!row.next()) throw InputError(database.file(), "layout", "is missing");
  return parseLayout(row.text(1), database.file());
}

MarkerPositions readNeutralPose(SqliteDatabase& database, const MarkerLayout& layout) {
  MarkerPositions pose(signedIndex(layout.markers.size()), 3);
  CheckedQuery row(database, "neutral_pose");
  std::size_t count = 0;
  for (; row.next(); ++count) {
    expectId(row, count);
    if (count == layout.markers.size() || row.text(1) != layout.markers[count].name)
      row.fail("marker differs from the layout's");
    for (int axis = 0; axis < 3; ++axis) {
      const double value = row.real(2 + axis);
      if (!(std::abs(value) <= kMaxPositionMm)) row.fail(fmt::format("found position {} mm", value));
      pose(signedIndex(count), axis) = value;
    }
  }
  if (count != layout.markers.size()) {
    throw InputError(database.file(), "neutral_pose",
                     fmt::format("has {} markers; expected {}", count, layout.markers.size()));
  }
  return pose;
}

std::vector<TakeSizes> readTakes(SqliteDatabase& database, std::size_t promised, Corpus& corpus) {
  std::vector<TakeSizes> sizes;
  std::unordered_set<std::string> names;
  for (CheckedQuery row(database, "takes"); row.next();) {
    expectId(row, sizes.size());
    CorpusTake& take = corpus.takes.emplace_back();
    sizes.push_back(readTake(row, database.file(), take));
    if (take.name.empty() || !names.insert(take.name).second)
      row.fail(fmt::format("found the name '{}'; expected one that no other take has", printable(take.name)));
  }
  if (sizes.size() != promised)
    throw InputError(database.file(), "takes", fmt::format("has {} rows; expected {}", sizes.size(), promised));
  return sizes;
}

/// Calls read(row, take) for each row of a table that has one a take.
template <typename Read>
void readTakeRows(SqliteDatabase& database, const char* table, std::size_t takes, const Read& read) {
  CheckedQuery row(database, table);
  std::size_t take = 0;
  for (; row.next(); ++take) {
    expectId(row, take);
    if (take == takes) row.fail("no such take");
    read(row, take);
  }
  if (take != takes) throw InputError(database.file(), table, fmt::format("has {} rows; expected {}", take, takes));
}

struct OpenCorpus {
  SqliteDatabase database;
  std::uint32_t version;
};

OpenCorpus openCorpus(const fs::path& path) {
  const std::uint32_t version = checkHeader(path);
  SqliteDatabase database = SqliteDatabase::openReadOnly(path);
  checkSchema(database, version);
  return {std::move(database), version};
}

/// Their JSON is looked into by who uses it; here it is only what was written.
void readVisemePoses(SqliteDatabase& database, Corpus& corpus) {
  CheckedQuery row(database, "viseme_poses");
  if (!row.next()) return;
  expectId(row, 0);
  corpus.viseme_poses = row.text(1);
  if (corpus.viseme_poses.empty()) row.fail("found no text; expected viseme poses");
  if (row.next()) row.fail("found a second row; expected one");
}

/// Every row of every table against its checksum.
void checkRows(OpenCorpus& corpus, std::vector<std::string>& problems) {
  constexpr std::size_t kMostProblems = 100;
  SqliteDatabase& database = corpus.database;
  for (const CorpusTable& table : tablesOf(corpus.version)) {
    try {
      for (CheckedQuery row(database, std::string(table.name)); row.nextUnchecked();) {
        if (problems.size() >= kMostProblems) return;
        if (!row.isIntact()) problems.push_back(fmt::format("{}:{}: checksum differs", database.file(), row.place()));
      }
    } catch (const InputError& error) {
      problems.emplace_back(error.what());
    }
  }
}

}  // namespace

bool beginsAsCorpus(std::string_view bytes) {
  return bytes.size() >= 72 && isDatabase(bytes) && bigEndian32(bytes, 68) == kCorpusApplicationId;
}

Corpus readCorpus(const fs::path& path, CorpusAudio audio, CorpusMotion motion) {
  OpenCorpus open = openCorpus(path);
  SqliteDatabase& database = open.database;
  Corpus corpus;
  corpus.name = path.stem().string();
  const std::size_t promised = readMeta(database, corpus);
  corpus.layout = readLayout(database);
  corpus.neutral_pose_mm = readNeutralPose(database, corpus.layout);
  StoredColumns stored;
  if (motion == CorpusMotion::kTakesOnDemand && open.version > 6) stored = readColumns(database, promised);
  corpus.phone_columns = stored.columns;
  std::vector<TakeSizes> sizes;
  if (corpus.phone_columns == nullptr) {
    sizes = readTakes(database, promised, corpus);
    LabelReader labels(database);
    for (std::size_t take = 0; take < sizes.size(); ++take)
      corpus.takes[take].labels = labels.read(take, sizes[take].labels);
    labels.expectEnd();
  }
  if (open.version > 1) readTrajectoryModel(database, corpus);
  if (open.version > 2) readVisemePoses(database, corpus);
  if (motion == CorpusMotion::kLoad) {
    readTakeRows(database, "motion", sizes.size(), [&](const CheckedQuery& row, std::size_t take) {
      corpus.takes[take].motion.marker_names = corpus.layout.markerNames();
      readPositions(row, sizes[take].frames, corpus.takes[take].motion);
    });
  }
  if (audio == CorpusAudio::kLoad) {
    readTakeRows(database, "audio", sizes.size(), [&](const CheckedQuery& row, std::size_t take) {
      readSamples(row, sizes[take].samples, corpus.takes[take].audio);
    });
  }
  if (motion != CorpusMotion::kLoad)
    corpus.take_source = takeSourceOf(std::move(database), std::move(sizes), std::move(stored), corpus);
  return corpus;
}

std::vector<std::string> checkCorpus(const fs::path& path) {
  std::vector<std::string> problems;
  try {
    OpenCorpus corpus = openCorpus(path);
    checkRows(corpus, problems);
    if (problems.empty()) {
      const Corpus read = readCorpus(path, CorpusAudio::kLoad);
      if (read.trajectory_model != nullptr) readAllShapes(corpus.database, read);
      if (corpus.version > 6) {
        if (const std::string fault = faultOfColumns(corpus.database, read); !fault.empty())
          problems.push_back(fmt::format("{}:{}", corpus.database.file(), fault));
      }
    }
  } catch (const InputError& error) {
    problems.emplace_back(error.what());
  }
  return problems;
}

}  // namespace mouthpiece
