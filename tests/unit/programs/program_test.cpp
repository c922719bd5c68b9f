// What all programs share: a command line becomes an exit code, whatever an action throws is one line.
#include "programs/program.h"

#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <new>
#include <nlohmann/json.hpp>
#include <system_error>

#include "base/errors.h"

namespace mouthpiece {
namespace {

struct Options {
  bool quiet = false, json = false;
  int count = 1;
  std::vector<std::string> words;
};

Options last_given;  ///< of the run before
std::function<int()> next_action = [] { return kExitDone; };

void addOptions(CLI::App& app, Options& options) {
  app.add_option("--count", options.count, "How many")->check(CLI::Range(1, 9));
  app.add_option("words", options.words, "What");
  addJsonFlag(app, options.json);
}

int runAction(const Options& given) {
  last_given = given;
  return next_action();
}

struct Outcome {
  int code = -1;
  std::string out, err;
};

/// `program` with the subcommands `say` and `sing`; itself runnable when `can_run_itself`.
template <bool can_run_itself>
int runItself(int argc, const char* const* argv) {
  Command program{"program", "Says things.", "program say hello", {}};
  if (can_run_itself) program = makeCommand<Options>("program", "Says things.", "program hello", addOptions, runAction);
  const std::vector<Command> commands{makeCommand<Options>("say", "Says it.", "program say a b", addOptions, runAction),
                                      makeCommand<Options>("sing", "Sings it.", "program sing", addOptions, runAction)};
  return runProgram(program, commands, argc, argv);
}

Outcome run(std::vector<const char*> arguments, bool can_run_itself = false) {
  arguments.insert(arguments.begin(), "/somewhere/program");
  ::testing::internal::CaptureStdout();
  ::testing::internal::CaptureStderr();
  Outcome outcome;
  outcome.code =
      caught(static_cast<int>(arguments.size()), arguments.data(), can_run_itself ? runItself<true> : runItself<false>);
  std::fflush(stdout);
  outcome.out = ::testing::internal::GetCapturedStdout();
  outcome.err = ::testing::internal::GetCapturedStderr();
  return outcome;
}

class RunProgram : public ::testing::Test {
 protected:
  void SetUp() override {
    last_given = {};
    next_action = [] { return kExitDone; };
  }
};

TEST_F(RunProgram, ReadsASubcommandsOptions) {
  EXPECT_EQ(run({"say", "--count", "3", "a", "b", "--quiet"}).code, kExitDone);
  EXPECT_EQ(last_given.count, 3);
  EXPECT_EQ(last_given.words, (std::vector<std::string>{"a", "b"}));
  EXPECT_TRUE(last_given.quiet);
  EXPECT_FALSE(last_given.json);
  EXPECT_EQ(run({"sing", "--json"}).code, kExitDone);
  EXPECT_EQ(last_given.count, 1) << "options do not leak from one run into another";
  EXPECT_TRUE(last_given.json);
}

TEST_F(RunProgram, TheActionsCodeIsTheProgramsCode) {
  for (const int code : {0, 1, 2, 7}) {
    next_action = [code] { return code; };
    EXPECT_EQ(run({"say"}).code, code);
  }
}

TEST_F(RunProgram, WrongUsageIsTwoAndRunsNothing) {
  bool has_run = false;
  next_action = [&] {
    has_run = true;
    return kExitDone;
  };
  const std::vector<std::vector<const char*>> wrong{
      {},         {"shout"}, {"say", "--count"}, {"say", "--count", "0"}, {"say", "--count", "x"}, {"say", "--loud"},
      {"--quiet"}};
  for (const auto& arguments : wrong) {
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.code, kExitWrongUsage) << ::testing::PrintToString(arguments);
    EXPECT_FALSE(outcome.err.empty());
    EXPECT_TRUE(outcome.out.empty()) << outcome.out;
  }
  EXPECT_FALSE(has_run);
}

TEST_F(RunProgram, AProgramMayRunItself) {
  EXPECT_EQ(run({"--count", "4", "hello"}, true).code, kExitDone);
  EXPECT_EQ(last_given.count, 4);
  EXPECT_EQ(run({"say", "--count", "5"}, true).code, kExitDone);
  EXPECT_EQ(last_given.count, 5);
}

TEST_F(RunProgram, HelpIsPrintedWithItsExample) {
  const Outcome whole = run({"--help"}), part = run({"say", "--help"});
  EXPECT_EQ(whole.code, kExitDone);
  EXPECT_NE(whole.out.find("Says things."), std::string::npos);
  EXPECT_NE(whole.out.find("Example:\n  program say hello"), std::string::npos) << whole.out;
  EXPECT_NE(whole.out.find("sing"), std::string::npos);
  EXPECT_NE(part.out.find("Example:\n  program say a b"), std::string::npos) << part.out;
  EXPECT_NE(part.out.find("--count"), std::string::npos);
}

TEST_F(RunProgram, WhateverIsThrownIsOneLine) {
  const std::vector<std::pair<std::function<int()>, std::string>> throws{
      {[]() -> int { throw InputError("a.lab", "41", "found x; expected y"); },
       "program: a.lab:41: found x; expected y\n"},
      {[]() -> int { throw InputError("two\nlines\x01"); }, "program: two\\x0Alines\\x01\n"},
      {[]() -> int { throw InternalError("broken"); }, "program: internal error, please report it: broken\n"},
      {[]() -> int { throw std::bad_alloc(); }, "program: out of memory: the input is too large for this machine\n"},
      {[]() -> int { throw std::system_error(EAGAIN, std::generic_category()); },
       "program: the system refuses: Resource temporarily unavailable\n"},
      {[]() -> int { throw std::runtime_error("odd"); }, "program: internal error, please report it: odd\n"},
      {[]() -> int {
         std::filesystem::create_directory("/proc/no/such");
         return 0;
       },
       "program: /proc/no/such: No such file or directory\n"},
  };
  for (const auto& [action, line] : throws) {
    next_action = action;
    const Outcome outcome = run({"say"});
    EXPECT_EQ(outcome.code, kExitBadInput);
    EXPECT_EQ(outcome.err, line);
    EXPECT_TRUE(outcome.out.empty());
  }
}

TEST_F(RunProgram, NoticesAreOneLineUnlessQuiet) {
  next_action = [] {
    printNotice("first\nsecond", false);
    printNotice("unheard", true);
    printText("as it is\n");
    return kExitDone;
  };
  const Outcome outcome = run({"say"});
  EXPECT_EQ(outcome.err, "program: first\\x0Asecond\n");
  EXPECT_EQ(outcome.out, "as it is\n");
}

TEST_F(RunProgram, JsonIsReadableWhateverNamesHold) {
  next_action = [] {
    printJson(nlohmann::json{{"name", "\xff\xfe<\"\n"}, {"numbers", {1, 2.5}}});
    return kExitDone;
  };
  const nlohmann::json read = nlohmann::json::parse(run({"say"}).out);
  EXPECT_EQ(read["numbers"], (nlohmann::json{1, 2.5}));
  EXPECT_EQ(read["name"], "\xEF\xBF\xBD\xEF\xBF\xBD<\"\n");
}

TEST_F(RunProgram, ProgressIsOnlyForTerminals) {
  next_action = [] {
    ProgressBar progress("work", 3, false);
    for (int i = 0; i < 3; ++i) progress.advance();
    progress.setDone(2);
    return kExitDone;
  };
  EXPECT_TRUE(run({"say"}).err.empty());
}

}  // namespace
}  // namespace mouthpiece
