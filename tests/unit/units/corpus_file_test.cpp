#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <limits>
#include <random>
#include <span>

#include "base/errors.h"
#include "base/files.h"
#include "support/repeated_corpus.h"
#include "support/tiny_corpus.h"
#include "support/tiny_model.h"
#include "units/file/corpus.h"
#include "units/file/sqlite_database.h"
#include "units/phones/phone_span_index.h"
#include "units/selection/selection.h"
#include "units/selection/unit_database.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

void expectSameLabels(const SpeechLabels& b, const SpeechLabels& a) {
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

class CorpusFile : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("corpus_file_test." + std::to_string(::getpid()));
    fs::create_directories(folder_);
    path_ = folder_ / "tiny.corpus";
  }
  void TearDown() override { fs::remove_all(folder_); }

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

  fs::path folder_;
  fs::path path_;
};

/// Rewrites the row of that name in trajectory_model, with its checksum.
void rewriteNumbers(const fs::path& path, const std::string& name, const std::vector<float>& numbers) {
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

TEST_F(CorpusFile, RoundTripKeepsTheTrajectoryModel) {
  Corpus written = samples::tinyCorpus();
  written.trajectory_model = samples::tinyModel(written);
  written.lattice_weights["duration"] = 0.75;
  writeCorpus(path_, written);
  EXPECT_TRUE(checkCorpus(path_).empty());
  const Corpus read = readCorpus(path_, CorpusAudio::kSkip, CorpusMotion::kOnDemand);
  ASSERT_NE(read.trajectory_model, nullptr);
  const TrajectoryModel& a = *written.trajectory_model;
  const TrajectoryModel& b = *read.trajectory_model;
  constexpr double kFloat = 1e-6;
  EXPECT_TRUE(b.analysis.isApprox(a.analysis, kFloat));
  EXPECT_TRUE(b.shapes.isApprox(a.shapes, kFloat));
  EXPECT_TRUE(b.level.isApprox(a.level, kFloat));
  EXPECT_TRUE(b.closing.isApprox(a.closing, kFloat));
  EXPECT_EQ(b.dynamics.size(), a.dynamics.size());
  EXPECT_EQ(b.targets, a.targets);
  EXPECT_NEAR(b.closed_opening_mm, a.closed_opening_mm, kFloat);
  EXPECT_EQ(read.lattice_weights["duration"], 0.75);
  for (std::size_t take = 0; take < read.takes.size(); ++take) {
    const PhoneShapes kept = read.take_source->loadShapes(TakeIndex(take));
    const PhoneShapes computed = phoneShapes(a, written.takes[take].labels, written.takes[take].motion,
                                             written.neutral_pose_mm, LipGauge(written.layout));
    EXPECT_EQ(kept.captured, computed.captured);
    EXPECT_EQ(kept.predicted, computed.predicted);
    EXPECT_EQ(kept.tightest_mm, computed.tightest_mm);
  }
}

/// What `corpus build` writes: positions in whole steps, and sound as long as a sentence.
TEST_F(CorpusFile, PackedRowsAreAThirdAndSayTheSame) {
  Corpus written = samples::tinyCorpus();
  writeCorpus(path_, written);
  const auto as_floats = fs::file_size(path_);
  for (CorpusTake& take : written.takes) {
    take.motion.positions_mm = (take.motion.positions_mm.array() * 1024).round() / 1024;
    take.audio.samples.resize(30000, 0.25F);
  }
  writeCorpus(path_, written);
  EXPECT_LT(fs::file_size(path_), as_floats);
  EXPECT_EQ(checkCorpus(path_), std::vector<std::string>());
  const Corpus read = readCorpus(path_, CorpusAudio::kLoad);
  const Corpus open = readCorpus(path_, CorpusAudio::kSkip, CorpusMotion::kOnDemand);
  for (std::size_t i = 0; i < written.takes.size(); ++i) {
    EXPECT_EQ(read.takes[i].motion.positions_mm, written.takes[i].motion.positions_mm);
    EXPECT_EQ(open.take_source->load(TakeIndex(i)).positions_mm, written.takes[i].motion.positions_mm);
    EXPECT_EQ(open.take_source->loadAudio(TakeIndex(i)).samples.size(), 30000U);
    EXPECT_EQ(read.takes[i].audio.samples.back(), 0.25F);
  }
}

TEST_F(CorpusFile, ReadsVersion1) {
  const Corpus written = samples::tinyCorpus();
  writeCorpus(path_, written);
  {
    SqliteDatabase database = SqliteDatabase::create(path_, path_);
    database.execute(
        "DROP TABLE trajectory_model; DROP TABLE phone_shapes; DROP TABLE viseme_poses; DROP TABLE phone_columns; "
        "PRAGMA user_version=1");
    database.close();
  }
  EXPECT_TRUE(checkCorpus(path_).empty());
  const Corpus read = readCorpus(path_);
  EXPECT_EQ(read.takes.size(), written.takes.size());
  EXPECT_EQ(read.trajectory_model, nullptr);
}

TEST_F(CorpusFile, ReadsVersion2) {
  Corpus written = samples::tinyCorpus();
  written.trajectory_model = samples::tinyModel(written);
  writeCorpus(path_, written);
  {
    SqliteDatabase database = SqliteDatabase::create(path_, path_);
    database.execute("DROP TABLE viseme_poses; DROP TABLE phone_columns; PRAGMA user_version=2");
    database.close();
  }
  EXPECT_TRUE(checkCorpus(path_).empty());
  const Corpus read = readCorpus(path_);
  EXPECT_NE(read.trajectory_model, nullptr);
  EXPECT_EQ(read.viseme_poses, "");
}

TEST_F(CorpusFile, KeepsWhenTheMouthMovesInSilence) {
  Corpus written = samples::tinyCorpus();
  auto model = std::make_shared<TrajectoryModel>(*samples::tinyModel(written));
  model->silence = {0.25, 0.5, 0.125, 0.75, true};  // what floats hold
  written.trajectory_model = model;
  writeCorpus(path_, written);
  EXPECT_TRUE(checkCorpus(path_).empty());
  EXPECT_EQ(readCorpus(path_).trajectory_model->silence, model->silence);
  model->silence.most_breath = 0;  // under the least
  writeCorpus(path_, written);
  EXPECT_NE(complaint().find("found breaths out of order"), std::string::npos) << complaint();
  model->silence = {};
  model->silence.pauses_settle = false;  // a file of version 5 has no such row
  writeCorpus(path_, written);
  EXPECT_FALSE(readCorpus(path_).trajectory_model->silence.pauses_settle);
}

TEST_F(CorpusFile, KeepsWhatASoundAdds) {
  Corpus written = samples::tinyCorpus();
  auto model = std::make_shared<TrajectoryModel>(*samples::tinyModel(written));
  model->sound.expected = Eigen::MatrixXd::Random(kPhoneCount, kSoundMeasures);
  model->sound.spread = Eigen::RowVectorXd::Constant(kSoundMeasures, 0.5);
  model->sound.widest_spread = Eigen::RowVectorXd::Constant(kSoundMeasures, 0.75);
  model->sound.weights = Eigen::MatrixXd::Random(kSoundFeatures, model->componentCount());
  written.trajectory_model = model;
  writeCorpus(path_, written);
  EXPECT_TRUE(checkCorpus(path_).empty());
  const SoundModel sound = readCorpus(path_).trajectory_model->sound;
  constexpr double kFloat = 1e-6;
  EXPECT_TRUE(sound.expected.isApprox(model->sound.expected, kFloat));
  EXPECT_TRUE(sound.weights.isApprox(model->sound.weights, kFloat));
  EXPECT_EQ(sound.spread, model->sound.spread);
  EXPECT_EQ(sound.widest_spread, model->sound.widest_spread);

  model->sound.spread(3) = 0;
  writeCorpus(path_, written);
  EXPECT_NE(complaint().find("found no spread"), std::string::npos) << complaint();
}

TEST_F(CorpusFile, KeepsNetworksAndTheirShares) {
  Corpus written = samples::tinyCorpus();
  auto model = std::make_shared<TrajectoryModel>(*samples::tinyModel(written));
  const auto features = signedIndex(contextFeatureNames().size());
  for (const Eigen::Index hidden : {3, 5})
    model->networks.push_back({ContextNetwork::Matrix::Random(features, kContextWindows * hidden),
                               Eigen::RowVectorXf::Random(hidden),
                               ContextNetwork::Matrix::Random(hidden, model->componentCount())});
  model->network_share = Eigen::RowVector2d(0.25, 1);
  written.trajectory_model = model;
  writeCorpus(path_, written);
  EXPECT_TRUE(checkCorpus(path_).empty());
  const auto read = readCorpus(path_).trajectory_model;
  EXPECT_EQ(read->network_share, model->network_share);
  ASSERT_EQ(read->networks.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(read->networks[i].input, model->networks[i].input);
    EXPECT_EQ(read->networks[i].bias, model->networks[i].bias);
    EXPECT_EQ(read->networks[i].output, model->networks[i].output);
  }
  const auto after = [&](std::vector<float> shares) {
    writeCorpus(path_, written);
    rewriteNumbers(path_, "network shares", shares);
    const std::string said = complaint();
    return said.substr(std::min(said.size(), path_.string().size()));
  };
  const std::string row = ":trajectory_model row 12: ";
  EXPECT_EQ(after({0.25F, 1, 3, 5}), "");
  EXPECT_EQ(after({0.25F, 1.5F, 3, 5}), row + "found a share over 1; expected 0 to 1");
  EXPECT_EQ(after({-0.5F, 1, 3, 5}), row + "found -0.5; expected no weight below 0");
  EXPECT_EQ(after({0.25F, 1, 0, 5}), row + "found 0 hidden units");
  EXPECT_EQ(after({0.25F, 1, 1025, 5}), row + "found 1025 hidden units");
  EXPECT_EQ(after({0.25F, 1}), row + "found 8 bytes; expected 8 and 4 a network");
  EXPECT_EQ(after(std::vector<float>(2 + 65, 1)), row + "found 268 bytes; expected 8 and 4 a network");
  EXPECT_NE(after({0.25F, 1, 4, 5}).find(" bytes; expected "), std::string::npos) << "a network of another size";
}

TEST_F(CorpusFile, MayHoldNoTake) {
  writeCorpus(path_, samples::tinyCorpus(std::vector<std::string>{}));
  EXPECT_TRUE(checkCorpus(path_).empty());
  EXPECT_TRUE(readCorpus(path_).takes.empty());
}

TEST_F(CorpusFile, ReadsVersion4) {
  Corpus written = samples::tinyCorpus();
  written.trajectory_model = samples::tinyModel(written);
  writeCorpus(path_, written);
  {
    SqliteDatabase database = SqliteDatabase::create(path_, path_);
    database.execute("DROP TABLE phone_columns; PRAGMA user_version=4");
    database.close();
  }
  EXPECT_TRUE(checkCorpus(path_).empty());
  EXPECT_TRUE(readCorpus(path_).trajectory_model->sound.isEmpty());
}

/// Files as programs before this one wrote them: two takes, and from version 2 on a model with weights of its own.
TEST(StoredCorpusFiles, OfAllVersionsOpen) {
  for (const int version : {1, 2, 3}) {
    SCOPED_TRACE(version);
    const fs::path path =
        fs::path(MOUTHPIECE_SOURCE_DIR) / "tests/unit/units/stored" / ("version" + std::to_string(version) + ".corpus");
    EXPECT_EQ(checkCorpus(path), std::vector<std::string>());
    const Corpus read = readCorpus(path, CorpusAudio::kLoad);
    const Corpus written = samples::tinyCorpus({"M-AE-N", "AH T-AY-M"}, 25);
    ASSERT_EQ(read.takes.size(), 2U);
    EXPECT_EQ(read.build_log.at("built_with"), "stored");
    for (std::size_t i = 0; i < 2; ++i) {
      EXPECT_TRUE(isSaidAlike(read.takes[i].labels, written.takes[i].labels));
      // Summed from the files' own bytes by another program: today's little corpus draws its lips by today's phones.
      EXPECT_NEAR(read.takes[i].motion.positions_mm.sum(), i == 0 ? 1146.47109 : 1189.75341, 1e-4);
      EXPECT_EQ(read.takes[i].motion.positions_mm.rows(), written.takes[i].motion.positions_mm.rows());
      EXPECT_EQ(read.takes[i].audio.samples.size(), 200U);
    }
    EXPECT_EQ(read.trajectory_model != nullptr, version > 1);
    EXPECT_EQ(read.lattice_weights["duration"], version > 1 ? 0.75 : 1.0);
    EXPECT_EQ(read.lattice_weights["stand-in"], 10);
    EXPECT_EQ(read.sound_cut_weights.slip, version > 1 ? 3 : 2);
    EXPECT_EQ(read.viseme_poses, version > 2 ? R"({"stored": 3})" : "");
    const UnitDatabase database(read);
    for (const SelectionMethod method : {SelectionMethod::kGreedy, SelectionMethod::kViterbi})
      EXPECT_EQ(selectUnits(read.takes[1].labels, database, {.method = method}).size(), 1U);
  }
}

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

TEST_F(CorpusFile, RoundTripKeepsTheVisemePosesAndFindsTheirDamage) {
  Corpus written = samples::tinyCorpus();
  written.viseme_poses = R"({"jaw_drop_mm": 1.25})";
  writeCorpus(path_, written);
  EXPECT_TRUE(checkCorpus(path_).empty());
  EXPECT_EQ(readCorpus(path_).viseme_poses, written.viseme_poses);
  std::string bytes = readFile(path_);
  const std::size_t at = bytes.find("1.25");
  ASSERT_NE(at, std::string::npos);
  bytes[at] = '7';
  writeBytes(bytes);
  EXPECT_NE(complaint().find("viseme_poses row 1: checksum differs"), std::string::npos) << complaint();
}

/// A place is three numbers within reach of a face, or none.
TEST_F(CorpusFile, APlaceIsWhole) {
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    for (const double strange : {std::nan(""), 1e9, -1e9}) {
      Corpus written = samples::tinyCorpus();
      written.takes[0].motion.positions_mm(5, 3 + axis) = strange;
      writeCorpus(path_, written);
      EXPECT_NE(complaint().find("frame 5 marker 1: found ("), std::string::npos)
          << axis << " " << strange << complaint();
    }
  }
}

TEST_F(CorpusFile, RoundTripKeepsEverything) {
  Corpus written = samples::tinyCorpus();
  written.takes[1].motion.positions_mm.block<5, 3>(10, 3).setConstant(std::numeric_limits<double>::quiet_NaN());
  written.takes[2].text = "quotes ' \" and \xC3\xA9";
  writeCorpus(path_, written);
  const Corpus read = readCorpus(path_, CorpusAudio::kLoad);

  EXPECT_EQ(read.name, "tiny");
  EXPECT_EQ(read.build_log, written.build_log);
  EXPECT_EQ(read.layout.markerNames(), written.layout.markerNames());
  EXPECT_EQ(read.neutral_pose_mm, written.neutral_pose_mm);
  ASSERT_EQ(read.takes.size(), written.takes.size());
  for (std::size_t i = 0; i < read.takes.size(); ++i) {
    const CorpusTake& a = written.takes[i];
    const CorpusTake& b = read.takes[i];
    EXPECT_EQ(b.name, a.name);
    EXPECT_EQ(b.text, a.text);
    EXPECT_EQ(b.motion.frame_rate_hz, a.motion.frame_rate_hz);
    EXPECT_EQ(b.motion.positions_mm.rows(), a.motion.positions_mm.rows());
    const auto same = (b.motion.positions_mm.array() == a.motion.positions_mm.array()) ||
                      (b.motion.positions_mm.array().isNaN() && a.motion.positions_mm.array().isNaN());
    EXPECT_TRUE(same.all());
    expectSameLabels(b.labels, a.labels);
    ASSERT_EQ(b.audio.samples.size(), a.audio.samples.size());
    for (std::size_t k = 0; k < a.audio.samples.size(); ++k) {
      ASSERT_NEAR(b.audio.samples[k], a.audio.samples[k], 1.0 / 32768) << "16-bit samples";
    }
  }
}

TEST_F(CorpusFile, WrittenTwiceIsTheSameToTheByte) {
  writeCorpus(path_, samples::tinyCorpus());
  const std::string first = readFile(path_);
  writeCorpus(path_, readCorpus(path_, CorpusAudio::kLoad));
  EXPECT_EQ(readFile(path_), first);
}

TEST_F(CorpusFile, AudioCanBeLeftOut) {
  writeCorpus(path_, samples::tinyCorpus());
  const Corpus read = readCorpus(path_);
  EXPECT_TRUE(read.takes[0].audio.samples.empty());
  EXPECT_EQ(read.takes[0].audio.sample_rate_hz, 8000);
}

TEST_F(CorpusFile, MotionOnDemandIsTheSameMotion) {
  const Corpus written = samples::tinyCorpus();
  writeCorpus(path_, written);
  const Corpus read = readCorpus(path_, CorpusAudio::kSkip, CorpusMotion::kOnDemand);
  fs::remove(path_);  // the file stays open
  ASSERT_NE(read.take_source, nullptr);
  for (const std::size_t take : {5U, 0U, 3U}) {
    EXPECT_EQ(read.takes[take].motion.frameCount(), 0U);
    const MotionClip clip = read.take_source->load(TakeIndex(take));
    EXPECT_EQ(clip.positions_mm, written.takes[take].motion.positions_mm);
    EXPECT_EQ(clip.marker_names, written.takes[take].motion.marker_names);
    EXPECT_EQ(clip.frame_rate_hz, written.takes[take].motion.frame_rate_hz);
  }
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

TEST_F(CorpusFile, TakesOnDemandAreTheSameTakes) {
  Corpus written = samples::tinyCorpus();
  written.trajectory_model = samples::tinyModel(written);
  writeCorpus(path_, written);
  const Corpus loaded = readCorpus(path_);
  const Corpus open = readCorpus(path_, CorpusAudio::kSkip, CorpusMotion::kTakesOnDemand);
  EXPECT_TRUE(open.takes.empty());
  ASSERT_EQ(takeCount(open), written.takes.size());
  for (const std::size_t i : {5U, 0U, 3U, 1U, 5U}) {
    const TakeIndex take(i);
    EXPECT_EQ(takeNamed(open, written.takes[i].name), take);
    EXPECT_EQ(takeOf(open, take).name, written.takes[i].name);
    EXPECT_EQ(takeOf(open, take).text, written.takes[i].text);
    EXPECT_EQ(takeOf(open, take).motion.frame_rate_hz, written.takes[i].motion.frame_rate_hz);
    expectSameLabels(takeOf(open, take).labels, written.takes[i].labels);
    EXPECT_EQ(&takeOf(open, take), &takeOf(open, take)) << "kept";
    const PhoneShapes shapes = open.take_source->loadShapes(take), some = open.take_source->loadSomeShapes(take, 1, 2);
    EXPECT_EQ(some.captured, shapes.captured.middleRows(1, 2));
    EXPECT_EQ(some.predicted, shapes.predicted.middleRows(1, 2));
    EXPECT_EQ(some.tightest_mm, std::vector<float>(shapes.tightest_mm.begin() + 1, shapes.tightest_mm.begin() + 3));
    EXPECT_EQ(open.take_source->load(take).positions_mm, written.takes[i].motion.positions_mm);
    EXPECT_EQ(open.take_source->loadAudio(take).sample_rate_hz, written.takes[i].audio.sample_rate_hz);
  }
  EXPECT_EQ(takeNamed(open, "nobody"), std::nullopt);
  EXPECT_EQ(takeNamed(loaded, written.takes[2].name), TakeIndex(2));
  EXPECT_EQ(evenlySpreadTakes(open, 3), (std::vector<TakeIndex>{TakeIndex(0), TakeIndex(2), TakeIndex(4)}));
  EXPECT_EQ(evenlySpreadTakes(open, 100).size(), written.takes.size());

  const UnitDatabase a(loaded), b(open);
  const SpeechLabels line = samples::tinyLabels("T-EH-N M-AE-N", 5);
  for (const SelectionMethod method : {SelectionMethod::kGreedy, SelectionMethod::kViterbi}) {
    const auto from_all = selectUnits(line, a, {.method = method});
    const auto from_few = selectUnits(line, b, {.method = method});
    ASSERT_EQ(from_few.size(), from_all.size());
    for (std::size_t i = 0; i < from_all.size(); ++i) {
      EXPECT_EQ(from_few[i].source, from_all[i].source);
      EXPECT_EQ(from_few[i].target_cost, from_all[i].target_cost);
    }
  }
}

TEST_F(CorpusFile, ShapesLoadedByThePhoneAreThoseOfTheTake) {
  Corpus written = samples::tinyCorpus();
  written.trajectory_model = samples::tinyModel(written);
  writeCorpus(path_, written);
  const Corpus open = readCorpus(path_, CorpusAudio::kSkip, CorpusMotion::kTakesOnDemand);
  const UnitDatabase by_take(open), by_phone(open, 0), in_memory(written, 0);
  std::size_t compared = 0;
  for (std::size_t take = 0; take < written.takes.size(); ++take) {
    // Backwards, so that a phone is asked for before, after and together with the one behind it.
    for (std::size_t phone = written.takes[take].labels.phones.size(); phone-- > 0;) {
      for (const std::size_t asked : {phone, phone / 2}) {
        const PhonePlace place{TakeIndex(take), PhoneIndex(asked)};
        const PhoneShape wanted = by_take.shapeOf(place);
        for (const UnitDatabase* other : {&by_phone, &in_memory}) {
          constexpr float kRoundedMm = 0.005F;  // to steps of the range of what is loaded together
          const PhoneShape shape = other->shapeOf(place);
          ASSERT_EQ(shape.size, wanted.size);
          EXPECT_LT((shape.captured() - wanted.captured()).cwiseAbs().maxCoeff(), kRoundedMm) << take << " " << asked;
          EXPECT_LT((shape.predicted() - wanted.predicted()).cwiseAbs().maxCoeff(), kRoundedMm) << take << " " << asked;
          EXPECT_NEAR(other->tightestMm(place), by_take.tightestMm(place), kRoundedMm);
          ++compared;
        }
      }
    }
  }
  EXPECT_GT(compared, 40U);
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

TEST_F(CorpusFile, ReadsFromAReadOnlyFolderWithoutLeavingFiles) {
  writeCorpus(path_, samples::tinyCorpus());
  fs::permissions(path_, fs::perms::owner_read);
  fs::permissions(folder_, fs::perms::owner_read | fs::perms::owner_exec);
  EXPECT_EQ(complaint(), "");
  fs::permissions(folder_, fs::perms::owner_all);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()), 1);
}

TEST_F(CorpusFile, ANameWithUriCharactersOpens) {
  path_ = folder_ / "50% ?mode=rwc&x#y.corpus";
  writeCorpus(path_, samples::tinyCorpus());
  EXPECT_EQ(complaint(), "");
}

TEST_F(CorpusFile, WhatIsNoCorpusIsNamed) {
  EXPECT_EQ(complaint(), path_.string() + ": no such file");
  writeBytes("the time is now\n");
  EXPECT_EQ(complaint(), path_.string() + ": is no corpus database; expected a file made by `corpus build`");
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

TEST_F(CorpusFile, WritesTakesFromTheirSourceAndLoadsThemOneByOne) {
  const Corpus original = samples::tinyCorpus();
  writeCorpus(path_, samples::repeatedCorpus(original, 3));
  const Corpus whole = readCorpus(path_);
  const Corpus open = readCorpus(path_, CorpusAudio::kSkip, CorpusMotion::kOnDemand);
  ASSERT_EQ(whole.takes.size(), 3 * original.takes.size());
  for (std::size_t i = whole.takes.size(); i-- > 0;) {  // backwards: any row, in any order
    const MotionClip& first = original.takes[i % original.takes.size()].motion;
    const MotionClip loaded = open.take_source->load(TakeIndex(i));
    EXPECT_EQ(open.takes[i].motion.frameCount(), 0U);
    EXPECT_EQ(loaded.marker_names, first.marker_names);
    EXPECT_EQ(loaded.positions_mm, whole.takes[i].motion.positions_mm);
    EXPECT_EQ(loaded.positions_mm, first.positions_mm.cast<float>().cast<double>());
    EXPECT_EQ(loaded.frame_rate_hz, whole.takes[i].motion.frame_rate_hz);
    std::vector<bool> unseen;
    for (const auto& frame : loaded.positions_mm.rowwise()) unseen.push_back(frame.hasNaN());
    EXPECT_EQ(open.take_source->loadUnseen(TakeIndex(i)), unseen);
    EXPECT_TRUE(open.take_source->loadAudio(TakeIndex(i)).samples.empty());
  }
  EXPECT_THROW((void)open.take_source->load(TakeIndex(whole.takes.size())), InputError);
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
