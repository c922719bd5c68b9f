// Files that programs write, as a state machine: whatever happens to a run, its output is the old file or the new one.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <random>

#include "support/run_program.h"

namespace mouthpiece::test {
namespace {

namespace fs = std::filesystem;
using Arguments = std::vector<std::string>;

/// A made-up motion of `frames` frames and four markers, as CSV.
std::string motionCsv(std::size_t frames, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> move(-1, 1);
  std::string text = "time_s";
  for (const char* name : {"LIP_UP_MID", "LIP_LO_MID", "CHIN", "BROW"}) {
    for (const char axis : {'x', 'y', 'z'}) text += fmt::format(",{}.{}", name, axis);
  }
  for (std::size_t f = 0; f < frames; ++f) {
    text += fmt::format("\n{:.6f}", static_cast<double>(f) / 100);
    for (int column = 0; column < 12; ++column) text += fmt::format(",{:.4f}", 10 * column + move(random));
  }
  return text + "\n";
}

/// A tetrahedron; `size` tells one from another.
std::string tetrahedron(int size) {
  return fmt::format("v 0 0 0\nv {0} 0 0\nv 0 {0} 0\nv 0 0 {0}\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n", size);
}

/// What a run was to write, and what it was given.
struct Job {
  std::string program;
  Arguments arguments;  ///< "OUT" stands for the output
};

Arguments filled(const Job& job, const fs::path& out) {
  Arguments arguments = job.arguments;
  std::replace(arguments.begin(), arguments.end(), std::string("OUT"), out.string());
  return arguments;
}

class WrittenFiles : public testing::Test {
 protected:
  void SetUp() override {
    const auto file = [&](const std::string& name, const std::string& bytes) {
      return folder_.write("in/" + name, bytes).string();
    };
    const std::string one = file("one.csv", motionCsv(300, 1)), two = file("two.csv", motionCsv(2500, 2));
    jobs_["motion.c3d"] = {{"corpus", {"convert", one, "OUT"}}, {"corpus", {"convert", two, "OUT"}}};
    jobs_["motion.trc"] = {{"corpus", {"convert", two, "OUT"}}, {"corpus", {"convert", one, "OUT"}}};
    jobs_["pick.html"] = {{"retarget", {"pick", file("a.obj", tetrahedron(1)), "--out", "OUT"}},
                          {"retarget", {"pick", file("b.obj", tetrahedron(2)), "--out", "OUT"}}};
    const std::string bad = file("bad.csv", "time_s,A.x,A.y,A.z\n0,1,2\n"), no_mesh = file("bad.obj", "v 1 2\n");
    bad_ = {{"motion.c3d", {"corpus", {"convert", bad, "OUT"}}},
            {"motion.trc", {"corpus", {"convert", bad, "OUT"}}},
            {"pick.html", {"retarget", {"pick", no_mesh, "--out", "OUT"}}}};
    fs::create_directories(folder_.path() / "out");
    for (const auto& [name, jobs] : jobs_) {
      for (const Job& job : jobs) results_[name].push_back(madeAlone(name, job));
      EXPECT_NE(results_[name][0], results_[name][1]) << name;
    }
  }

  /// What `job` writes where nothing was.
  std::string madeAlone(const std::string& name, const Job& job) const {
    const ScratchFolder alone;
    const ProgramResult result = runProgram(job.program, filled(job, alone.path() / name));
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return readAll(alone.path() / name);
  }

  [[nodiscard]] fs::path outputOf(const std::string& name) const { return folder_.path() / "out" / name; }

  /// The output folder holds what `expected` says, and nothing half-written.
  void expectFiles(const std::map<std::string, std::string>& expected) const {
    for (const auto& [name, bytes] : expected) EXPECT_TRUE(readAll(outputOf(name)) == bytes) << name;
    for (const auto& entry : fs::directory_iterator(folder_.path() / "out"))
      EXPECT_TRUE(expected.contains(entry.path().filename().string())) << entry.path() << " was left";
  }

  ScratchFolder folder_;
  std::map<std::string, std::vector<Job>> jobs_;             ///< by the name of what they write
  std::map<std::string, std::vector<std::string>> results_;  ///< of `jobs_`
  std::map<std::string, Job> bad_;
};

TEST_F(WrittenFiles, AreTheLastSuccessWhateverRan) {
  std::mt19937 random(20);
  std::map<std::string, std::string> files;
  const std::vector<std::string> names{"motion.c3d", "motion.trc", "pick.html"};
  for (int step = 0; step < 60; ++step) {
    const std::string& name = names[random() % names.size()];
    const std::size_t which = random() % 2;
    switch (random() % 4) {
      case 0: {  // bad input
        const ProgramResult result = runProgram(bad_[name].program, filled(bad_[name], outputOf(name)));
        EXPECT_EQ(result.exit_code, 1) << result.err;
        EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
        break;
      }
      case 1: {  // wrong usage
        Arguments arguments = filled(jobs_[name][which], outputOf(name));
        arguments.emplace_back("--no-such-option");
        EXPECT_EQ(runProgram(jobs_[name][which].program, arguments).exit_code, 2);
        break;
      }
      default: {
        const ProgramResult result = runProgram(jobs_[name][which].program, filled(jobs_[name][which], outputOf(name)));
        EXPECT_EQ(result.exit_code, 0) << result.err;
        files[name] = results_[name][which];
      }
    }
    expectFiles(files);
  }
  EXPECT_EQ(files.size(), names.size()) << "too few steps to have written each";
}

TEST_F(WrittenFiles, AKilledRunLeavesTheOldFileOrTheNew) {
  std::mt19937 random(7);
  for (const auto& [name, jobs] : jobs_) {
    ASSERT_EQ(runProgram(jobs[0].program, filled(jobs[0], outputOf(name))).exit_code, 0);
    const auto start = std::chrono::steady_clock::now();
    (void)madeAlone(name, jobs[1]);
    const auto whole = std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::steady_clock::now() - start);
    std::size_t now = 0, killed = 0;
    for (int trial = 0; trial < 25; ++trial) {
      const std::size_t next = 1 - now;
      const std::chrono::microseconds life(random() % static_cast<std::size_t>(whole.count() + 1));
      const ProgramResult result = runProgram(jobs[next].program, filled(jobs[next], outputOf(name)), {}, life);
      const std::string bytes = readAll(outputOf(name));
      const bool is_new = bytes == results_[name][next], is_old = bytes == results_[name][now];
      ASSERT_TRUE(is_new || is_old) << name << " is neither the old nor the new after " << life.count() << " us";
      EXPECT_TRUE(result.exit_code == 137 || is_new) << "a run that ended well wrote nothing";
      killed += result.exit_code == 137 ? 1 : 0;
      now = is_new ? next : now;
    }
    EXPECT_GT(killed, 0U) << name;
    // What a killed run left does not stand in the next one's way.
    ASSERT_EQ(runProgram(jobs[0].program, filled(jobs[0], outputOf(name))).exit_code, 0);
    EXPECT_TRUE(readAll(outputOf(name)) == results_[name][0]);
  }
}

TEST_F(WrittenFiles, FoldersAreMadeOnTheWay) {
  for (const auto& [name, jobs] : jobs_) {
    const fs::path deep = folder_.path() / "a/b c/ü" / name;
    const ProgramResult result = runProgram(jobs[0].program, filled(jobs[0], deep));
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_TRUE(readAll(deep) == results_[name][0]);
  }
}

TEST_F(WrittenFiles, AFolderInTheWayIsNamed) {
  for (const auto& [name, jobs] : jobs_) {
    fs::create_directories(outputOf(name) / "inside");
    const ProgramResult result = runProgram(jobs[0].program, filled(jobs[0], outputOf(name)));
    EXPECT_EQ(result.exit_code, 1) << result.out;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_NE(result.err.find(name), std::string::npos) << result.err;
    EXPECT_TRUE(fs::exists(outputOf(name) / "inside"));
  }
}

TEST_F(WrittenFiles, AFileThatIsReadIsNotWrittenOver) {
  const std::string before = motionCsv(50, 3);
  const fs::path both = folder_.write("both.csv", before);
  EXPECT_EQ(runProgram("corpus", {"convert", both.string(), both.string()}).exit_code, 1);
  EXPECT_EQ(readAll(both), before);
}

TEST_F(WrittenFiles, ConvertingThereAndBackIsTheSame) {
  const fs::path csv = folder_.write("a.csv", motionCsv(120, 4));
  const auto path = [&](const char* name) { return (folder_.path() / name).string(); };
  for (const std::string middle : {"b.c3d", "b.trc"}) {
    const fs::path there = folder_.path() / middle;
    ASSERT_EQ(runProgram("corpus", {"convert", csv.string(), there.string()}).exit_code, 0);
    ASSERT_EQ(runProgram("corpus", {"convert", there.string(), path("c.csv")}).exit_code, 0);
    ASSERT_EQ(runProgram("corpus", {"convert", path("c.csv"), path("again") + there.extension().string()}).exit_code,
              0);
    ASSERT_EQ(runProgram("corpus", {"convert", path("again") + there.extension().string(), path("d.csv")}).exit_code,
              0);
    EXPECT_EQ(readAll(path("c.csv")), readAll(path("d.csv"))) << "once rounded, a motion stays";
  }
}

}  // namespace
}  // namespace mouthpiece::test
