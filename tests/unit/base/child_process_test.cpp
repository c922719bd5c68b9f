#include "base/child_process.h"

#include <chrono>

#include "base/files.h"
#include "support/voice_testing.h"

namespace mouthpiece {
namespace {

constexpr Seconds kPatience = 20;

ChildResult runShell(const PrivateFolder& folder, const std::string& command, Seconds time_limit = kPatience) {
  return runChild(findProgram("sh").value(), {"-c", command}, folder.path(), time_limit);
}

TEST(PrivateFolder, IsOursAloneAndGoesAway) {
  std::filesystem::path path;
  {
    const PrivateFolder folder;
    path = folder.path();
    EXPECT_EQ(std::filesystem::status(path).permissions(), std::filesystem::perms::owner_all);
    writeFileAtomically(path / "a" / "b", std::string_view("x"));
  }
  EXPECT_FALSE(std::filesystem::exists(path));
}

TEST(ChildProcess, RunsInItsFolderWithAMinimalEnvironment) {
  const PrivateFolder folder;
  ::setenv("MOUTHPIECE_TEST_SECRET", "seen", 1);
  const ChildResult result =
      runShell(folder, "pwd; echo \"$HOME|$MOUTHPIECE_TEST_SECRET|$LC_ALL\"; echo oops >&2; cat; exit 3");
  ::unsetenv("MOUTHPIECE_TEST_SECRET");
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_FALSE(result.timed_out);
  EXPECT_EQ(result.output, folder.path().string() + "\n" + folder.path().string() + "||C\noops\n");
}

TEST(ChildProcess, PassesArgumentsWithoutAShell) {
  const PrivateFolder folder;
  const ChildResult result = runChild(findProgram("echo").value(), {"$(id)", ";", "`id`"}, folder.path(), kPatience);
  EXPECT_EQ(result.output, "$(id) ; `id`\n");
}

TEST(ChildProcess, IsKilledWhenItTakesTooLong) {
  const PrivateFolder folder;
  const auto start = std::chrono::steady_clock::now();
  const ChildResult silent = runChild(findProgram("sleep").value(), {"60"}, folder.path(), 0.2);
  EXPECT_TRUE(silent.timed_out);
  EXPECT_EQ(silent.exit_code, 128 + 9);
  const ChildResult closed = runShell(folder, "exec >/dev/null 2>&1; exec sleep 60", 0.2);
  EXPECT_TRUE(closed.timed_out);
  const ChildResult chatty = runShell(folder, "while :; do echo y; done", 0.2);
  EXPECT_TRUE(chatty.timed_out);
  EXPECT_LT(chatty.output.size(), 64U * 1024U);
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(30));
}

TEST(ChildProcess, SaysWhenAProgramCannotStart) {
  const PrivateFolder folder;
  EXPECT_NE(errorOf([&] {
              runChild("/no/such/program", {}, folder.path(), 1);
            }).find("/no/such/program: cannot be started: "),
            std::string::npos);
  EXPECT_FALSE(findProgram("no such program"));
}

}  // namespace
}  // namespace mouthpiece
