// What `synth serve` keeps from line to line.
#include "programs/synth/served_lines.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <thread>

#include "base/child_process.h"
#include "mouthpiece/mouthpiece.h"
#include "support/error_of.h"
#include "support/run_program.h"

namespace mouthpiece::test {
namespace {

namespace fs = std::filesystem;
const fs::path kServedShare = MOUTHPIECE_BUILD_SHARE_DIR;

/// A program in the network's place that hears no words, and adds a line to `starts` when it starts.
std::string networkThatTells(const fs::path& starts) {
  return "import { appendFileSync, readSync, writeSync } from 'node:fs'; appendFileSync('" + starts.string() +
         "', 'x\\n'); const read = (count) => { const bytes = Buffer.alloc(count); let at = 0;"
         "  while (at < count) at += readSync(0, bytes, at, count - at) || process.exit(0); return bytes; };"
         "for (;;) { const head = read(8); read(2 * head.readUInt32LE(0) + head.readUInt32LE(4));"
         "  writeSync(3, '[]\\n'); }";
}

std::size_t times(const std::string& state, const std::string& part) {
  std::size_t count = 0;
  for (std::size_t at = state.find(part); at != std::string::npos; at = state.find(part, at + 1)) ++count;
  return count;
}

TEST(ServedLines, AskOneNetworkProgramForAllRecordings) {
  if (!fs::exists(kServedShare / "default.face")) GTEST_SKIP() << "no sample corpus: run `make data`";
  if (!findProgram("node")) GTEST_SKIP() << "no Node";
  const ScratchFolder scratch;
  const fs::path share = scratch.path() / "share", starts = scratch.path() / "starts";
  fs::create_directories(share / "word_network");
  for (const fs::directory_entry& file : fs::directory_iterator(kServedShare)) {
    if (file.path().filename() != "word_network") fs::create_symlink(file, share / file.path().filename());
  }
  static_cast<void>(scratch.write("share/word_network/hear_words.mjs", networkThatTells(starts)));
  setenv("MOUTHPIECE_SHARE", share.c_str(), 1);
  SpeakerOptions options;
  options.corpus = kServedShare / "clock.corpus";
  options.face = kServedShare / "default.face";
  options.voice = "flite:slt";
  const fs::path sound = scratch.path() / "now.wav";
  save(Speaker(options).perform("now"), sound);
  {
    ServedLines lines(options, scratch.path() / "lines");
    const std::string recording = lines.keepRecording("now.wav", readAll(sound));
    LineWish wish;
    wish.recording = recording;
    for (int i = 0; i < 2; ++i) lines.add(wish);
    const auto until = std::chrono::steady_clock::now() + std::chrono::minutes(2);
    const auto ended = [&] {
      const std::string state = lines.state();
      return times(state, "\"done\"") + times(state, "\"failed\"");
    };
    while (ended() < 2 && std::chrono::steady_clock::now() < until)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    EXPECT_EQ(times(lines.state(), "\"done\""), 2U) << lines.state();
  }
  unsetenv("MOUTHPIECE_SHARE");
  EXPECT_EQ(readAll(starts), "x\n") << "a program for each line";
}

/// A folder of lines that an earlier session has left.
class EarlierLines : public testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists(kServedShare / "default.face")) GTEST_SKIP() << "no sample corpus: run `make data`";
  }
  EarlierLines() {
    options_.corpus = kServedShare / "clock.corpus";
    options_.face = kServedShare / "default.face";
    options_.voice = "flite:slt";
  }
  void keep(const std::string& name, int line, const std::string& more = "", const std::string& recording = "") const {
    static_cast<void>(scratch_.write("lines/" + name + "/line.json",
                                     R"({"text": "now", "voice": "", "face": "", "language": "", "warnings": [],)" +
                                         more + R"("version": 1, "duration_s": 1, "title": ")" + name +
                                         R"(", "recording": ")" + recording + R"(", "line": )" + std::to_string(line) +
                                         "}"));
  }
  [[nodiscard]] fs::path folder() const { return scratch_.path() / "lines"; }

  ScratchFolder scratch_;
  SpeakerOptions options_;
};

TEST_F(EarlierLines, AreAllShownAgain) {
  keep("001-one", 0);
  keep("001-two", 0);  // of two programs that once wrote here at a time
  keep("far", 9999);
  keep("003-three", 2);
  fs::create_directories(folder() / "loop");
  fs::create_symlink("line.json", folder() / "loop" / "line.json");
  static_cast<void>(scratch_.write("lines/heads", "no folder"));
  ServedLines lines(options_, folder());
  const std::string state = lines.state();
  EXPECT_EQ(times(state, "\"done\""), 4U) << state;
  LineWish wish;
  wish.text = "it is ten";
  EXPECT_LT(lines.add(wish), 10U);
}

TEST_F(EarlierLines, LeadToNoRecordingElsewhere) {
  keep("001-out", 0, "", "../../private.wav");
  const std::string state = ServedLines(options_, folder()).state();
  EXPECT_NE(state.find("\"private.wav\""), std::string::npos) << state;
  EXPECT_EQ(state.find(".."), std::string::npos) << state;
}

TEST_F(EarlierLines, AreOneProgramsAtATime) {
  {
    const ServedLines first(options_, folder());
    EXPECT_EQ(errorOf([&] { const ServedLines second(options_, folder()); }),
              folder().string() + ": is in use by another synth serve; expected one at a time");
  }
  EXPECT_NO_THROW(ServedLines(options_, folder()));
}

TEST_F(EarlierLines, GetNoEditsAndNoRecordingThatAreNone) {
  ServedLines lines(options_, folder());
  LineWish wish;
  wish.text = "now";
  wish.edits = "notjson";
  EXPECT_NE(errorOf([&] { lines.add(wish); }).find("edits"), std::string::npos);
  EXPECT_NE(errorOf([&] { lines.keepRecording("a.wav", ""); }).find("is empty"), std::string::npos);
  EXPECT_FALSE(fs::exists(folder() / "recordings" / "a.wav"));
}

TEST_F(EarlierLines, AreNotChangedIntoNothing) {
  keep("001-one", 0);
  ServedLines lines(options_, folder());
  EXPECT_NE(errorOf([&] { lines.change(0, {}); }).find("there is nothing to say"), std::string::npos);
  EXPECT_EQ(times(lines.state(), "\"done\""), 1U) << lines.state();
}

/// A head that is given again, but another one, is fitted again.
TEST_F(EarlierLines, AHeadOfTheSameNameIsFittedAnew) {
  fs::create_directories(folder() / "heads");
  for (const char* file : {"default.face", "default.obj"})
    fs::copy_file(kServedShare / file, folder() / "heads" / file, fs::copy_options::overwrite_existing);
  ServedLines lines(options_, folder());
  const std::string mesh = readAll(folder() / "heads" / "default.obj");
  lines.keepHead("default.obj", mesh);
  EXPECT_EQ(times(lines.state(), "\"is_head\": true"), 0U) << "the same";
  lines.keepHead("default.obj", mesh + "# edited\n");
  EXPECT_EQ(times(lines.state(), "\"is_head\": true"), 1U) << lines.state();
  EXPECT_TRUE(fs::exists(folder() / "heads" / "default.face.before"));
}

TEST_F(EarlierLines, TellNoticesBesideWarnings) {
  keep("line-0", 0, R"("notices": ["2 subtitles are not said"],)");
  keep("line-1", 1);  // of a build that told no notices
  const std::string state = ServedLines(options_, folder()).state();
  EXPECT_EQ(times(state, "\"done\""), 2U) << state;
  EXPECT_EQ(times(state, "2 subtitles are not said"), 1U) << state;
  EXPECT_EQ(times(state, "\"notices\""), 2U) << state;
}

}  // namespace
}  // namespace mouthpiece::test
