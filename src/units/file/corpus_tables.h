#pragma once

#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

#include "units/file/corpus.h"
#include "units/file/sqlite_database.h"

namespace mouthpiece {

/// "Mpce": tells a corpus from other SQLite files (header bytes 68 to 71).
inline constexpr std::int64_t kCorpusApplicationId = 0x4D706365;

struct CorpusTable {
  std::string_view name;
  std::string_view sql;  ///< the reader accepts this text only, so a file can bring no view, trigger or computed column
  int columns;
};

/// Format version 7 (docs/formats/corpus.md); version 1 ends before `trajectory_model`, version 2 before
/// `viseme_poses`, 3 to 6 before `phone_columns`. `crc` is the row's checksum.
inline constexpr std::array<CorpusTable, 13> kCorpusTables{{
    {"meta",
     "CREATE TABLE meta(id INTEGER PRIMARY KEY, key TEXT NOT NULL, value TEXT NOT NULL, crc INTEGER NOT NULL) STRICT",
     4},
    {"layout", "CREATE TABLE layout(id INTEGER PRIMARY KEY, json TEXT NOT NULL, crc INTEGER NOT NULL) STRICT", 3},
    {"neutral_pose",
     "CREATE TABLE neutral_pose(id INTEGER PRIMARY KEY, marker TEXT NOT NULL, x_mm REAL NOT NULL, y_mm REAL NOT NULL, "
     "z_mm REAL NOT NULL, crc INTEGER NOT NULL) STRICT",
     6},
    {"takes",
     "CREATE TABLE takes(id INTEGER PRIMARY KEY, name TEXT NOT NULL, text TEXT NOT NULL, phones INTEGER NOT NULL, "
     "syllables INTEGER NOT NULL, words INTEGER NOT NULL, frames INTEGER NOT NULL, frame_rate_hz REAL NOT NULL, "
     "samples INTEGER NOT NULL, sample_rate_hz INTEGER NOT NULL, crc INTEGER NOT NULL) STRICT",
     11},
    {"words",
     "CREATE TABLE words(id INTEGER PRIMARY KEY, take INTEGER NOT NULL, text TEXT NOT NULL, first_phone INTEGER NOT "
     "NULL, "
     "last_phone INTEGER NOT NULL, crc INTEGER NOT NULL) STRICT",
     6},
    {"syllables",
     "CREATE TABLE syllables(id INTEGER PRIMARY KEY, take INTEGER NOT NULL, first_phone INTEGER NOT NULL, "
     "last_phone INTEGER NOT NULL, stress INTEGER NOT NULL, crc INTEGER NOT NULL) STRICT",
     6},
    {"phones",
     "CREATE TABLE phones(id INTEGER PRIMARY KEY, take INTEGER NOT NULL, phone TEXT NOT NULL, start_s REAL NOT NULL, "
     "end_s REAL NOT NULL, word INTEGER, syllable INTEGER, crc INTEGER NOT NULL) STRICT",
     8},
    {"motion", "CREATE TABLE motion(id INTEGER PRIMARY KEY, positions_mm BLOB NOT NULL, crc INTEGER NOT NULL) STRICT",
     3},
    {"audio", "CREATE TABLE audio(id INTEGER PRIMARY KEY, samples BLOB NOT NULL, crc INTEGER NOT NULL) STRICT", 3},
    {"trajectory_model",
     "CREATE TABLE trajectory_model(id INTEGER PRIMARY KEY, name TEXT NOT NULL, numbers BLOB NOT NULL, crc INTEGER NOT "
     "NULL) STRICT",
     4},
    {"phone_shapes",
     "CREATE TABLE phone_shapes(id INTEGER PRIMARY KEY, numbers BLOB NOT NULL, crc INTEGER NOT NULL) STRICT", 3},
    {"viseme_poses",
     "CREATE TABLE viseme_poses(id INTEGER PRIMARY KEY, json TEXT NOT NULL, crc INTEGER NOT NULL) STRICT", 3},
    {"phone_columns",
     "CREATE TABLE phone_columns(id INTEGER PRIMARY KEY, name TEXT NOT NULL, numbers BLOB NOT NULL, crc INTEGER NOT "
     "NULL) STRICT",
     4},
}};
/// Version 1 first.
inline constexpr std::array<std::size_t, 7> kTablesOfVersion{9, 11, 12, 12, 12, 12, kCorpusTables.size()};

/// How many rows of each table a take promises.
struct LabelCounts {
  std::size_t phones = 0;
  std::size_t syllables = 0;
  std::size_t words = 0;
};

/// The labels of takes, from the tables words, syllables and phones: of one after another from the first on, or of any.
class LabelReader {
 public:
  explicit LabelReader(SqliteDatabase& database);
  LabelReader(SqliteDatabase& database, CheckedQuery::FromId anywhere);

  /// The take is next that has as many rows `before` it.
  void startAt(const LabelCounts& before);
  /// Of the next one, which is `take`. Throws InputError unless every promise of SpeechLabels holds and it has as many
  /// rows as `counts` says.
  [[nodiscard]] SpeechLabels read(std::size_t take, const LabelCounts& counts);
  /// Throws InputError where rows are left.
  void expectEnd();

 private:
  std::string file_;
  CheckedQuery words_, syllables_, phones_;
};

// The table `phone_columns`.

/// PhoneColumns of a file, and how many rows of the other tables are before each take.
struct StoredColumns {
  std::shared_ptr<PhoneColumns> columns;
  std::vector<std::uint32_t> word_begin, syllable_begin;  ///< by take

  [[nodiscard]] LabelCounts before(TakeIndex take) const {
    return {columns->take_begin[take.value], syllable_begin[take.value], word_begin[take.value]};
  }
};
/// Throws InputError where they cannot be those of `takes` takes.
StoredColumns readColumns(SqliteDatabase& database, std::size_t takes);
/// Nothing of more phones than a row has room for: such a file is opened as one of version 6.
void writeColumns(CheckedInsert rows, const Corpus& corpus);
/// What is wrong with those of the file, beside `corpus`, whose labels were read; "" when nothing is.
std::string faultOfColumns(SqliteDatabase& database, const Corpus& corpus);

// The tables `takes`, `motion` and `audio`, a row a take.

/// A take's row; its samples and labels follow from other tables.
struct TakeSizes {
  LabelCounts labels;
  std::size_t frames = 0;
  double frame_rate_hz = 0;
  std::size_t samples = 0;
  int sample_rate_hz = 0;
};

/// Throws InputError unless the row at hand has this id.
void expectId(const CheckedQuery& row, std::size_t expected);
/// The row at hand, all but the labels of which goes into `take`.
TakeSizes readTake(const CheckedQuery& row, const std::string& file, CorpusTake& take);
/// The clip of the take whose row of `motion` is at hand, all but the positions of which is in `clip`.
void readPositions(const CheckedQuery& row, std::size_t frames, MotionClip& clip);
/// Of the take whose row of `audio` is at hand.
void readSamples(const CheckedQuery& row, std::size_t count, AudioClip& audio);
/// Reads takes when they are asked for, and keeps the file open: `sizes` of all takes, or `stored` of a corpus with
/// phone_columns.
std::shared_ptr<const TakeSource> takeSourceOf(SqliteDatabase database, std::vector<TakeSizes> sizes,
                                               StoredColumns stored, const Corpus& corpus);

// The tables `trajectory_model` and `phone_shapes`.

/// Fills `corpus.trajectory_model` and `lattice_weights`; leaves them alone when the table is empty. Needs the layout.
void readTrajectoryModel(SqliteDatabase& database, Corpus& corpus);
/// Of the take of `phones` phones whose row is at hand: of `count` from `first` on.
PhoneShapes readShapes(const CheckedQuery& row, std::size_t phones, Eigen::Index components, std::size_t first,
                       std::size_t count);
/// Looks at the shapes of all takes; throws InputError for what is damaged or missing.
void readAllShapes(SqliteDatabase& database, const Corpus& corpus);
/// Nothing for a corpus without a model.
void writeTrajectoryModel(SqliteDatabase& database, const Corpus& corpus);

}  // namespace mouthpiece
