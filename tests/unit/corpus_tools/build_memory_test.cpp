// A build holds the takes it works on, not all of them.
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <string>

#include "support/run_program.h"
#include "synthetic_takes.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

/// What is learnt from all takes at once, their lips and sound at 25 Hz and their phones, needs 43 MB for 200 of them.
constexpr long kMostGrowthKiB = 50'000;
/// 100 Hz, 66 markers: one take's motion is 0.2 MB, so 200 held in memory would add 40 MB to that.
constexpr unsigned kManyTakes = 200;

/// The most memory that `corpus build` of so many takes held, in KiB.
long peakOfBuild(unsigned takes) {
  const test::ScratchFolder folder;
  const fs::path in = folder.path() / "takes";
  fs::create_directories(in);
  for (unsigned i = 0; i < takes; ++i) {
    SyntheticTake take;
    take.name = "take" + std::to_string(i);
    take.seed = i + 1;
    take.write(in);
  }
  const std::string program = MOUTHPIECE_BIN_DIR "/corpus", out = (folder.path() / "x.corpus").string();
  const pid_t child = fork();
  if (child == 0) {
    execl(program.c_str(), "corpus", "build", in.c_str(), "--out", out.c_str(), "--jobs", "1", "--quiet", nullptr);
    _exit(127);
  }
  int status = 0;
  rusage usage{};
  if (child < 0 || wait4(child, &status, 0, &usage) != child) return 0;
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
  EXPECT_TRUE(fs::exists(out));
  return usage.ru_maxrss;
}

TEST(BuildMemory, DoesNotGrowWithTheNumberOfTakes) {
  const long few = peakOfBuild(4), many = peakOfBuild(kManyTakes);
  ASSERT_GT(few, 1000);
  EXPECT_LT(many - few, kMostGrowthKiB) << many << " KiB, " << few << " of four";
}

}  // namespace
}  // namespace mouthpiece
