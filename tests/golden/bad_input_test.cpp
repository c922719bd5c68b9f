// What users get wrong, tried on the real programs: one clear line, exit code 1, nothing overwritten.
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <limits>

#include "support/run_program.h"

namespace {

namespace fs = std::filesystem;
using mouthpiece::test::ProgramResult;
using mouthpiece::test::readAll;
using mouthpiece::test::runProgram;
using mouthpiece::test::ScratchFolder;

const fs::path kShare = MOUTHPIECE_BUILD_SHARE_DIR;

/// One line on stderr that holds `expected`, exit code 1.
void expectOneClearLine(const ProgramResult& result, const std::string& expected) {
  EXPECT_EQ(result.exit_code, 1) << result.err;
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  EXPECT_NE(result.err.find(expected), std::string::npos) << result.err;
}

/// A synth run that must fail and must leave an earlier output as it was.
void expectSynthRefuses(std::vector<std::string> arguments, const std::string& expected) {
  const ScratchFolder scratch;
  const fs::path earlier = scratch.write("out/report.json", "earlier");
  arguments.insert(arguments.end(), {"--out", (scratch.path() / "out").string()});
  expectOneClearLine(runProgram("synth", arguments), expected);
  EXPECT_EQ(readAll(earlier), "earlier");
  const auto files = fs::directory_iterator(scratch.path() / "out");
  EXPECT_EQ(std::distance(begin(files), end(files)), 1) << "something besides the earlier report was left";
}

class SampleCorpus : public testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists(kShare / "sample.corpus")) GTEST_SKIP() << "no sample corpus in " << kShare << ": run `make data`";
  }
};

using BadText = SampleCorpus;
using BadCorpus = SampleCorpus;
using BadFace = SampleCorpus;
using BadOutput = SampleCorpus;

TEST_F(BadText, Empty) {
  expectSynthRefuses({"--text", ""}, "nothing to say");
  expectSynthRefuses({"--text", " \t\n ...!? "}, "nothing to say");
}

TEST_F(BadText, AnotherScript) {
  expectSynthRefuses({"--text", "который час"}, "к");
  expectSynthRefuses({"--text", "现在几点"}, "现");
}

TEST_F(BadText, OfAFileIsToldWithItsName) {
  const ScratchFolder scratch;
  const fs::path broken = scratch.write("line\x1B.txt", "the time \xFF\xFE"), empty = scratch.write("empty.txt", " \n");
  expectSynthRefuses({"--text-file", broken.string()}, "line\\x1B.txt:byte 9: is broken UTF-8");
  expectSynthRefuses({"--text-file", empty.string()}, "empty.txt: has nothing to say");
}

TEST_F(BadText, PhonePairThatTheCorpusLacksIsNamedWithoutBackoff) {
  // No take of the clock begins with M.
  for (const char* method : {"guided", "greedy", "edge"})
    expectSynthRefuses({"--text", "measure the garage", "--corpus", "clock", "--backoff", "none", "--method", method},
                       "lacks the phone pair sil M");
}

TEST_F(BadCorpus, IsNoDatabase) {
  const ScratchFolder scratch;
  const fs::path corpus = scratch.write("text.corpus", std::string(4096, 'x'));
  expectSynthRefuses({"--text", "the time is now", "--corpus", corpus.string()}, "text.corpus");
}

TEST_F(BadCorpus, IsMissing) {
  expectSynthRefuses({"--text", "the time is now", "--corpus", "/nowhere/x.corpus"}, "/nowhere/x.corpus");
}

TEST_F(BadCorpus, IsTruncated) {
  const ScratchFolder scratch;
  const std::string whole = readAll(kShare / "sample.corpus");
  for (const double share : {0.0, 0.1, 0.5, 0.9}) {
    const fs::path corpus = scratch.write(
        "cut.corpus", whole.substr(0, static_cast<std::size_t>(share * static_cast<double>(whole.size()))));
    expectSynthRefuses({"--text", "the time is now", "--corpus", corpus.string()}, "cut.corpus");
  }
}

TEST_F(BadFace, MeshHasChanged) {
  const ScratchFolder scratch;
  for (const auto& entry : fs::directory_iterator(kShare)) {
    if (entry.path().stem() == "default") fs::copy_file(entry.path(), scratch.path() / entry.path().filename());
  }
  for (const auto& entry : fs::directory_iterator(scratch.path())) {
    if (entry.path().extension() == ".face") continue;
    std::string mesh = readAll(entry.path());
    mesh[mesh.size() / 2] = mesh[mesh.size() / 2] == '1' ? '2' : '1';
    (void)scratch.write(entry.path().filename().string(), mesh);
  }
  expectSynthRefuses({"--text", "the time is now", "--face", (scratch.path() / "default.face").string()},
                     "has changed");
}

TEST_F(BadFace, Damaged) {
  const ScratchFolder scratch;
  const std::string whole = readAll(kShare / "default.face");
  ASSERT_FALSE(whole.empty());
  const fs::path cut = scratch.write("cut.face", whole.substr(0, whole.size() / 2));
  expectSynthRefuses({"--text", "the time is now", "--face", cut.string()}, "cut.face");
  const fs::path other = scratch.write("other.face", "{}");
  expectSynthRefuses({"--text", "the time is now", "--face", other.string()}, "other.face");
}

TEST_F(BadOutput, FolderCannotBeWritten) {
  const ScratchFolder scratch;
  const fs::path file = scratch.write("file", "x");
  expectOneClearLine(runProgram("synth", {"--text", "the time is now", "--out", (file / "out").string()}), "file");
  EXPECT_EQ(readAll(file), "x");
}

TEST_F(BadOutput, UnknownEnding) {
  const ScratchFolder scratch;
  expectOneClearLine(runProgram("synth", {"--text", "the time is now", "-o", (scratch.path() / "talk.avi").string()}),
                     "talk.avi");
}

TEST_F(BadOutput, FullDisk) {
  const ScratchFolder scratch;
  const fs::path script =
      scratch.write("full.sh",
                    "set -e\nmount -t tmpfs -o size=300k none \"$1\" || exit 77\nprintf earlier > \"$1/face.glb\"\n"
                    "code=0\n\"$2\" --text 'the time is now' --out \"$1\" || code=$?\n"
                    "test \"$(cat \"$1/face.glb\")\" = earlier || exit 99\n"
                    "test -z \"$(find \"$1\" -name '*.tmp')\" || exit 98\nexit $code\n");
  fs::create_directories(scratch.path() / "disk");
  const ProgramResult result = runProgram(
      "/usr/bin/unshare", {"--mount", "--map-root-user", "/bin/sh", script.string(), (scratch.path() / "disk").string(),
                           (fs::path(MOUTHPIECE_BIN_DIR) / "synth").string()});
  if (result.exit_code == 77 || result.err.find("unshare") != std::string::npos)
    GTEST_SKIP() << "no tmpfs can be mounted here: " << result.err;
  expectOneClearLine(result, "No space left");
}

TEST(BadUsage, ExitCodeIsTwo) {
  EXPECT_EQ(runProgram("synth", {}).exit_code, 2);
  EXPECT_EQ(runProgram("synth", {"--no-such-option"}).exit_code, 2);
  EXPECT_EQ(runProgram("synth", {"--text", "a", "--fps", "many"}).exit_code, 2);
  EXPECT_EQ(runProgram("corpus", {}).exit_code, 2);
  EXPECT_EQ(runProgram("retarget", {}).exit_code, 2);
}

TEST(BadUsage, FrameRateOutOfRange) {
  expectSynthRefuses({"--text", "the time is now", "--fps", "5"}, "24");
  expectSynthRefuses({"--text", "the time is now", "--fps", "1e9"}, "240");
  expectSynthRefuses({"--text", "the time is now", "--fps", "nan"}, "24");
}

TEST(Help, ShowsAnExample) {
  for (const char* program : {"synth", "corpus", "retarget"}) {
    const ProgramResult result = runProgram(program, {"--help"});
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_NE(result.out.find("Example"), std::string::npos) << program;
  }
}

}  // namespace
