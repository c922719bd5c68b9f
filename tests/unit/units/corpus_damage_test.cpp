// What a damaged corpus is refused with.
#include <gtest/gtest.h>

#include <filesystem>
#include <limits>
#include <random>
#include <span>

#include "base/errors.h"
#include "base/files.h"
#include "support/corpus_file_fixture.h"
#include "support/tiny_corpus.h"
#include "support/tiny_model.h"
#include "units/file/corpus.h"
#include "units/file/sqlite_database.h"
#include "units/phones/phone_span_index.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

TEST_F(CorpusFile, WeightsThatAreNoneAreRefused) {
  Corpus written = samples::tinyCorpus({"M-AE-N"});
  written.trajectory_model = samples::tinyModel(written);
  written.sound_cut_weights.slip = 1;
  const std::vector<float> usual(pairTerms().size(), 0.5F);
  const auto complaintAbout = [&](const char* row, std::vector<float> numbers) {
    writeCorpus(path_, written);
    rewriteNumbers(path_, row, numbers);
    return complaint();
  };
  EXPECT_EQ(complaintAbout("lattice weights", usual), "");
  EXPECT_EQ(readCorpus(path_).lattice_weights["join velocity"], 0.5);
  std::vector<float> numbers = usual;
  numbers[3] = -0.1F;
  EXPECT_NE(complaintAbout("lattice weights", numbers).find("expected no weight below 0"), std::string::npos);
  for (const float strange : {std::nanf(""), std::numeric_limits<float>::infinity(), 1e30F}) {
    numbers[3] = strange;
    EXPECT_NE(complaintAbout("lattice weights", numbers).find("expected a number"), std::string::npos);
  }
  numbers = usual;
  numbers.resize(12);
  EXPECT_NE(complaintAbout("lattice weights", numbers).find("found 48 bytes; expected 52"), std::string::npos);
  numbers = usual;
  numbers.push_back(1);
  EXPECT_NE(complaintAbout("lattice weights", numbers).find("found 60 bytes"), std::string::npos) << "a newer file";
  numbers = usual;
  numbers.pop_back();
  EXPECT_EQ(complaintAbout("lattice weights", numbers), "") << "an older file";
  EXPECT_EQ(readCorpus(path_).lattice_weights["adapted"], LatticeWeights()["adapted"]);
  written.lattice_weights["adapted"] = 2;
  writeCorpus(path_, written);
  EXPECT_EQ(readCorpus(path_).lattice_weights["adapted"], 2);
  EXPECT_NE(complaintAbout("lattice weights", {}).find("found 0 bytes"), std::string::npos);
  EXPECT_EQ(complaintAbout("motion settings", {60, 1, 1, 0, 0.5F}), "") << "an older file";
  const MotionSettings older = readCorpus(path_).motion_settings;
  EXPECT_EQ(older.detail_within_ms, 60);
  EXPECT_EQ(older.teeth_contact, 0.5);
  EXPECT_EQ(older.lips_fall_ms, MotionSettings().lips_fall_ms);
  EXPECT_NE(complaintAbout("motion settings", {60, 1, 1, 0}).find("found 16 bytes; expected 20"), std::string::npos);
  written.motion_settings.lips_fall_ms = 90;
  writeCorpus(path_, written);
  EXPECT_EQ(readCorpus(path_).motion_settings.lips_fall_ms, 90);
  EXPECT_NE(complaintAbout("sound cut weights", {1, 2}).find("found 8 bytes; expected 32"), std::string::npos);
  EXPECT_NE(complaintAbout("gain", {0}).find("expected more than 0"), std::string::npos);
  EXPECT_NE(complaintAbout("time constants", {0.02F, 0}).find("moves in 0 s"), std::string::npos);
}

TEST_F(CorpusFile, MotionOnDemandFindsDamageWhenUsed) {
  writeCorpus(path_, samples::tinyCorpus());
  std::string bytes = readFile(path_);
  const Eigen::Matrix<float, 1, Eigen::Dynamic> row =
      samples::tinyCorpus().takes[2].motion.positions_mm.row(40).cast<float>();
  const std::size_t at = bytes.find(std::string(reinterpret_cast<const char*>(row.data()), sizeof(float) * 9));
  ASSERT_NE(at, std::string::npos);
  bytes[at + 5] = static_cast<char>(bytes[at + 5] ^ 4);
  writeBytes(bytes);
  const Corpus read = readCorpus(path_, CorpusAudio::kSkip, CorpusMotion::kOnDemand);
  EXPECT_NO_THROW(read.take_source->load(TakeIndex(1)));
  EXPECT_THROW(read.take_source->load(TakeIndex(2)), InputError);
}

/// A file whose places of phones lie in another order than it says: what is found says what was asked for all the same.
TEST_F(CorpusFile, DisorderedSuffixesLeadNowhereElse) {
  const Corpus corpus = samples::tinyCorpus();
  auto columns = std::make_shared<PhoneColumns>(phoneColumnsOf(corpus));
  columns->suffixes = sortedSuffixes(*columns);
  std::mt19937 random(5);
  for (int round = 0; round < 50; ++round) {
    std::shuffle(columns->suffixes.begin(), columns->suffixes.end(), random);
    const PhoneSpanIndex index(columns);
    for (const CorpusTake& take : corpus.takes) {
      std::vector<Phone> phones;
      for (const LabelledPhone& phone : take.labels.phones) phones.push_back(phone.phone);
      for (const std::size_t length : {2U, 3U, 5U}) {
        const auto wanted = std::span(phones).first(std::min<std::size_t>(length, phones.size()));
        for (const PhonePlace& place : index.placesOf(wanted)) {
          for (std::size_t i = 0; i < wanted.size(); ++i)
            ASSERT_EQ(corpus.takes[place.take.value].labels.phones.at(place.phone.value + i).phone, wanted[i]);
        }
      }
    }
  }
}

TEST_F(CorpusFile, WhatIsNoCorpusIsNamed) {
  EXPECT_EQ(complaint(), path_.string() + ": no such file");
  writeBytes("the time is now\n");
  EXPECT_EQ(complaint(), path_.string() + ": is no corpus database; expected a file made by `corpus build`");
  writeBytes(std::string("RIFF\x24\0\0\0WAVEfmt ", 16));
  EXPECT_EQ(complaint(), path_.string() + ": is a sound (WAV); expected a file made by `corpus build`");
  writeBytes("");
  EXPECT_NE(complaint().find("is no corpus database"), std::string::npos);
  fs::remove(path_);
  fs::create_directory(path_);
  EXPECT_NE(complaint().find("is no regular file"), std::string::npos);
}

TEST_F(CorpusFile, ANewerVersionSaysSo) {
  writeCorpus(path_, samples::tinyCorpus());
  std::string bytes = readFile(path_);
  bytes[63] = static_cast<char>(kCorpusFormatVersion + 1);  // user_version, big-endian at 60
  writeBytes(bytes);
  EXPECT_NE(complaint().find("has corpus format version 8, made by a newer Mouthpiece; expected at most 7"),
            std::string::npos)
      << complaint();
}

TEST_F(CorpusFile, AnotherDatabaseIsNoCorpus) {
  writeCorpus(path_, samples::tinyCorpus());
  std::string bytes = readFile(path_);
  bytes[68] = 0;  // application_id
  writeBytes(bytes);
  EXPECT_NE(complaint().find("is an SQLite database but no corpus"), std::string::npos);
}

TEST_F(CorpusFile, EveryTruncationIsRefused) {
  writeCorpus(path_, samples::tinyCorpus());
  const std::string whole = readFile(path_);
  for (std::size_t size = 0; size < whole.size(); size += 1021) {
    writeBytes(whole.substr(0, size));
    ASSERT_NE(complaint(), "") << "cut to " << size << " bytes";
  }
  writeBytes(whole.substr(0, whole.size() - 1));
  EXPECT_NE(complaint().find("is cut off"), std::string::npos);
}

/// Any flipped bit is either found or changes nothing that is read (free space of a page, unused header fields).
TEST_F(CorpusFile, AFlippedBitNeverChangesWhatIsRead) {
  const Corpus original = samples::tinyCorpus({"DH-AH T-AY-M"});
  writeCorpus(path_, original);
  const std::string whole = readFile(path_);
  std::size_t found = 0;
  std::size_t tried = 0;
  for (std::size_t at = 0; at < whole.size(); at += 101, ++tried) {
    std::string damaged = whole;
    damaged[at] = static_cast<char>(damaged[at] ^ (1 << (at % 8)));
    writeBytes(damaged);
    const std::vector<std::string> problems = checkCorpus(path_);
    if (!problems.empty()) {
      ++found;
      continue;
    }
    const Corpus read = readCorpus(path_, CorpusAudio::kLoad);
    ASSERT_EQ(read.takes.size(), 1U) << at;
    ASSERT_TRUE((read.takes[0].motion.positions_mm.array() == original.takes[0].motion.positions_mm.array()).all())
        << at;
    ASSERT_EQ(read.takes[0].labels.phones.size(), original.takes[0].labels.phones.size()) << at;
    ASSERT_EQ(read.neutral_pose_mm, original.neutral_pose_mm) << at;
  }
  EXPECT_GT(found, tried / 5) << "motion and labels alone are more than a fifth of the file";
}

TEST_F(CorpusFile, CheckNamesEveryDamagedRow) {
  writeCorpus(path_, samples::tinyCorpus());
  EXPECT_TRUE(checkCorpus(path_).empty());
  const Corpus corpus = samples::tinyCorpus();
  std::string bytes = readFile(path_);
  // The first frame's bytes are the same in two takes only by chance: damage each take's own row in its place.
  for (const std::size_t take : {1U, 4U}) {
    const Eigen::Matrix<float, 1, Eigen::Dynamic> row = corpus.takes[take].motion.positions_mm.row(40).cast<float>();
    const std::size_t at = bytes.find(std::string(reinterpret_cast<const char*>(row.data()), sizeof(float) * 9));
    ASSERT_NE(at, std::string::npos);
    bytes[at + 5] = static_cast<char>(bytes[at + 5] ^ 4);
  }
  writeBytes(bytes);
  const std::vector<std::string> problems = checkCorpus(path_);
  ASSERT_EQ(problems.size(), 2U);
  EXPECT_NE(problems[0].find("motion row 2: checksum differs"), std::string::npos) << problems[0];
  EXPECT_NE(problems[1].find("motion row 5: checksum differs"), std::string::npos) << problems[1];
  EXPECT_NE(complaint().find("motion row 2"), std::string::npos) << complaint();
}

TEST_F(CorpusFile, FailedWriteKeepsTheOldFile) {
  writeCorpus(path_, samples::tinyCorpus());
  const std::string before = readFile(path_);
  Corpus wrong = samples::tinyCorpus();
  wrong.takes[0].motion.marker_names.pop_back();
  EXPECT_THROW(writeCorpus(path_, wrong), InternalError);
  EXPECT_EQ(readFile(path_), before);
  EXPECT_THROW(writeCorpus(path_ / "below_a_file.corpus", samples::tinyCorpus()), InputError);
}

TEST(Checksum, MeetsTheStandardAndItsTwoRoutesAgree) {
  EXPECT_EQ(crc32c("123456789"), 0xE3069283U);
  EXPECT_EQ(crc32cByTable("123456789"), 0xE3069283U);
  std::string bytes;
  for (std::size_t i = 0; i < 300; ++i) {
    EXPECT_EQ(crc32c(bytes), crc32cByTable(bytes));
    EXPECT_EQ(crc32c(bytes), crc32c(bytes.substr(i / 3), crc32c(bytes.substr(0, i / 3)))) << "in two parts";
    bytes += static_cast<char>(i * 89 + 7);
  }
}

}  // namespace
}  // namespace mouthpiece
