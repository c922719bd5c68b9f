#include "base/child_process.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <fstream>
#include <memory>
#include <set>
#include <thread>

#include "base/files.h"
#include "support/error_of.h"

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

/// Whether the process ends within a few seconds; one that nobody has waited for yet has ended.
bool hasEnded(const std::string& number) {
  for (int tries = 0; tries < 500; ++tries) {
    std::ifstream stream("/proc/" + number + "/stat");
    std::string facts;
    if (!std::getline(stream, facts) || facts.find(") Z") != std::string::npos) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return false;
}
bool ends(const std::filesystem::path& number_file) {
  std::string number = readFile(number_file);
  number.erase(number.find_last_not_of('\n') + 1);
  return hasEnded(number);
}

TEST(ChildProcess, WhatItStartedEndsWithIt) {
  const PrivateFolder folder;
  const std::string start_another = "sleep 60 >/dev/null 2>&1 & echo $! > other;";
  EXPECT_EQ(runShell(folder, start_another + "exit 3").exit_code, 3);
  EXPECT_TRUE(ends(folder.path() / "other"));
  EXPECT_TRUE(runShell(folder, start_another + "sleep 60", 0.3).timed_out);
  EXPECT_TRUE(ends(folder.path() / "other"));
}

TEST(ChildProcess, HearsSignalsWhateverThisProcessHoldsBack) {
  const PrivateFolder folder;
  sigset_t held, before;
  sigemptyset(&held);
  sigaddset(&held, SIGTERM);
  ::pthread_sigmask(SIG_BLOCK, &held, &before);
  const ChildResult result = runShell(folder, "kill -TERM $$; sleep 5; exit 7");
  ::pthread_sigmask(SIG_SETMASK, &before, nullptr);
  EXPECT_EQ(result.exit_code, 128 + SIGTERM);
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

TEST(ChildProcess, ItsOwnChildrenAreKilledWithIt) {
  const PrivateFolder folder;
  const ChildResult result = runShell(folder, "(sleep 60; echo late > late) & echo $!; wait", 0.3);
  EXPECT_TRUE(result.timed_out);
  const std::string process = "/proc/" + std::to_string(std::stol(result.output));
  for (int tries = 0; tries < 200 && std::filesystem::exists(process + "/exe"); ++tries)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  std::error_code error;
  EXPECT_TRUE(std::filesystem::read_symlink(process + "/exe", error).empty()) << "it still runs";
}

TEST(ChildProcess, KeepsTheEndOfALongOutput) {
  const PrivateFolder folder;
  const ChildResult result = runShell(folder, "i=0; while [ $i -lt 20000 ]; do echo line $i; i=$((i+1)); done");
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_TRUE(result.output.ends_with("line 19998\nline 19999\n"));
  EXPECT_GE(result.output.size(), 16384U);
  EXPECT_LE(result.output.size(), 2U * 16384U + 4096U);
}

TEST(ChildProcess, TellsEveryExitCodeAndSignal) {
  const PrivateFolder folder;
  for (const int code : {0, 1, 2, 127, 255})
    EXPECT_EQ(runShell(folder, "exit " + std::to_string(code)).exit_code, code);
  for (const int signal : {SIGTERM, SIGKILL, SIGSEGV})
    EXPECT_EQ(runShell(folder, "kill -" + std::to_string(signal) + " $$").exit_code, 128 + signal);
}

TEST(ChildProcess, HasNothingToReadAndNothingOpen) {
  const PrivateFolder folder;
  EXPECT_EQ(runShell(folder, "cat; echo done").output, "done\n");
  // Standard input, output and error, and what ls itself opens.
  EXPECT_EQ(runShell(folder, "ls /proc/self/fd | wc -l").output, "4\n");
}

TEST(ChildProcess, ManyRunSideBySide) {
  const PrivateFolder folder;
  std::vector<std::thread> threads;
  std::atomic<int> good = 0;
  for (int i = 0; i < 8; ++i) {
    threads.emplace_back([&folder, &good, i] {
      const std::string word = "child" + std::to_string(i);
      for (int k = 0; k < 5; ++k) good += runShell(folder, "echo " + word).output == word + "\n" ? 1 : 0;
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(good, 40);
}

TEST(PrivateFolder, NoTwoAreTheSame) {
  std::set<std::filesystem::path> paths;
  std::vector<std::unique_ptr<PrivateFolder>> folders;
  for (int i = 0; i < 50; ++i) paths.insert(folders.emplace_back(std::make_unique<PrivateFolder>())->path());
  EXPECT_EQ(paths.size(), 50U);
}

TEST(ChildProcess, EndsWhenWhatFeedsItThrows) {
  const PrivateFolder folder;
  const std::string error = errorOf([&] {
    runChild(findProgram("sh").value(), {"-c", "echo $$ > new; mv new other; cat"}, folder.path(), kPatience,
             [&](const ChildInput& give) {
               for (int tries = 0; tries < 500 && !std::filesystem::exists(folder.path() / "other"); ++tries)
                 std::this_thread::sleep_for(std::chrono::milliseconds(10));
               give("x");
               throw InputError("no more");
             });
  });
  EXPECT_EQ(error, "no more");
  EXPECT_TRUE(ends(folder.path() / "other"));
}

TEST(ChildProcess, SaysWhenAProgramCannotStart) {
  const PrivateFolder folder;
  EXPECT_NE(errorOf([&] {
              runChild("/no/such/program", {}, folder.path(), 1);
            }).find("/no/such/program: cannot be started: "),
            std::string::npos);
  EXPECT_FALSE(findProgram("no such program"));
}

AnsweringChild shell(const std::string& script) {
  return AnsweringChild(findProgram("sh").value(), {"-c", script}, "shell");
}

TEST(AnAnsweringChild, AnswersRequestAfterRequest) {
  AnsweringChild child = shell("while read line; do echo chatter; echo \"got $line\" >&3; done");
  EXPECT_EQ(child.ask("one\n", kPatience), "got one");
  EXPECT_EQ(child.ask("two\n", kPatience), "got two");
  const std::string much(300'000, 'x');  // more than a stream holds
  EXPECT_EQ(child.ask(much + "\n", kPatience), "got " + much);
}

TEST(AnAnsweringChild, SaysThatItHasEndedHangsOrSaysTooMuch) {
  const auto errorBy = [](const char* script, Seconds limit) {
    AnsweringChild child = shell(script);
    return errorOf([&] { child.ask("one\n", limit); });
  };
  EXPECT_EQ(errorBy("echo 'no memory'; exit 3", kPatience), "shell: failed: no memory\\x0A");
  EXPECT_EQ(errorBy("sleep 60", 0.2), "shell: hung");
  EXPECT_EQ(errorBy("read line; tr '\\0' x </dev/zero >&3", kPatience), "shell: says too much");
  EXPECT_EQ(errorBy("read line; yes | head -c 1000000 >&2; echo \"$line\" >&3", kPatience), "no error")
      << "what it says besides is read";
}

/// With what it has started itself.
TEST(AnAnsweringChild, EndsWithItsOwner) {
  std::string grandchild;
  {
    AnsweringChild child = shell("sleep 60 & echo $! >&3; wait");
    grandchild = child.ask("", kPatience);
    EXPECT_EQ(::kill(std::stoi(grandchild), 0), 0);
  }
  EXPECT_TRUE(hasEnded(grandchild));
}

}  // namespace
}  // namespace mouthpiece
