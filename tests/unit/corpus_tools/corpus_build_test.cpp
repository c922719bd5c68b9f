// Builds that go on: interrupted ones, and corpora that takes are added to.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <Eigen/Geometry>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <random>
#include <set>
#include <thread>

#include "base/errors.h"
#include "base/files.h"
#include "base/unfinished.h"
#include "corpus_tools/building/build_state.h"
#include "corpus_tools/building/corpus_builder.h"
#include "support/error_of.h"
#include "support/run_program.h"
#include "synthesis/curve_model.h"
#include "synthetic_takes.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using test::ScratchFolder;

constexpr int kKills = 100;

void writeTake(const fs::path& folder, unsigned seed) {
  SyntheticTake take;
  take.name = "take" + std::to_string(seed);
  take.seed = seed;
  take.noise_mm = 0.05;
  take.write(folder);
}

struct Studio {
  ScratchFolder scratch;
  fs::path folder = scratch.path() / "takes";
  fs::path out = scratch.path() / "x.corpus";
  explicit Studio(unsigned takes) {
    fs::create_directories(folder);
    for (unsigned seed = 1; seed <= takes; ++seed) writeTake(folder, seed);
  }
};

TEST(BuildCorpusFile, TakesThatAreThereAreNotDoneAgain) {
  const Studio studio(3);
  const BuildResult first = buildCorpusFile(studio.folder, studio.out, {});
  EXPECT_EQ(first.kept_takes, 0U);
  EXPECT_FALSE(fs::exists(studio.out.string() + ".parts"));
  const std::string bytes = test::readAll(studio.out);
  const Corpus three = readCorpus(studio.out);
  EXPECT_EQ(three.viseme_poses, posesToJson(learnPoses(three)));
  EXPECT_EQ(buildCorpusFile(studio.folder, studio.out, {}).kept_takes, 3U);
  EXPECT_EQ(test::readAll(studio.out), bytes) << "a build of the same takes must change nothing";

  writeTake(studio.folder, 4);
  const BuildResult more = buildCorpusFile(studio.folder, studio.out, {});
  EXPECT_EQ(more.kept_takes, 3U);
  ASSERT_EQ(more.corpus.takes.size(), 4U);
  const Corpus read = readCorpus(studio.out);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_LT((read.takes[i].motion.positions_mm - three.takes[i].motion.positions_mm).cwiseAbs().maxCoeff(), 1e-4);
  }
  // The new take lands where a build of all four would put it, up to the noise in the head's mean shape.
  const BuildResult at_once = buildCorpus(studio.folder, {});
  EXPECT_LT((read.takes[3].motion.positions_mm - at_once.corpus.takes[3].motion.positions_mm).cwiseAbs().maxCoeff(),
            0.15);
}

TEST(BuildCorpusFile, AChangedTakeOrOtherOptionsAreDoneAgain) {
  const Studio studio(2);
  buildCorpusFile(studio.folder, studio.out, {});
  SyntheticTake changed;
  changed.name = "take2";
  changed.seed = 77;
  changed.noise_mm = 0.05;
  changed.write(studio.folder);
  EXPECT_EQ(buildCorpusFile(studio.folder, studio.out, {}).kept_takes, 1U);
  BuildOptions rough;
  rough.cleaning.smooth = false;
  EXPECT_EQ(buildCorpusFile(studio.folder, studio.out, rough).kept_takes, 0U);
}

TEST(BuildCorpusFile, WhatAFailedBuildDidIsTakenUp) {
  const Studio studio(3);
  fs::create_directories(studio.out / "in the way");
  EXPECT_THROW(buildCorpusFile(studio.folder, studio.out, {}), InputError);
  fs::remove_all(studio.out);
  EXPECT_EQ(buildCorpusFile(studio.folder, studio.out, {}).kept_takes, 3U);
  const std::string resumed = test::readAll(studio.out);
  fs::remove(studio.out);
  buildCorpusFile(studio.folder, studio.out, {});
  EXPECT_EQ(test::readAll(studio.out), resumed) << "a resumed build must give the corpus of an undisturbed one";
}

TEST(BuildParts, AreOfOneBuildAtATime) {
  const test::ScratchFolder scratch;
  const fs::path folder = scratch.path() / "x.corpus.parts";
  {
    const BuildParts first(folder, defaultLayout(), "frame");
    EXPECT_EQ(errorOf([&] { const BuildParts second(folder, defaultLayout(), "frame"); }),
              folder.string() + ": is in use: the same corpus is being built by process " + std::to_string(::getpid()));
  }
  EXPECT_FALSE(fs::exists(folder)) << "a folder without parts stays for nobody";
  EXPECT_NO_THROW(BuildParts(folder, defaultLayout(), "frame"));
}

/// Who has locked the folder a moment ago tells who it is a little later.
TEST(BuildParts, WaitToTellWhoseTheyAre) {
  const test::ScratchFolder scratch;
  const fs::path folder = scratch.path() / "x.corpus.parts";
  fs::create_directories(folder);
  const FileLock theirs(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  const std::jthread teller([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    writeFileAtomically(folder / "process", std::string_view("4711"));
  });
  EXPECT_EQ(errorOf([&] { const BuildParts second(folder, defaultLayout(), "frame"); }),
            folder.string() + ": is in use: the same corpus is being built by process 4711");
}

TEST(FinishedTakes, AreTheSameFromMemoryAndFromTheirParts) {
  const test::ScratchFolder scratch;
  const BuildParts parts(scratch.path() / "parts", defaultLayout(), "frame");
  CleanedTake cleaned{SyntheticTake{}.clean(), {}};
  cleaned.report.key = cleaned.report.name = "key";
  roundToFile(cleaned.take.motion);
  parts.store(cleaned);
  FinishedTakes held(parts), stored(parts, 0);
  for (FinishedTakes* takes : {&held, &stored}) {
    MotionClip motion = cleaned.take.motion;
    takes->takeOver("key", motion);
    EXPECT_EQ(motion.positions_mm.size(), 0) << "the caller keeps nothing";
    EXPECT_EQ(motion.marker_names, cleaned.take.motion.marker_names);
    takes->addPart("key");
  }
  EXPECT_EQ(held.load(TakeIndex(0)).positions_mm, cleaned.take.motion.positions_mm);
  const RigidMotion move{Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitY()).toRotationMatrix(), {1, 2, 3}};
  const RigidMotion turn{Eigen::AngleAxisd(-0.2, Eigen::Vector3d::UnitX()).toRotationMatrix(), {0, -5, 0}};
  for (FinishedTakes* takes : {&held, &stored}) {
    takes->move(0, move);
    takes->turnAll(turn);
  }
  const MotionClip moved = held.load(TakeIndex(0));
  EXPECT_EQ(moved.positions_mm, stored.load(TakeIndex(0)).positions_mm);
  EXPECT_LT((moved.position(FrameIndex(3), MarkerIndex(5)) -
             turn.apply(move.apply(cleaned.take.motion.position(FrameIndex(3), MarkerIndex(5)))))
                .norm(),
            1e-3);  // the file's step is 1/1024 mm
  EXPECT_EQ(stored.loadAudio(TakeIndex(0)).samples.size(), cleaned.take.audio.samples.size());
}

TEST(BuildCorpusFile, KilledAtAnyMomentTheOldCorpusIsWhole) {
  const Studio studio(2);
  buildCorpusFile(studio.folder, studio.out, {});
  const std::string before = test::readAll(studio.out);
  for (unsigned seed = 3; seed <= 5; ++seed) writeTake(studio.folder, seed);
  const std::vector<std::string> build{"build", studio.folder.string(), "--out", studio.out.string(), "--quiet"};
  const auto put_back = [&] {
    fs::remove(studio.out);
    std::ofstream(studio.out, std::ios::binary) << before;
  };
  const auto start = std::chrono::steady_clock::now();
  ASSERT_EQ(test::runProgram("corpus", build).exit_code, 0);
  const std::chrono::microseconds whole_run =
      std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::steady_clock::now() - start);
  put_back();
  std::mt19937 random(5);
  int finished = 0;
  std::set<fs::path> half_written;
  for (int i = 0; i < kKills; ++i) {
    const std::chrono::microseconds wait(std::uniform_int_distribution<std::int64_t>(1000, whole_run.count())(random));
    finished += test::runProgram("corpus", build, {}, wait).exit_code == 0 ? 1 : 0;
    for (const auto& entry : fs::directory_iterator(studio.scratch.path())) {
      if (entry.path().filename().string().starts_with('.')) half_written.insert(entry.path());
    }
    const std::string now = test::readAll(studio.out);
    if (now == before) continue;
    ASSERT_TRUE(checkCorpus(studio.out).empty());
    ASSERT_EQ(readCorpus(studio.out).takes.size(), 5U);
    put_back();
  }
  RecordProperty("finished", finished);
  RecordProperty("half_written", static_cast<int>(half_written.size()));
  EXPECT_FALSE(half_written.empty()) << "no kill came while the corpus was written; " << finished << " runs finished";
  const BuildResult last = buildCorpusFile(studio.folder, studio.out, {});
  EXPECT_EQ(last.corpus.takes.size(), 5U);
  EXPECT_GE(last.kept_takes, 2U);
  // What a killed run left beside the corpus is swept by the next program, once it is a minute old.
  for (const auto& entry : fs::directory_iterator(studio.scratch.path())) {
    if (entry.is_regular_file()) fs::last_write_time(entry.path(), fs::file_time_type::clock::now() - 1h);
  }
  EXPECT_EQ(test::runProgram("corpus", build).exit_code, 0);
  for (const auto& entry : fs::directory_iterator(studio.scratch.path())) {
    EXPECT_TRUE(entry.path() == studio.out || entry.path() == studio.folder) << entry.path() << " was left behind";
  }
}

TEST(CorpusCheck, FindsAFlippedBitAnywhereInMotionAndLabels) {
  const Studio studio(1);
  buildCorpusFile(studio.folder, studio.out, {});
  const std::string whole = test::readAll(studio.out);
  ASSERT_TRUE(checkCorpus(studio.out).empty());
  // Every place that holds data: a flip that changes what is read must be found. Free bytes of a page may change.
  const Corpus truth = readCorpus(studio.out, CorpusAudio::kLoad);
  std::mt19937 random(6);
  int found = 0;
  for (int i = 0; i < 200; ++i) {
    std::string damaged = whole;
    const std::size_t at = random() % damaged.size();
    damaged[at] = static_cast<char>(static_cast<unsigned char>(damaged[at]) ^ (1U << (random() % 8)));
    const fs::path copy = studio.scratch.write("damaged.corpus", damaged);
    if (!checkCorpus(copy).empty()) {
      ++found;
      continue;
    }
    const Corpus read = readCorpus(copy, CorpusAudio::kLoad);
    ASSERT_EQ(read.takes.size(), 1U);
    EXPECT_EQ(read.takes[0].motion.positions_mm, truth.takes[0].motion.positions_mm) << "byte " << at;
    EXPECT_EQ(read.takes[0].audio.samples, truth.takes[0].audio.samples) << "byte " << at;
    ASSERT_EQ(read.takes[0].labels.phones.size(), truth.takes[0].labels.phones.size());
    for (std::size_t p = 0; p < truth.takes[0].labels.phones.size(); ++p) {
      EXPECT_EQ(read.takes[0].labels.phones[p].phone, truth.takes[0].labels.phones[p].phone);
      EXPECT_EQ(read.takes[0].labels.phones[p].span, truth.takes[0].labels.phones[p].span);
    }
  }
  EXPECT_GT(found, 100);
}

}  // namespace
}  // namespace mouthpiece
