#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "base/errors.h"
#include "units/file/corpus.h"
#include "units/file/sqlite_database.h"

namespace mouthpiece {

/// A corpus of made-up takes is written to path_ and read again, in a folder of the test's own.
class CorpusFile : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("corpus_file_test." + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_);
    path_ = folder_ / "tiny.corpus";
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  void writeBytes(const std::string& bytes) const { std::ofstream(path_, std::ios::binary) << bytes; }

  /// The reader's complaint about the file as it is now; "" when it has none.
  [[nodiscard]] std::string complaint() const {
    try {
      readCorpus(path_, CorpusAudio::kLoad);
      return "";
    } catch (const InputError& error) {
      return error.what();
    }
  }

  std::filesystem::path folder_;
  std::filesystem::path path_;
};

inline void expectSameLabels(const SpeechLabels& b, const SpeechLabels& a) {
  ASSERT_EQ(b.phones.size(), a.phones.size());
  for (std::size_t p = 0; p < a.phones.size(); ++p) {
    EXPECT_EQ(b.phones[p].phone, a.phones[p].phone);
    EXPECT_EQ(b.phones[p].span, a.phones[p].span);
    EXPECT_EQ(b.phones[p].word, a.phones[p].word);
    EXPECT_EQ(b.phones[p].syllable, a.phones[p].syllable);
  }
  ASSERT_EQ(b.words.size(), a.words.size());
  for (std::size_t w = 0; w < a.words.size(); ++w) {
    EXPECT_EQ(b.words[w].text, a.words[w].text);
    EXPECT_EQ(b.words[w].phones, a.words[w].phones);
  }
  ASSERT_EQ(b.syllables.size(), a.syllables.size());
  for (std::size_t s = 0; s < a.syllables.size(); ++s) {
    EXPECT_EQ(b.syllables[s].stress, a.syllables[s].stress);
  }
}

/// Rewrites the row of that name in trajectory_model, with its checksum.
inline void rewriteNumbers(const std::filesystem::path& path, const std::string& name,
                           const std::vector<float>& numbers) {
  SqliteDatabase database = SqliteDatabase::create(path, path);
  std::int64_t id = -1;
  for (CheckedQuery row(database, "trajectory_model"); row.next();) {
    if (row.text(1) == name) id = row.integer(0);
  }
  ASSERT_GE(id, 0);
  database.execute("DELETE FROM trajectory_model WHERE id=" + std::to_string(id));
  CheckedInsert(database, "trajectory_model", 4)
      .integer(id)
      .text(name)
      .blob({reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(float)})
      .insert();
  database.close();
}

}  // namespace mouthpiece
