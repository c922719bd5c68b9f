// The builder as a machine with a state, its folder and its corpus: takes come, change and go, builds are repeated and
// broken off. Whatever the way there, the corpus is one of the folder's takes.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <random>

#include "base/errors.h"
#include "base/index.h"
#include "corpus_tools/building/corpus_builder.h"
#include "corpus_tools/takes/take_report.h"
#include "support/run_program.h"
#include "synthetic_takes.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

constexpr unsigned kMachines = 3;
constexpr int kSteps = 6;
/// A take that joins finds the head of the takes before it, which has their noise.
constexpr double kJoinedToleranceMm = 0.3;

/// The usual options with so many takes at once.
BuildOptions withJobs(std::size_t jobs, bool strict = false) {
  BuildOptions options;
  options.jobs = jobs;
  options.strict = strict;
  return options;
}

/// A folder of takes and what they are: name -> seed of the take's noise and of the head's way.
class Folder {
 public:
  explicit Folder(const fs::path& path) : path_(path) { fs::create_directories(path_); }

  void put(const std::string& name, unsigned seed) {
    SyntheticTake take;
    take.name = name;
    take.seed = seed;
    take.noise_mm = 0.05;
    take.write(path_);
    takes_[name] = seed;
  }
  void remove(const std::string& name) {
    for (const char* ending : {".c3d", ".wav", ".txt", ".TextGrid"}) fs::remove(path_ / (name + ending));
    takes_.erase(name);
  }
  /// One random change; `number` makes new names and seeds.
  void change(std::mt19937& random, unsigned number) {
    const std::size_t kind = takes_.size() < 2 ? 0 : random() % 3;
    const auto any = std::next(takes_.begin(), static_cast<std::ptrdiff_t>(random() % takes_.size()));
    if (kind == 0) put("take" + std::to_string(number), number);
    if (kind == 1) put(std::string(any->first), 1000 + number);
    if (kind == 2) remove(std::string(any->first));
  }
  [[nodiscard]] const std::map<std::string, unsigned>& takes() const { return takes_; }
  [[nodiscard]] const fs::path& path() const { return path_; }

 private:
  fs::path path_;
  std::map<std::string, unsigned> takes_;
};

std::map<std::string, CorpusTake> byName(const Corpus& corpus) {
  std::map<std::string, CorpusTake> takes;
  for (const CorpusTake& take : corpus.takes) takes[take.name] = take;
  return takes;
}

std::vector<std::string> namesOf(const std::map<std::string, unsigned>& takes) {
  std::vector<std::string> names;
  for (const auto& [name, seed] : takes) names.push_back(name);
  return names;
}

std::size_t sameIn(const std::map<std::string, unsigned>& a, const std::map<std::string, unsigned>& b) {
  std::size_t same = 0;
  for (const auto& [name, seed] : a) same += b.contains(name) && b.at(name) == seed ? 1U : 0U;
  return same;
}

double largestDifference(const CorpusTake& a, const CorpusTake& b) {
  return (a.motion.positions_mm - b.motion.positions_mm).cwiseAbs().maxCoeff();
}

TEST(BuildLaws, TakesComeChangeAndGo) {
  for (unsigned machine = 1; machine <= kMachines; ++machine) {
    SCOPED_TRACE(testing::Message() << "machine " << machine);
    const test::ScratchFolder scratch;
    const fs::path out = scratch.path() / "x.corpus";
    std::mt19937 random(machine);
    Folder folder(scratch.path() / "takes");
    folder.put("take1", 1);
    folder.put("take2", 2);
    std::map<std::string, unsigned> built;
    Corpus before;
    for (int step = 0; step < kSteps; ++step) {
      SCOPED_TRACE(testing::Message() << "step " << step);
      const BuildResult result = buildCorpusFile(folder.path(), out, withJobs(1 + random() % 3));
      const Corpus now = readCorpus(out, CorpusAudio::kLoad);
      // The folder's takes, by name, each done once unless it was there before.
      std::vector<std::string> names;
      for (const CorpusTake& take : now.takes) names.push_back(take.name);
      EXPECT_EQ(names, namesOf(folder.takes()));
      EXPECT_EQ(result.kept_takes, sameIn(folder.takes(), built));
      EXPECT_TRUE(result.left_out.empty());
      // Those that stay do not move; those that join lie where a build of all would put them.
      const auto old = byName(before), from_nothing = byName(buildCorpus(folder.path(), {}).corpus);
      for (const CorpusTake& take : now.takes) {
        const CorpusTake& fresh = from_nothing.at(take.name);
        EXPECT_LT(largestDifference(take, fresh), kJoinedToleranceMm) << take.name;
        EXPECT_EQ(take.audio.samples, fresh.audio.samples);
        EXPECT_EQ(take.text, fresh.text);
        EXPECT_EQ(take.labels.phones.size(), fresh.labels.phones.size());
        const bool stays = built.contains(take.name) && built.at(take.name) == folder.takes().at(take.name);
        if (!stays || result.kept_takes == 0) continue;
        EXPECT_LT(largestDifference(take, old.at(take.name)), 1e-4) << take.name;
      }
      // Building again changes no byte.
      const std::string bytes = test::readAll(out);
      EXPECT_EQ(buildCorpusFile(folder.path(), out, {}).kept_takes, folder.takes().size());
      EXPECT_EQ(test::readAll(out), bytes);
      EXPECT_FALSE(fs::exists(out.string() + ".parts"));
      built = folder.takes();
      before = now;
      folder.change(random, 100 * machine + static_cast<unsigned>(step));
    }
  }
}

/// A build that breaks off at any take, and then goes on, is the build that was never disturbed.
TEST(BuildLaws, ABuildThatBreaksOffGoesOn) {
  const test::ScratchFolder scratch;
  Folder folder(scratch.path() / "takes");
  for (unsigned seed = 1; seed <= 4; ++seed) folder.put("take" + std::to_string(seed), seed);
  const fs::path whole = scratch.path() / "a" / "x.corpus";
  buildCorpusFile(folder.path(), whole, {});
  struct Stop {};
  for (std::size_t steps = 1; steps <= 8; ++steps) {
    SCOPED_TRACE(steps);
    const fs::path out = scratch.path() / std::to_string(steps) / "x.corpus";
    const auto stopAfter = [&](std::size_t done, std::size_t) {
      if (done == steps) throw Stop();
    };
    EXPECT_THROW(buildCorpusFile(folder.path(), out, withJobs(1), stopAfter), Stop);
    EXPECT_FALSE(fs::exists(out)) << "nothing half done stands there";
    const BuildResult rest = buildCorpusFile(folder.path(), out, {});
    // The first half of the steps looks at the heads; of the second each does a take.
    EXPECT_EQ(rest.kept_takes, steps > 4 ? steps - 4 : 0);
    EXPECT_EQ(test::readAll(out), test::readAll(whole));
  }
}

TEST(BuildLaws, ADamagedTakeIsLeftOutUntilItIsMended) {
  const test::ScratchFolder scratch;
  const fs::path out = scratch.path() / "x.corpus";
  Folder folder(scratch.path() / "takes");
  for (unsigned seed = 1; seed <= 3; ++seed) folder.put("take" + std::to_string(seed), seed);
  buildCorpusFile(folder.path(), out, {});
  for (const char* ending : {".c3d", ".wav", ".TextGrid"}) {
    SCOPED_TRACE(ending);
    const fs::path file = folder.path() / (std::string("take2") + ending);
    const std::string bytes = test::readAll(file);
    std::ofstream(file, std::ios::binary) << bytes.substr(0, bytes.size() / 3);
    const BuildResult damaged = buildCorpusFile(folder.path(), out, {});
    ASSERT_EQ(damaged.left_out.size(), 1U);
    EXPECT_EQ(damaged.left_out[0].name, "take2");
    EXPECT_NE(damaged.left_out[0].reason.find("take2"), std::string::npos) << "it names the file";
    EXPECT_EQ(damaged.kept_takes, 2U);
    EXPECT_THROW(buildCorpusFile(folder.path(), scratch.path() / "strict.corpus", withJobs(1, true)), InputError);
    std::ofstream(file, std::ios::binary) << bytes;
    EXPECT_EQ(buildCorpusFile(folder.path(), out, {}).kept_takes, 2U);
    EXPECT_EQ(readCorpus(out).takes.size(), 3U);
  }
}

/// The log's reports are read as they were written, and what is damaged gives none rather than wrong ones.
TEST(BuildLaws, ReportsSurviveTheLog) {
  for (unsigned seed = 1; seed <= 40; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    std::vector<TakeReport> reports(random() % 4);
    for (TakeReport& report : reports) {
      report.name = "take" + std::to_string(random() % 100);
      report.key = std::string(random() % 64, 'k');
      report.frames = random();
      report.spikes = random() % 10;
      report.noise_mm = 1e-3 * asReal(random() % 1000);
      report.labels_found = random() % 2 == 0;
      report.lips.closure_changes_mm.assign(random() % 5, 0.125);
      report.lips.jerk_after[random() % LipFidelity::kBands] = 2.5;
      for (std::size_t n = random() % 3; n > 0; --n) report.doubtful.push_back({"word", {0.5, 1.25}, 0.75});
    }
    const std::string text = reportsToJson(reports);
    const std::vector<TakeReport> read = reportsFromJson(text);
    EXPECT_EQ(reportsToJson(read), text);
    ASSERT_EQ(read.size(), reports.size());
    for (std::size_t i = 0; i < read.size(); ++i) {
      EXPECT_EQ(read[i].key, reports[i].key);
      EXPECT_EQ(read[i].frames, reports[i].frames);
      EXPECT_EQ(read[i].lips.jerk_after, reports[i].lips.jerk_after);
      EXPECT_EQ(read[i].doubtful.size(), reports[i].doubtful.size());
    }
    EXPECT_TRUE(reportsFromJson(text.substr(0, random() % text.size())).empty());
  }
}

}  // namespace
}  // namespace mouthpiece
