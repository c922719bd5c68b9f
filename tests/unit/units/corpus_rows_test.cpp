// What a corpus says that is whole by its checksums and wrong all the same: one statement of SQL at a time, told with
// table, row, what was found and what was expected.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "base/files.h"
#include "support/error_of.h"
#include "support/tiny_corpus.h"
#include "support/tiny_model.h"
#include "units/file/corpus.h"
#include "units/file/corpus_tables.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

using Value = std::variant<std::nullptr_t, std::int64_t, double, std::string, std::vector<char>>;

/// The types of a table's columns but for the checksum, as its SQL has them.
std::vector<std::string> typesOf(const CorpusTable& table) {
  std::vector<std::string> types;
  for (std::size_t at = table.sql.find('('); types.size() + 1 < static_cast<std::size_t>(table.columns);
       at = table.sql.find(',', at + 1)) {
    const std::size_t name = table.sql.find_first_not_of("(, ", at), type = table.sql.find(' ', name) + 1;
    types.emplace_back(table.sql.substr(type, table.sql.find_first_of(" ,", type) - type));
  }
  return types;
}

Value valueOf(const CheckedQuery& row, int column, const std::string& type) {
  if (row.isNull(column)) return nullptr;
  if (type == "INTEGER") return row.integer(column);
  if (type == "REAL") return row.real(column);
  if (type == "TEXT") return std::string(row.text(column));
  const std::string_view bytes = row.blob(column);
  return std::vector<char>(bytes.begin(), bytes.end());
}

void insertRow(CheckedInsert& insert, const std::vector<Value>& row) {
  for (const Value& value : row) {
    if (std::holds_alternative<std::nullptr_t>(value)) insert.null();
    if (const auto* number = std::get_if<std::int64_t>(&value)) insert.integer(*number);
    if (const auto* number = std::get_if<double>(&value)) insert.real(*number);
    if (const auto* text = std::get_if<std::string>(&value)) insert.text(*text);
    if (const auto* bytes = std::get_if<std::vector<char>>(&value)) insert.blob({bytes->data(), bytes->size()});
  }
  insert.insert();
}

/// Runs a statement and makes every checksum right again.
void changeCorpus(const fs::path& path, const std::string& statement) {
  SqliteDatabase database = SqliteDatabase::create(path, path);
  database.execute("PRAGMA journal_mode=OFF; PRAGMA synchronous=OFF; BEGIN; " + statement);
  for (const CorpusTable& table : kCorpusTables) {
    const std::vector<std::string> types = typesOf(table);
    std::vector<std::vector<Value>> rows;
    for (CheckedQuery row(database, std::string(table.name)); row.nextUnchecked();) {
      std::vector<Value>& values = rows.emplace_back();
      for (std::size_t i = 0; i < types.size(); ++i) values.push_back(valueOf(row, static_cast<int>(i), types[i]));
    }
    database.execute(fmt::format("DELETE FROM {}", table.name));
    CheckedInsert insert(database, std::string(table.name), table.columns);
    for (const std::vector<Value>& row : rows) insertRow(insert, row);
  }
  database.execute("COMMIT");
  database.close();
}

struct Wrong {
  const char* statement;
  std::string said;
};

class WrongCorpora : public ::testing::TestWithParam<Wrong> {
 protected:
  WrongCorpora() { fs::create_directories(folder_); }
  ~WrongCorpora() override { fs::remove_all(folder_); }

  fs::path folder_ = fs::temp_directory_path() / ("wrong_corpora." + std::to_string(::getpid()));
  fs::path path_ = folder_ / "tiny.corpus";
};

Corpus wholeCorpus() {
  Corpus corpus = samples::tinyCorpus();
  corpus.trajectory_model = samples::tinyModel(corpus);
  corpus.viseme_poses = "{}";
  return corpus;
}

TEST_P(WrongCorpora, AreRefusedWithWhatIsWrong) {
  writeCorpus(path_, wholeCorpus());
  const auto said = [&] { return errorOf([&] { readCorpus(path_, CorpusAudio::kLoad); }); };
  changeCorpus(path_, "SELECT 1");
  ASSERT_EQ(said(), "no error");
  ASSERT_TRUE(checkCorpus(path_).empty());
  changeCorpus(path_, GetParam().statement);
  EXPECT_EQ(said(), path_.string() + GetParam().said);
  EXPECT_EQ(checkCorpus(path_), std::vector<std::string>{path_.string() + GetParam().said});
}

INSTANTIATE_TEST_SUITE_P(
    Description, WrongCorpora,
    ::testing::Values(
        Wrong{"UPDATE meta SET value='many' WHERE key='takes'", ":meta row 1: found many takes; expected 0 to 1000000"},
        Wrong{"UPDATE meta SET value='6 ' WHERE key='takes'", ":meta row 1: found 6  takes; expected 0 to 1000000"},
        Wrong{"UPDATE meta SET value='-1' WHERE key='takes'", ":meta row 1: found -1 takes; expected 0 to 1000000"},
        Wrong{"UPDATE meta SET value='1000001' WHERE key='takes'",
              ":meta row 1: found 1000001 takes; expected 0 to 1000000"},
        Wrong{"UPDATE meta SET key='takers' WHERE key='takes'",
              ":meta row 1: found key takers; expected takes or log:..."},
        Wrong{"UPDATE meta SET key='log:takes' WHERE key='takes'", ":meta: has no number of takes"},
        Wrong{"DELETE FROM layout", ":layout: is missing"},
        Wrong{"UPDATE neutral_pose SET marker='NOSE' WHERE id=2",
              ":neutral_pose row 3: marker differs from the layout's"},
        Wrong{"UPDATE neutral_pose SET id=9 WHERE id=3", ":neutral_pose row 4: found id 9; expected 3"},
        Wrong{"UPDATE neutral_pose SET z_mm=-10000001 WHERE id=0", ":neutral_pose row 1: found position -10000001 mm"},
        Wrong{"DELETE FROM neutral_pose WHERE id=3", ":neutral_pose: has 3 markers; expected 4"},
        Wrong{"INSERT INTO neutral_pose VALUES(4, 'NOSE', 0, 0, 0, 0)",
              ":neutral_pose row 5: marker differs from the layout's"},
        Wrong{"UPDATE viseme_poses SET json=''", ":viseme_poses row 1: found no text; expected viseme poses"},
        Wrong{"UPDATE viseme_poses SET id=1", ":viseme_poses row 1: found id 1; expected 0"},
        Wrong{"INSERT INTO viseme_poses VALUES(1, '{}', 0)", ":viseme_poses row 2: found a second row; expected one"}));

INSTANTIATE_TEST_SUITE_P(
    Takes, WrongCorpora,
    ::testing::Values(
        Wrong{"UPDATE meta SET value='7' WHERE key='takes'", ":takes: has 6 rows; expected 7"},
        Wrong{"UPDATE takes SET id=9 WHERE id=2", ":takes row 3: found id 3; expected 2"},
        Wrong{"UPDATE takes SET name='' WHERE id=1",
              ":takes row 2: found the name ''; expected one that no other take has"},
        Wrong{"UPDATE takes SET name='take0' WHERE id=1",
              ":takes row 2: found the name 'take0'; expected one that no other take has"},
        Wrong{"UPDATE takes SET phones=0 WHERE id=1", ":takes row 2: found 0 phones; expected 1 to 1000000"},
        Wrong{"UPDATE takes SET phones=1000001 WHERE id=1",
              ":takes row 2: found 1000001 phones; expected 1 to 1000000"},
        Wrong{"UPDATE takes SET syllables=-1 WHERE id=1", ":takes row 2: found -1 syllables; expected 0 to 1000000"},
        Wrong{"UPDATE takes SET syllables=1000001 WHERE id=1",
              ":takes row 2: found 1000001 syllables; expected 0 to 1000000"},
        Wrong{"UPDATE takes SET words=-1 WHERE id=1", ":takes row 2: found -1 words; expected 0 to 1000000"},
        Wrong{"UPDATE takes SET words=1000001 WHERE id=1", ":takes row 2: found 1000001 words; expected 0 to 1000000"},
        Wrong{"UPDATE takes SET frames=0 WHERE id=1", ":takes row 2: found 0 frames; expected 1 to 10000000"},
        Wrong{"UPDATE takes SET frames=10000001 WHERE id=1",
              ":takes row 2: found 10000001 frames; expected 1 to 10000000"},
        Wrong{"UPDATE takes SET frame_rate_hz=0.5 WHERE id=1",
              ":takes row 2: found 0.5 frames a second; expected at least 1"},
        Wrong{"UPDATE takes SET samples=-1 WHERE id=1", ":takes row 2: found -1 samples; expected 0 to 2764800000"},
        Wrong{"UPDATE takes SET samples=2764800001 WHERE id=1",
              ":takes row 2: found 2764800001 samples; expected 0 to 2764800000"},
        Wrong{"UPDATE takes SET sample_rate_hz=768001 WHERE id=1",
              ":takes row 2: found 768001 samples a second; expected 0 to 768000"},
        Wrong{"UPDATE motion SET id=9 WHERE id=3", ":motion row 4: found id 4; expected 3"},
        Wrong{"DELETE FROM motion WHERE id=5", ":motion: has 5 rows; expected 6"},
        Wrong{"INSERT INTO motion VALUES(6, x'00', 0)", ":motion row 7: no such take"},
        Wrong{"DELETE FROM audio WHERE id=5", ":audio: has 5 rows; expected 6"},
        Wrong{"UPDATE audio SET samples=x'0102' WHERE id=0",
              fmt::format(":audio row 1: found 2 bytes; expected {}, or as many packed",
                          2 * samples::tinyCorpus().takes[0].audio.samples.size())},
        Wrong{"UPDATE motion SET positions_mm=x'0102' WHERE id=2",
              fmt::format(":motion row 3: found 2 bytes; expected {}, or as many packed",
                          48 * samples::tinyCorpus().takes[2].motion.frameCount())}));

INSTANTIATE_TEST_SUITE_P(
    Labels, WrongCorpora,
    ::testing::Values(
        Wrong{"UPDATE words SET take=1 WHERE id=0", ":words row 1: found take 1; expected 0"},
        Wrong{"UPDATE takes SET words=5 WHERE id=5", ":words: take 5 has 4 rows; expected 5"},
        Wrong{"UPDATE takes SET words=3 WHERE id=5", ":phones row 69: found owner 3; expected one of 3"},
        Wrong{"UPDATE words SET first_phone=2, last_phone=1 WHERE id=0",
              ":words row 1: found phones 2 to 1; expected rising ones from 0"},
        Wrong{"UPDATE words SET first_phone=2 WHERE id=1",
              ":words row 2: found phones 2 to 5; expected rising ones from 3"},
        Wrong{"UPDATE words SET first_phone=-1 WHERE id=0", ":words row 1: found phone -1; expected one of 11"},
        Wrong{"UPDATE words SET last_phone=11 WHERE id=3", ":words row 4: found phone 11; expected one of 11"},
        Wrong{"UPDATE syllables SET stress=3 WHERE id=0", ":syllables row 1: found stress 3; expected one of 3"},
        Wrong{"UPDATE syllables SET stress=-1 WHERE id=0", ":syllables row 1: found stress -1; expected one of 3"},
        Wrong{"UPDATE phones SET phone='Q' WHERE id=1",
              ":phones row 2: found phone Q; expected an ARPAbet symbol or sil"},
        Wrong{"UPDATE phones SET start_s=5, end_s=5 WHERE id=1",
              ":phones row 2: phone from 5 s to 5 s; expected rising times"},
        Wrong{"UPDATE phones SET start_s=-0.5 WHERE id=0",
              ":phones row 1: phone from -0.5 s to 0.2 s; expected rising times"},
        Wrong{"UPDATE phones SET end_s=1000001 WHERE id=0",
              ":phones row 1: phone from 0 s to 1000001 s; expected rising times"},
        Wrong{"UPDATE phones SET end_s=0.25 WHERE id=0",
              ":phones row 2: phone begins at 0.2 s; expected 0.25 s, where the one before ends"},
        Wrong{"UPDATE phones SET word=3 WHERE id=1", ":phones row 2: phone 1 does not lie in its word or syllable 3"},
        Wrong{"UPDATE phones SET word=0 WHERE id=3", ":phones row 4: phone 3 does not lie in its word or syllable 0"},
        Wrong{"UPDATE phones SET word=4 WHERE id=1", ":phones row 2: found owner 4; expected one of 4"},
        Wrong{"UPDATE phones SET word=NULL WHERE id=1",
              ":take 0: a phone does not name the word that it begins or ends"},
        Wrong{"UPDATE phones SET syllable=NULL WHERE id=1",
              ":take 0: a phone does not name the syllable that holds it"}));

INSTANTIATE_TEST_SUITE_P(
    Model, WrongCorpora,
    ::testing::Values(Wrong{"UPDATE trajectory_model SET name='height' WHERE name='level'",
                            ":trajectory_model row 1: found height; expected level"},
                      Wrong{"UPDATE trajectory_model SET name='synthesis' WHERE name='analysis'",
                            ":trajectory_model row 2: found synthesis; expected analysis"},
                      Wrong{"UPDATE trajectory_model SET numbers=x'' WHERE name='level'",
                            ":trajectory_model row 1: found 0 bytes; expected 4 to 48"},
                      Wrong{"UPDATE trajectory_model SET numbers=zeroblob(52) WHERE name='level'",
                            ":trajectory_model row 1: found 52 bytes; expected 4 to 48"},
                      Wrong{"UPDATE trajectory_model SET numbers=x'00000000' WHERE name='shapes'",
                            ":trajectory_model row 3: found 4 bytes; expected 96"},
                      Wrong{"UPDATE trajectory_model SET numbers=x'000080bf' WHERE name='gain'",
                            ":trajectory_model row 6: found -1; expected more than 0"},
                      Wrong{"DELETE FROM trajectory_model WHERE id>2",
                            ":trajectory_model row 3: is missing; expected time constants"},
                      Wrong{
                          "UPDATE trajectory_model SET numbers=x'0000803f0000803f0000803f00000000' WHERE name='leads'",
                          ":trajectory_model row 5: found 16 bytes; expected 8"},
                      Wrong{"UPDATE trajectory_model SET numbers=x'0000803f00000040' WHERE name='leads'",
                            ":trajectory_model row 5: component 1 moves in 0.029999999329447746 s with a lead of 2 s"},
                      Wrong{"UPDATE trajectory_model SET numbers=x'0000003f00000040' WHERE name='time constants'",
                            ":trajectory_model row 5: component 1 moves in 2 s with a lead of 0.009999999776482582 s"},
                      Wrong{"UPDATE trajectory_model SET name='goal viseme Ah' WHERE name='target viseme Ah'",
                            ":trajectory_model row 13: found goal viseme Ah; expected at most 1000000 targets"}));

/// What `phone_columns` says is believed by who opens a corpus take by take, until it asks for a take.
class WrongColumns : public WrongCorpora {};

TEST_P(WrongColumns, AreRefusedWithWhatIsWrong) {
  writeCorpus(path_, wholeCorpus());
  const auto said = [&] {
    return errorOf([&] {
      const Corpus open = readCorpus(path_, CorpusAudio::kSkip, CorpusMotion::kTakesOnDemand);
      for (std::size_t take = 0; take < takeCount(open); ++take) takeOf(open, TakeIndex(take));
    });
  };
  changeCorpus(path_, "SELECT 1");
  ASSERT_EQ(said(), "no error");
  changeCorpus(path_, GetParam().statement);
  EXPECT_EQ(said(), path_.string() + GetParam().said);
  EXPECT_EQ(checkCorpus(path_).size(), 1U);
}

INSTANTIATE_TEST_SUITE_P(
    Description, WrongColumns,
    ::testing::Values(
        Wrong{"UPDATE phone_columns SET name='beginnings' WHERE id=0",
              ":phone_columns row 1: found beginnings; expected take begin"},
        Wrong{"DELETE FROM phone_columns WHERE id=6", ":phone_columns row 6: has no suffixes"},
        Wrong{"INSERT INTO phone_columns VALUES(7, 'more', x'00', 0)", ":phone_columns row 8: is one row too many"},
        Wrong{"UPDATE phone_columns SET numbers=substr(numbers, 2) WHERE name='durations'",
              ":phone_columns row 6: found 567 bytes; expected 8 a number"},
        Wrong{"UPDATE phone_columns SET numbers=substr(numbers, 2) WHERE name='marks'",
              ":phone_columns: columns are not equally long"},
        Wrong{"UPDATE phone_columns SET numbers=CAST(x'ff'||substr(numbers, 2) AS BLOB) WHERE name='phones'",
              ":phone_columns: name phones that there are not"},
        Wrong{"UPDATE phone_columns SET numbers=CAST(x'ffffff7f'||substr(numbers, 5) AS BLOB) WHERE name='suffixes'",
              ":phone_columns: name places that there are not"},
        Wrong{"UPDATE phone_columns SET numbers=CAST(x'000000000000f87f'||substr(numbers, 9) AS BLOB) WHERE "
              "name='durations'",
              ":phone_columns: hold times that do not rise"},
        Wrong{"UPDATE phone_columns SET numbers=CAST(x'ff000000'||substr(numbers, 5) AS BLOB) WHERE name='take begin'",
              ":phone_columns: takes do not follow each other"},
        Wrong{"UPDATE phone_columns SET numbers=substr(numbers, 1, 20) WHERE name='word begin'",
              ":phone_columns: are not those of 6 takes"},
        Wrong{"UPDATE phone_columns SET numbers=CAST(x'00000000'||x'00000000'||substr(numbers, 9) AS BLOB) WHERE "
              "name='word begin'",
              ":takes row 0: has other labels than phone_columns"},
        Wrong{"UPDATE phone_columns SET numbers=CAST(x'0000000000003040'||substr(numbers, 9) AS BLOB) WHERE "
              "name='durations'",
              ":takes row 0: has other phones than phone_columns"}));

TEST_F(WrongCorpora, ColumnsOfOtherLabelsAreFound) {
  writeCorpus(path_, wholeCorpus());
  changeCorpus(
      path_,
      "UPDATE phone_columns SET numbers=CAST(substr(numbers, 5)||substr(numbers, 1, 4) AS BLOB) WHERE name='suffixes'");
  EXPECT_EQ(checkCorpus(path_), std::vector<std::string>{path_.string() + ":phone_columns: differ from the labels"});
  EXPECT_NO_THROW(readCorpus(path_, CorpusAudio::kSkip, CorpusMotion::kTakesOnDemand));
}

TEST_F(WrongCorpora, OtherVersionsAndTablesAreNoCorpus) {
  writeCorpus(path_, wholeCorpus());
  const std::string whole = readFile(path_);
  {
    SqliteDatabase database = SqliteDatabase::create(path_, path_);
    database.execute("PRAGMA synchronous=OFF; PRAGMA user_version=0");
    database.close();
  }
  EXPECT_EQ(errorOf([&] { readCorpus(path_); }),
            path_.string() + fmt::format(": has corpus format version 0; expected {}", kCorpusFormatVersion));
  for (const char* statement : {"CREATE TABLE more(id INTEGER PRIMARY KEY)", "DROP TABLE viseme_poses",
                                "CREATE VIEW other AS SELECT 1", "CREATE INDEX names ON takes(name)"}) {
    writeFileAtomically(path_, whole);
    SqliteDatabase database = SqliteDatabase::create(path_, path_);
    database.execute(std::string("PRAGMA synchronous=OFF; ") + statement);
    database.close();
    EXPECT_EQ(
        errorOf([&] { readCorpus(path_); }),
        path_.string() + fmt::format(": its tables are not those of corpus format version {}", kCorpusFormatVersion))
        << statement;
  }
}

}  // namespace
}  // namespace mouthpiece
