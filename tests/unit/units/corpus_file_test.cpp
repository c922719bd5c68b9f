// What a corpus file keeps, of all versions.
#include <gtest/gtest.h>

#include <filesystem>
#include <limits>

#include "base/files.h"
#include "support/corpus_file_fixture.h"
#include "support/tiny_corpus.h"
#include "support/tiny_model.h"
#include "units/file/corpus.h"
#include "units/file/sqlite_database.h"
#include "units/selection/selection.h"
#include "units/selection/unit_database.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

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

}  // namespace
}  // namespace mouthpiece
