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

/// Format version 6 (docs/formats/corpus.md), which has the tables of version 3 with more rows, as 4 and 5 have, and
/// some of them packed; version 1 ends before `trajectory_model`, version 2 before `viseme_poses`. `crc` is the row's
/// checksum.
inline constexpr std::array<CorpusTable, 12> kCorpusTables{{
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
}};
inline constexpr std::array<std::size_t, 6> kTablesOfVersion{9,  11, 12,
                                                             12, 12, kCorpusTables.size()};  ///< version 1 first

/// How many rows of each table a take promises.
struct LabelCounts {
  std::size_t phones = 0;
  std::size_t syllables = 0;
  std::size_t words = 0;
};

/// The labels of all takes, from the tables words, syllables and phones. Throws InputError unless every promise of
/// SpeechLabels holds and each take has as many rows as `counts` says.
std::vector<SpeechLabels> readLabels(SqliteDatabase& database, const std::vector<LabelCounts>& counts);

// The tables `trajectory_model` and `phone_shapes`.

/// Fills `corpus.trajectory_model` and `lattice_weights`; leaves them alone when the table is empty. Needs the layout.
void readTrajectoryModel(SqliteDatabase& database, Corpus& corpus);
/// Of the take whose row is at hand.
PhoneShapes readShapes(const CheckedQuery& row, std::size_t phones, Eigen::Index components);
/// Looks at the shapes of all takes; throws InputError for what is damaged or missing.
void readAllShapes(SqliteDatabase& database, const Corpus& corpus);
/// Nothing for a corpus without a model.
void writeTrajectoryModel(SqliteDatabase& database, const Corpus& corpus);

}  // namespace mouthpiece
