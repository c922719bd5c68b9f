// What a program writes takes no file of the user's away that it was not told to replace, and is refused before the
// work, not after it.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "support/run_program.h"

namespace mouthpiece::test {
namespace {

namespace fs = std::filesystem;
using Arguments = std::vector<std::string>;

class Outputs : public testing::Test {
 protected:
  [[nodiscard]] std::string path(const std::string& name) const { return (folder_.path() / name).string(); }

  /// The command refuses with one line that holds `expected`, and `file` is what it was.
  void expectKept(const std::string& file, const std::string& program, const Arguments& arguments,
                  const std::string& expected) const {
    const std::string before = readAll(path(file));
    const ProgramResult result = runProgram(program, arguments, folder_.path());
    EXPECT_EQ(result.exit_code, 1) << testing::PrintToString(arguments) << result.out;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_NE(result.err.find(expected), std::string::npos) << result.err;
    EXPECT_EQ(readAll(path(file)), before) << testing::PrintToString(arguments);
  }

  ScratchFolder folder_;
};

TEST_F(Outputs, AreNoInputsOfTheSameCommand) {
  static_cast<void>(folder_.write("t.csv", "time_s,A.x,A.y,A.z\n0,1,2,3\n0.01,1,2,3\n"));
  static_cast<void>(folder_.write("b.txt", "the time is now\n"));
  static_cast<void>(folder_.write("head.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"));
  static_cast<void>(folder_.write("head.anchors.json", "{}"));
  expectKept("t.csv", "corpus", {"clean", "t.csv", "t.csv"}, "out: is what in names, too");
  expectKept("t.csv", "corpus", {"convert", "t.csv", path("t.csv")}, "out: is what in names, too");
  expectKept("b.txt", "corpus", {"prompts", "--text", "b.txt", "--curve", "./b.txt"}, "is what --text names, too");
  expectKept("b.txt", "corpus", {"prompts", "--text", "b.txt", "--running", "b.txt", "--pairs", "c", "--curve", "c"},
             "names, too");
  expectKept("head.obj", "retarget", {"fit", "head.obj", "--out", "head.obj"}, "names, too");
  expectKept("head.obj", "retarget", {"cut", "head.obj", "--out", "head.obj"}, "is what MESH names, too");
  expectKept(
      "head.anchors.json", "retarget",
      {"fit", "head.obj", "--anchors", "head.anchors.json", "--out", "a.face", "--save-anchors", "head.anchors.json"},
      "is what --anchors names, too");
  expectKept("t.csv", "corpus", {"sample", "takes", "--truth", "takes"}, "is what folder names, too");
  EXPECT_FALSE(fs::exists(path("takes")));
  static_cast<void>(folder_.write("b.wav", "no sound"));
  expectKept("b.wav", "corpus", {"convert", "t.csv", "b.c3d", "--sound", "b.wav", "--sound-late", "0"},
             "would be written over what is read");
}

TEST_F(Outputs, MayBeCalledAsWhatIsNoFile) {
  static_cast<void>(folder_.write("head.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"));
  const ProgramResult result =
      runProgram("retarget", {"fit", "head.obj", "--name", "head", "--out", "head"}, folder_.path());
  EXPECT_EQ(result.exit_code, 1) << "a triangle is no head";
  EXPECT_EQ(result.err.find("names, too"), std::string::npos) << result.err;
}

TEST_F(Outputs, ReplaceNothingOfAnotherKind) {
  static_cast<void>(folder_.write("my.txt", "my sentences\n"));
  static_cast<void>(folder_.write("other.db", std::string("SQLite format 3\0", 16) + std::string(200, 'x')));
  static_cast<void>(folder_.write("head.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"));
  static_cast<void>(folder_.write("keep.csv", "a,b\n"));
  fs::create_directories(path("mine"));
  expectKept("my.txt", "corpus", {"build", "mine", "--out", "my.txt"}, "is there and no corpus");
  expectKept("other.db", "corpus", {"build", "mine", "--out", "other.db"}, "is there and no corpus");
  expectKept("my.txt", "corpus", {"adapt", "large.corpus", "--to", "own.corpus", "-o", "my.txt"},
             "is there and no corpus");
  expectKept("keep.csv", "retarget", {"fit", "head.obj", "--out", "keep.csv"}, "is there and no face");
  expectKept("keep.csv", "corpus", {"report", "mine.corpus", "--out", "keep.csv"}, "ends in .html");
  expectKept("keep.csv", "corpus", {"align", "a.wav", "--transcript", "a", "--out", "keep.csv"}, "another ending");
  // An empty file holds nothing that could be lost.
  static_cast<void>(folder_.write("empty.corpus", ""));
  expectKept("empty.corpus", "corpus", {"build", "mine", "--out", "empty.corpus"}, "mine");
}

TEST_F(Outputs, OfAnchorsThatAreNotNamedReplaceNone) {
  static_cast<void>(folder_.write("head.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"));
  static_cast<void>(folder_.write("head.anchors.json", "clicked"));
  expectKept("head.anchors.json", "retarget", {"anchors", "head.obj"}, "-o names the file");
}

TEST_F(Outputs, ThatAreFoldersAreRefusedBeforeTheWork) {
  static_cast<void>(folder_.write("takes/a.txt", "the time is now\n"));
  fs::create_directories(path("folder"));
  expectKept("takes/a.txt", "corpus", {"build", "takes", "--out", "folder"}, "is a folder; expected a file name");
  EXPECT_FALSE(fs::exists(path("folder.parts")));
  static_cast<void>(folder_.write("head.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"));
  expectKept("head.obj", "retarget", {"fit", "head.obj", "--out", "folder"}, "is a folder; expected a file name");
}

TEST_F(Outputs, ThatWouldNotBeWrittenAreTold) {
  static_cast<void>(folder_.write("b.txt", "the time is now\n"));
  static_cast<void>(folder_.write("p.csv", "first,second,count\n"));
  for (const char* option : {"--running", "--curve", "--lexicon"})
    expectKept("b.txt", "corpus", {"prompts", "--count", "2", option, "c.csv"}, "needs --text or --grammar");
  EXPECT_EQ(runProgram("corpus", {"prompts", "--text", path("b.txt"), "--pairs", path("c.csv")}).exit_code, 2);
  expectKept("b.txt", "corpus", {"prompts", "--text", "b.txt", "--running", "p.csv", "--pairs", "c.csv"},
             "is such a table already");
  fs::create_directories(path("takes"));
  expectKept("b.txt", "corpus", {"build", "takes", "--out", "a.corpus", "--map", "LIP=FOO"}, "has no marker FOO");
  const ProgramResult negative = runProgram("corpus", {"sample", path("takes"), "--seed", "-3"});
  EXPECT_EQ(negative.exit_code, 2);
  EXPECT_NE(negative.err.find("--seed: found '-3'; expected a whole number from 0"), std::string::npos) << negative.err;
  const ProgramResult name = runProgram("corpus", {"sample", path("takes"), "--prompts", "poor"});
  EXPECT_NE(name.err.find("--prompts: found 'poor'; expected clock|rich"), std::string::npos) << name.err;
}

TEST_F(Outputs, OfALineAreFilesOrAFolder) {
  static_cast<void>(folder_.write("lines.csv", "id,text\na,now\n"));
  expectKept("lines.csv", "synth", {"--text", "now", "--out", "hello.mp4"}, "names a file; expected a folder");
  EXPECT_FALSE(fs::exists(path("hello.mp4")));
  expectKept("lines.csv", "synth", {"batch", "lines.csv", "-o", "{name}/{id}.wav"},
             "found '{name}'; expected {id}, {language} or {speaker}");
  expectKept("lines.csv", "synth", {"--text-file", folder_.path().string()}, "is a folder; expected a text file");
}

/// An output folder's usual names may be those of what is read.
TEST_F(Outputs, OfALinesFolderAreNothingThatItReads) {
  static_cast<void>(folder_.write("talk/speech.wav", "my sound"));
  static_cast<void>(folder_.write("out/speech.wav", "my sound"));
  static_cast<void>(folder_.write("out/phones.TextGrid", "my labels"));
  static_cast<void>(folder_.write("out/curves.json", "my curves"));
  expectKept("talk/speech.wav", "synth", {"--audio", "talk/speech.wav", "--transcript", "now", "--out", "talk"},
             "talk/speech.wav:--out: is what --audio names, too; expected another");
  expectKept("out/phones.TextGrid", "synth", {"--audio", "a.wav", "--phones", "out/phones.TextGrid"},
             "out/phones.TextGrid:--out: is what --phones names, too");
  expectKept("out/curves.json", "synth", {"--text", "now", "--edits", "out/curves.json", "--out", "./out"},
             "curves.json:--out: is what --edits names, too");
  expectKept("out/speech.wav", "synth", {"--audio", "out/speech.wav", "-o", "out/speech.wav"},
             "-o: is what --audio names, too");
}

TEST_F(Outputs, OfTrackingReplaceNoTakesOfOthers) {
  if (!fs::exists(fs::path(MOUTHPIECE_BUILD_SHARE_DIR) / "face_tracker"))
    GTEST_SKIP() << "no face_tracker in the build's share folder; build viewer_page";
  static_cast<void>(folder_.write("clips/c.mpg", "no film"));
  static_cast<void>(folder_.write("clips/c.wav", "my recording"));
  static_cast<void>(folder_.write("mocap/c.c3d", "my capture"));
  expectKept("clips/c.wav", "corpus", {"track", "clips/c.mpg", "--out", "clips"},
             "clips/c.wav: is there and was not made by tracking; expected another folder to write to");
  expectKept("mocap/c.c3d", "corpus", {"track", "clips/c.mpg", "--out", "mocap", "--again"},
             "mocap/c.c3d: is there and was not made by tracking");
  EXPECT_FALSE(fs::exists(path("clips/person.json")) || fs::exists(path("mocap/person.json")));
}

TEST_F(Outputs, OfAnEmptyOrForeignMotionAreTold) {
  static_cast<void>(folder_.write("none.c3d", ""));
  static_cast<void>(folder_.write("live.csv", "Timecode,BlendShapeCount,EyeBlinkLeft\n0,1,0\n"));
  expectKept("none.c3d", "corpus", {"convert", "none.c3d", "a.csv"}, "is empty");
  expectKept("live.csv", "corpus", {"convert", "live.csv", "a.c3d"},
             "a Live Link Face take needs a head with ARKit's shapes");
}

}  // namespace
}  // namespace mouthpiece::test
