// Defaults that a user has written down.
#include <gtest/gtest.h>

#include "support/run_program.h"

namespace mouthpiece::test {
namespace {

class Config : public testing::Test {
 protected:
  ProgramResult with(const std::string& config, const std::vector<std::string>& arguments) {
    const std::string file = folder_.write("config", config).string();
    std::vector<std::string> all{"MOUTHPIECE_CONFIG=" + file, MOUTHPIECE_BIN_DIR "/synth"};
    all.insert(all.end(), arguments.begin(), arguments.end());
    return runProgram("/usr/bin/env", all);
  }
  std::string list(const std::string& text) { return folder_.write("lines.csv", text).string(); }
  ScratchFolder folder_;
};

TEST_F(Config, GivesWhatTheCommandLineDoesNot) {
  // "batch --check" makes nothing, so a wrong voice is seen by its option alone.
  const std::string lines = list("id,text\na,hello\n");
  EXPECT_EQ(with("[synth]\nshard = 9/2\n", {"batch", lines}).exit_code, 1) << "the default is taken";
  EXPECT_EQ(with("[synth]\nshard = 9/2\n", {"batch", lines, "--shard", "1/1", "--check"}).exit_code, 0);
  EXPECT_EQ(with("[synth]\nshard = 9/2\n", {"batch", lines, "--shard=1/1", "--check"}).exit_code, 0);
  EXPECT_EQ(with("[synth]\nshard = 9/2\n[synth batch]\nshard = 1/2\n", {"batch", lines, "--check"}).exit_code, 0)
      << "the command's own section goes before the program's";
  EXPECT_EQ(with("[corpus]\nshard = 9/2\n# nothing\n\n[retarget]\nx = y\n", {"batch", lines, "--check"}).exit_code, 0);
}

TEST_F(Config, RefusesWhatItDoesNotKnow) {
  const ProgramResult key = with("[synth]\nvoise = flite:slt\n", {"--version"});
  EXPECT_EQ(key.exit_code, 1);
  EXPECT_NE(key.err.find("config:2: found 'voise'"), std::string::npos) << key.err;
  const ProgramResult line = with("voice\n", {"--version"});
  EXPECT_EQ(line.exit_code, 1);
  EXPECT_NE(line.err.find("config:1: "), std::string::npos) << line.err;
}

TEST(Version, TellsCommitAndFormats) {
  for (const char* program : {"synth", "corpus", "retarget"}) {
    const ProgramResult result = runProgram(program, {"--version"});
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_NE(result.out.find("corpus format 7"), std::string::npos) << result.out;
    EXPECT_NE(result.out.find("commit "), std::string::npos) << result.out;
  }
}

}  // namespace
}  // namespace mouthpiece::test
