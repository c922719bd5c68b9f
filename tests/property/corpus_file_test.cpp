// The corpus file: whatever is written is read, and whatever happens to a file is refused or changes nothing.
#include "units/file/corpus.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "base/errors.h"
#include "base/files.h"
#include "support/random_corpus.h"
#include "support/tiny_corpus.h"
#include "support/tiny_model.h"
#include "units/file/corpus_tables.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;
using samples::Chance;

std::string randomText(Chance& chance) {
  constexpr std::array<const char*, 8> kPieces{"now", "'", "\"", "\xC3\xA9", "%s", "\n", "; DROP TABLE takes", " "};
  std::string text;
  for (std::size_t i = chance.below(6); i > 0; --i) text += kPieces[chance.below(kPieces.size())];
  return text;
}

/// With texts, sounds, a model and weights at random.
Corpus anyCorpus(Chance& chance) {
  Corpus corpus = samples::randomCorpus(chance);
  for (CorpusTake& take : corpus.takes) {
    take.text = randomText(chance);
    if (chance.oneIn(3)) take.audio.samples.clear();
    for (LabelledSyllable& syllable : take.labels.syllables) syllable.stress = static_cast<int>(chance.below(3));
  }
  for (std::size_t i = chance.below(4); i > 0; --i) corpus.build_log["key " + std::to_string(i)] = randomText(chance);
  if (chance.oneIn(3)) corpus.viseme_poses = R"({"any": "text"})";
  if (chance.oneIn(3)) return corpus;
  auto model = std::make_shared<TrajectoryModel>(*samples::tinyModel(corpus));
  model->gain = static_cast<float>(chance.between(0.1, 3));
  for (ComponentDynamics& dynamics : model->dynamics) {  // as the file holds them: shapes are computed from that
    dynamics.time_constant = static_cast<float>(dynamics.time_constant);
    dynamics.lead = static_cast<float>(dynamics.lead);
  }
  for (std::size_t i = chance.below(5); i > 0; --i) {
    const float value = static_cast<float>(chance.between(-9, 9));
    model->targets["left Ah " + std::to_string(i)] = Eigen::Vector2d(value, 2 * value);
  }
  corpus.trajectory_model = model;
  for (double& weight : corpus.lattice_weights.values()) weight = static_cast<float>(chance.between(0, 20));
  if (chance.oneIn(2)) return corpus;
  for (const SoundCutTerm& term : kSoundCutTerms)
    corpus.sound_cut_weights.*term.weight = static_cast<float>(chance.between(0, 20));
  return corpus;
}

bool sameNumbers(const PositionMatrix& a, const PositionMatrix& b) {
  return a.rows() == b.rows() && a.cols() == b.cols() &&
         ((a.array() == b.array()) || (a.array().isNaN() && b.array().isNaN())).all();
}

/// Nothing that `a` says is otherwise in `b`.
void expectSame(const Corpus& a, const Corpus& b) {
  EXPECT_EQ(a.build_log, b.build_log);
  EXPECT_EQ(layoutToJson(a.layout), layoutToJson(b.layout));
  EXPECT_EQ(a.neutral_pose_mm, b.neutral_pose_mm);
  EXPECT_EQ(a.viseme_poses, b.viseme_poses);
  EXPECT_EQ(a.sound_cut_weights, b.sound_cut_weights);
  EXPECT_TRUE(a.lattice_weights == b.lattice_weights);
  ASSERT_EQ(a.trajectory_model == nullptr, b.trajectory_model == nullptr);
  if (a.trajectory_model != nullptr) {
    const TrajectoryModel &model = *a.trajectory_model, &other = *b.trajectory_model;
    EXPECT_EQ(model.gain, other.gain);
    EXPECT_EQ(model.targets, other.targets);
    EXPECT_TRUE(model.shapes.isApprox(other.shapes, 1e-6));
  }
  ASSERT_EQ(a.takes.size(), b.takes.size());
  for (std::size_t i = 0; i < a.takes.size(); ++i) {
    const CorpusTake &one = a.takes[i], &other = b.takes[i];
    EXPECT_EQ(one.name, other.name);
    EXPECT_EQ(one.text, other.text);
    EXPECT_EQ(one.motion.frame_rate_hz, other.motion.frame_rate_hz);
    EXPECT_TRUE(sameNumbers(one.motion.positions_mm, other.motion.positions_mm)) << one.name;
    ASSERT_EQ(one.labels.phones.size(), other.labels.phones.size());
    for (std::size_t p = 0; p < one.labels.phones.size(); ++p) {
      EXPECT_EQ(one.labels.phones[p].phone, other.labels.phones[p].phone);
      EXPECT_EQ(one.labels.phones[p].span, other.labels.phones[p].span);
      EXPECT_EQ(one.labels.phones[p].word, other.labels.phones[p].word);
      EXPECT_EQ(one.labels.phones[p].syllable, other.labels.phones[p].syllable);
    }
    ASSERT_EQ(one.labels.syllables.size(), other.labels.syllables.size());
    for (std::size_t s = 0; s < one.labels.syllables.size(); ++s) {
      EXPECT_EQ(one.labels.syllables[s].phones, other.labels.syllables[s].phones);
      EXPECT_EQ(one.labels.syllables[s].stress, other.labels.syllables[s].stress);
    }
    ASSERT_EQ(one.labels.words.size(), other.labels.words.size());
    for (std::size_t w = 0; w < one.labels.words.size(); ++w) {
      EXPECT_EQ(one.labels.words[w].phones, other.labels.words[w].phones);
      EXPECT_EQ(one.labels.words[w].text, other.labels.words[w].text);
    }
    EXPECT_EQ(one.audio.sample_rate_hz, other.audio.sample_rate_hz);
    EXPECT_EQ(one.audio.samples.size(), other.audio.samples.size());
  }
}

class CorpusFileProperty : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("corpus_property." + std::to_string(::getpid()));
    fs::create_directories(folder_);
    path_ = folder_ / "any.corpus";
  }
  void TearDown() override { fs::remove_all(folder_); }
  void writeBytes(const std::string& bytes) const { std::ofstream(path_, std::ios::binary) << bytes; }

  fs::path folder_, path_;
};

TEST_F(CorpusFileProperty, WhatIsWrittenIsReadAndWrittenAlike) {
  const std::uint64_t first = samples::firstSeed();
  for (std::uint64_t seed = first; seed < first + 60 && !HasFailure(); ++seed) {
    SCOPED_TRACE("MOUTHPIECE_SEED=" + std::to_string(seed));
    Chance chance(seed);
    const Corpus written = anyCorpus(chance);
    writeCorpus(path_, written);
    const std::string bytes = readFile(path_);
    ASSERT_EQ(checkCorpus(path_), std::vector<std::string>());
    const Corpus read = readCorpus(path_, CorpusAudio::kLoad);
    expectSame(written, read);
    writeCorpus(path_, read);
    ASSERT_TRUE(readFile(path_) == bytes) << "written again it differs";
    // Take by take, and written from there.
    const Corpus open = readCorpus(path_, CorpusAudio::kSkip, CorpusMotion::kOnDemand);
    for (std::size_t i = open.takes.size(); i-- > 0;)
      EXPECT_TRUE(sameNumbers(open.take_source->load(TakeIndex(i)).positions_mm, written.takes[i].motion.positions_mm));
    writeCorpus(folder_ / "from_source.corpus", open);
    ASSERT_TRUE(readFile(folder_ / "from_source.corpus") == bytes);
  }
}

/// Bits, bytes, blocks, ends: what a disk, a network or a stranger does to a file.
std::string damaged(std::string bytes, Chance& chance) {
  for (std::size_t i = 1 + chance.below(3); i > 0; --i) {
    const std::size_t at = chance.below(bytes.size()), length = std::min(bytes.size() - at, 1 + chance.below(600));
    switch (chance.below(5)) {
      case 0:
        bytes[at] = static_cast<char>(bytes[at] ^ (1 << chance.below(8)));
        break;
      case 1:
        bytes[at] = static_cast<char>(chance.below(256));
        break;
      case 2:
        bytes.replace(at, length, length, '\0');
        break;
      case 3:
        bytes.replace(at, length, bytes.substr(chance.below(bytes.size() - length + 1), length));
        break;
      default:
        bytes.resize(std::max<std::size_t>(1, bytes.size() - length));
    }
  }
  return bytes;
}

TEST_F(CorpusFileProperty, ADamagedFileIsRefusedOrSaysTheSame) {
  const std::uint64_t first = samples::firstSeed();
  std::size_t refused = 0;
  for (std::uint64_t seed = first; seed < first + 400 && !HasFailure(); ++seed) {
    SCOPED_TRACE("MOUTHPIECE_SEED=" + std::to_string(seed));
    Chance chance(seed);
    static Corpus written;
    static std::string whole;
    if (whole.empty() || chance.oneIn(20)) {
      written = anyCorpus(chance);
      writeCorpus(path_, written);
      whole = readFile(path_);
    }
    writeBytes(damaged(whole, chance));
    if (!checkCorpus(path_).empty()) {
      ++refused;
      continue;
    }
    expectSame(written, readCorpus(path_, CorpusAudio::kLoad));
  }
  EXPECT_GT(refused, 100U) << "of 400";
}

/// A row that is missing is missed, wherever it was: all checksums are right.
TEST_F(CorpusFileProperty, AMissingRowIsMissed) {
  const std::uint64_t first = samples::firstSeed();
  for (std::uint64_t seed = first; seed < first + 100 && !HasFailure(); ++seed) {
    SCOPED_TRACE("MOUTHPIECE_SEED=" + std::to_string(seed));
    Chance chance(seed);
    Corpus corpus = samples::randomCorpus(chance);
    corpus.trajectory_model = samples::tinyModel(corpus);
    corpus.build_log.clear();
    writeCorpus(path_, corpus);
    const std::string table(kCorpusTables[chance.below(kCorpusTables.size())].name);
    if (table == "viseme_poses") continue;  // may be missing
    std::vector<std::int64_t> ids;
    {
      SqliteDatabase database = SqliteDatabase::openReadOnly(path_);
      for (CheckedQuery rows(database, table); rows.next();) ids.push_back(rows.integer(0));
    }
    ASSERT_FALSE(ids.empty()) << table;
    const std::size_t at = chance.below(ids.size());
    // Without its last rows, targets, a model knows less; without any it is no model.
    if (table == "trajectory_model" && at >= 9) continue;
    SqliteDatabase database = SqliteDatabase::create(path_, path_);
    database.execute("DELETE FROM " + table + " WHERE id=" + std::to_string(ids[at]));
    database.close();
    EXPECT_FALSE(checkCorpus(path_).empty()) << table << " without row " << at;
  }
}

}  // namespace
}  // namespace mouthpiece
