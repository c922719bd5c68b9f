// What a newcomer tries on `synth` and `corpus`, and what used to go wrong: each is told, or does what it says.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <regex>

#include "support/run_program.h"

namespace mouthpiece::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using Arguments = std::vector<std::string>;

constexpr const char* kLine = "the time is now";

class FirstSteps : public testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists(fs::path(MOUTHPIECE_BUILD_SHARE_DIR) / "sample.corpus"))
      GTEST_SKIP() << "no sample corpus; make it with `make data`";
  }
  static void TearDownTestSuite() { recording_.reset(); }
  /// A file, now.wav or now.TextGrid, of the line as a voice said it, which is asked when the first one is wanted.
  static std::string recorded(const std::string& name) {
    if (!recording_) {
      recording_ = std::make_unique<ScratchFolder>();
      const ProgramResult spoken =
          runProgram("synth", {"--text", kLine, "-o", recorded("now.wav"), "-o", recorded("now.TextGrid"), "-q"});
      EXPECT_EQ(spoken.exit_code, 0) << spoken.err;
    }
    return (recording_->path() / name).string();
  }

  [[nodiscard]] std::string path(const std::string& name) const { return (folder_.path() / name).string(); }
  [[nodiscard]] std::string file(const std::string& name, const std::string& bytes) const {
    return folder_.write(name, bytes).string();
  }

  /// synth with its report; `input` is the file that standard input comes from.
  ProgramResult synth(Arguments arguments, const std::string& input = "/dev/null") {
    arguments.insert(arguments.end(), {"-o", path("report.json")});
    std::string line = "exec '" MOUTHPIECE_BIN_DIR "/synth'";
    for (const std::string& argument : arguments) line += " '" + argument + "'";
    return runProgram("/bin/sh", {"-c", line + " <'" + input + "'"});
  }
  [[nodiscard]] json report() const { return json::parse(readAll(path("report.json"))); }
  /// The words with their times.
  [[nodiscard]] std::string labels() const { return readAll(path("phones.TextGrid")); }

  ScratchFolder folder_;

 private:
  static std::unique_ptr<ScratchFolder> recording_;
};
std::unique_ptr<ScratchFolder> FirstSteps::recording_;

bool holds(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

TEST(DidYouMean, NamesTheOptionOrCommandThatIsNearest) {
  const std::vector<std::pair<std::vector<std::string>, std::string>> typos{
      {{"synth", "--txet", "a"}, "did you mean --text?"},
      {{"synth", "--transcipt=a", "--audio", "a.wav"}, "did you mean --transcript?"},
      {{"synth", "batch", "lines.csv", "--formt", "wav"}, "did you mean --format?"},
      {{"corpus", "biuld", "takes"}, "did you mean build?"},
      {{"corpus", "build", "takes", "--strickt"}, "did you mean --strict?"},
      {{"retarget", "chekc"}, "did you mean check?"}};
  for (const auto& [words, expected] : typos) {
    const ProgramResult result = runProgram(words[0], {words.begin() + 1, words.end()});
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_TRUE(holds(result.err, expected)) << words[1] << ": " << result.err;
  }
  EXPECT_FALSE(holds(runProgram("synth", {"--nothing-like-it", "a"}).err, "did you mean"));
  EXPECT_FALSE(holds(runProgram("retarget", {"fit", "a.json"}).err, "did you mean"));  // --json is no file
  EXPECT_TRUE(
      holds(runProgram("synth", {"--voce", "flite:slt", "--text", "a"}).err, "nothing takes --voce flite:slt;"));
}

TEST(WrongUsage, NamesTheOptionThatTookAnotherForItsValue) {
  EXPECT_TRUE(holds(runProgram("retarget", {"fit", "head.glb", "anchors.json", "--mouth-parts", "--out", "f.face"}).err,
                    "; --mouth-parts took --out for its value"));
  EXPECT_TRUE(holds(runProgram("synth", {"--text", "--out", "folder"}).err, "; --text took --out for its value"));
}

TEST_F(FirstSteps, FilmRatesAreTaken) {
  for (const char* rate : {"23.976", "29.97", "24"}) {
    ASSERT_EQ(synth({"--text", kLine, "--fps", rate}).exit_code, 0) << rate;
    EXPECT_NEAR(report()["fps"], std::stod(rate), 1e-6);
    EXPECT_NEAR(report()["duration_s"], report()["frames"].get<double>() / std::stod(rate), 1e-5);
  }
  const ProgramResult slow = synth({"--text", kLine, "--fps", "12"});
  EXPECT_EQ(slow.exit_code, 1);
  EXPECT_TRUE(holds(slow.err, "expected 23.976 to 240")) << slow.err;
}

TEST_F(FirstSteps, WordsComeAsTextAsAFileAndFromStandardInput) {
  const std::string words = file("words.txt", std::string(kLine) + "\n");
  const std::string audio = recorded("now.wav"), grid = path("phones.TextGrid");
  const std::vector<std::pair<Arguments, const char*>> same{
      {{"--audio", audio, "--transcript", kLine}, "a transcript"},
      {{"--audio", audio, "--transcript-file", words}, "its file"},
      {{"--audio", audio, "--transcript", "-"}, "standard input"},
      {{"--audio", audio, "--transcript-file", "-"}, "standard input as a file"}};
  std::string first;
  for (const auto& [arguments, what] : same) {
    Arguments all = arguments;
    all.insert(all.end(), {"-o", grid});
    const ProgramResult result = synth(all, words);
    ASSERT_EQ(result.exit_code, 0) << what << result.err;
    EXPECT_TRUE(holds(labels(), "\"now\"")) << what;
    if (first.empty()) first = labels();
    EXPECT_EQ(labels(), first) << what;
  }
  for (const Arguments& typed :
       {Arguments{"--text", "-"}, Arguments{"--text-file", "-"}, Arguments{"--text-file", words}}) {
    ASSERT_EQ(synth(typed, words).exit_code, 0);
    EXPECT_EQ(report()["text"], kLine);
  }
}

TEST_F(FirstSteps, TextFilesOfWindowsAreReadAndSubtitlesAreNoText) {
  const std::string utf16("\xFF\xFEt\0h\0e\0 \0t\0i\0m\0e\0", 18);
  ProgramResult result = synth({"--text-file", file("notepad.txt", utf16), "-o", path("phones.TextGrid")});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_TRUE(holds(labels(), "\"time\"")) << labels();
  const std::string subtitles = file("a.srt", "1\n00:00:00,200 --> 00:00:01,000\nthe time is now\n");
  for (const Arguments& arguments : {Arguments{"--text-file", subtitles},
                                     Arguments{"--audio", recorded("now.wav"), "--transcript-file", subtitles}}) {
    result = synth(arguments);
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_TRUE(holds(result.err, "a.srt:2: holds subtitles; expected plain text (--times takes")) << result.err;
  }
  result = synth({"--audio", recorded("now.wav"), "--transcript-file", file("blank.txt", " \n")});
  EXPECT_TRUE(holds(result.err, "blank.txt: has nothing to say")) << result.err;
}

TEST_F(FirstSteps, LyricsComeAsAFileAsTextAndFromStandardInput) {
  const std::string words = file("words.txt", "[Chorus]\nthe time is now\n");
  const std::string audio = recorded("now.wav"), grid = path("phones.TextGrid");
  std::string first;
  for (const Arguments& sung : {Arguments{"--lyrics", words},
                                {"--lyrics", "-"},
                                {"--lyrics-text", "[Chorus] the time is now"},
                                {"--lyrics-text", "-"}}) {
    Arguments all{"--audio", audio, "-o", grid};
    all.insert(all.end(), sung.begin(), sung.end());
    const ProgramResult result = synth(all, words);
    ASSERT_EQ(result.exit_code, 0) << sung[0] << sung[1] << result.err;
    EXPECT_EQ(report()["style"], "sing");
    if (first.empty()) first = labels();
    EXPECT_EQ(labels(), first) << sung[0] << " " << sung[1];
    EXPECT_FALSE(holds(labels(), "horus")) << "a heading is not sung";
  }
  const ProgramResult empty = synth({"--audio", audio, "--lyrics", "-"}, file("empty.txt", "[Verse]\n"));
  EXPECT_EQ(empty.exit_code, 1);
  EXPECT_TRUE(holds(empty.err, "holds no words")) << empty.err;
}

TEST_F(FirstSteps, AWrongTranscriptIsDoubtedEverywhereAndStrictRefusesIt) {
  const Arguments wrong{"--audio", recorded("now.wav"), "--transcript", "seven purple elephants"};
  Arguments shown = wrong;
  shown.insert(shown.end(), {"-o", path("view.html")});
  const ProgramResult told = synth(shown);
  ASSERT_EQ(told.exit_code, 0) << told.err;
  const std::string doubt = "the words do not fit the sound";
  EXPECT_TRUE(holds(told.err, doubt)) << told.err;
  EXPECT_TRUE(holds(report()["warnings"].dump(), doubt));
  EXPECT_TRUE(holds(readAll(path("view.html")), doubt));
  EXPECT_TRUE(std::regex_search(told.err, std::regex(R"((seven|purple|elephants) \(\d+\.\d\d s\))"))) << told.err;
  fs::remove(path("report.json"));
  Arguments strict = wrong;
  strict.push_back("--strict");
  const ProgramResult refused = synth(strict);
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_TRUE(holds(refused.err, doubt) && holds(refused.err, "--strict")) << refused.err;
  EXPECT_FALSE(fs::exists(path("report.json")));
  EXPECT_EQ(synth({"--audio", recorded("now.wav"), "--transcript", kLine, "--strict"}).exit_code, 0);
}

TEST_F(FirstSteps, WhatSubtitlesDoNotSayIsNoDoubtOfTheLine) {
  const std::string subtitles =
      file("a.srt", "1\n00:00:00,100 --> 00:00:01,300\n[door slams] " + std::string(kLine) + "\n");
  const ProgramResult told =
      synth({"--audio", recorded("now.wav"), "--times", subtitles, "--strict", "-o", path("view.html")});
  ASSERT_EQ(told.exit_code, 0) << told.err;
  const std::string notice = "1 left out as not said, by SRT: [door slams]";
  EXPECT_TRUE(holds(told.err, "note: " + notice)) << told.err;
  EXPECT_EQ(report()["notices"], nlohmann::json::array({notice}));
  EXPECT_TRUE(report()["warnings"].empty()) << report()["warnings"];
  EXPECT_TRUE(holds(readAll(path("view.html")), notice));
}

TEST_F(FirstSteps, SubtitlesOfALineWithoutWordsAreToldToBeEmpty) {
  const std::string subtitles = path("speech.srt");
  const Arguments by_phones{"--audio", recorded("now.wav"), "--hear", "phones", "-o", subtitles};
  const ProgramResult alone = synth(by_phones);
  EXPECT_EQ(alone.exit_code, 1);
  EXPECT_TRUE(holds(alone.err, "speech.srt: would be empty: the line has phones and no words; expected words"))
      << alone.err;
  EXPECT_EQ(std::count(alone.err.begin(), alone.err.end(), '\n'), 1) << alone.err;
  EXPECT_FALSE(fs::exists(subtitles));

  Arguments with_motion = by_phones;
  with_motion.insert(with_motion.end(), {"-o", path("motion.csv")});
  const ProgramResult beside = synth(with_motion);
  EXPECT_EQ(beside.exit_code, 0) << beside.err;
  EXPECT_TRUE(holds(beside.err, "note: " + subtitles + " is empty: the line has phones and no words")) << beside.err;

  const ProgramResult batch =
      runProgram("synth", {"batch", file("lines.csv", "id,audio\na," + recorded("now.wav") + "\n"), "--hear", "phones",
                           "--format", "vtt,wav", "--out", path("vo")});
  EXPECT_EQ(batch.exit_code, 0) << batch.err;
  EXPECT_TRUE(holds(readAll(path("vo/manifest.json")), "a.vtt is empty: the line has phones and no words"))
      << batch.err;
}

TEST_F(FirstSteps, ARecordingInWhichNobodySpeaksIsRefusedWithItsTranscript) {
  std::string sound = readAll(recorded("now.wav"));
  std::fill(sound.begin() + 44, sound.end(), '\0');
  const ProgramResult refused = synth({"--audio", file("quiet.wav", sound), "--transcript", kLine});
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_TRUE(holds(refused.err, "quiet.wav: holds silence only; expected speech")) << refused.err;
  EXPECT_EQ(std::count(refused.err.begin(), refused.err.end(), '\n'), 1) << refused.err;
  EXPECT_FALSE(fs::exists(path("report.json")));
}

TEST_F(FirstSteps, LabelsOfAnotherRecordingAreDoubted) {
  const std::string audio = recorded("now.wav");
  const ProgramResult own = synth({"--audio", audio, "--phones", recorded("now.TextGrid"), "--strict"});
  EXPECT_EQ(own.exit_code, 0) << own.err;
  const std::string other = path("other.TextGrid");
  ASSERT_EQ(synth({"--text", "measure every garage before you buy a house", "-o", other}).exit_code, 0);
  const ProgramResult foreign = synth({"--audio", audio, "--phones", other});
  EXPECT_EQ(foreign.exit_code, 0) << foreign.err;
  EXPECT_TRUE(holds(foreign.err, "the labels ") || holds(foreign.err, "the words do not fit the sound")) << foreign.err;
  EXPECT_FALSE(report()["warnings"].empty());
  const ProgramResult refused = synth({"--audio", audio, "--phones", other, "--strict"});
  EXPECT_EQ(refused.exit_code, 1) << refused.err;
}

/// The largest distance of a marker between two motions, as `-o x.csv` writes them.
double largestStep(const std::string& a, const std::string& b) {
  const auto numbers = [](const std::string& text) {
    std::vector<double> values;
    for (const char* at = text.c_str() + text.find('\n'); *at != '\0';) {
      char* end = nullptr;
      const double value = std::strtod(at, &end);
      if (end != at) values.push_back(value);
      at = end == at ? at + 1 : end;
    }
    return values;
  };
  const std::vector<double> one = numbers(a), two = numbers(b);
  EXPECT_EQ(one.size(), two.size());
  double most = 0;
  for (std::size_t i = 0; i < std::min(one.size(), two.size()); ++i) most = std::max(most, std::abs(one[i] - two[i]));
  return most;
}

TEST_F(FirstSteps, EditsThatCannotApplyAreNamedAndTooLargeOnesAreHeld) {
  ASSERT_EQ(synth({"--text", kLine, "-o", path("plain.csv")}).exit_code, 0);
  const std::string edits = file("edits.json", R"([
    {"curve": "Blah", "kind": "mute", "start_s": 0.2, "end_s": 0.4},
    {"curve": "Ah", "kind": "offset", "start_s": 90, "end_s": 91, "value": 0.2},
    {"curve": "Ah", "kind": "offset", "start_s": 0.3, "end_s": 0.6, "value": 5}])");
  const ProgramResult result =
      synth({"--text", kLine, "--edits", edits, "-o", path("edited.csv"), "-o", path("curves.csv")});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_TRUE(holds(result.err, "Blah")) << result.err;
  EXPECT_TRUE(holds(result.err, "90.00 s")) << result.err;
  const double moved = largestStep(readAll(path("plain.csv")), readAll(path("edited.csv")));
  EXPECT_GT(moved, 1) << "the edit moves the mouth";
  EXPECT_LT(moved, 60) << "it does not tear it";
  const ProgramResult bad = synth({"--text", kLine, "--edits", file("bad.json", R"([{"kind": "dial", "dial": "strenght",
    "start_s": 0, "end_s": 1, "value": 1}])")});
  EXPECT_EQ(bad.exit_code, 1);
  EXPECT_TRUE(holds(bad.err, "strenght") && holds(bad.err, "strength")) << bad.err;
}

TEST_F(FirstSteps, CurvesCanBeHandedBack) {
  ASSERT_EQ(synth({"--text", kLine, "--method", "curves", "-o", path("curves.json"), "-o", path("one.csv")}).exit_code,
            0);
  const ProgramResult again =
      synth({"--text", kLine, "--method", "curves", "--edits", path("curves.json"), "-o", path("two.csv")});
  ASSERT_EQ(again.exit_code, 0) << again.err;
  EXPECT_LT(largestStep(readAll(path("one.csv")), readAll(path("two.csv"))), 0.01);
}

TEST_F(FirstSteps, DialsThatDoNothingSaySo) {
  const ProgramResult idle = synth({"--text", kLine, "--ja", "2", "--ma", "0.4"});
  ASSERT_EQ(idle.exit_code, 0) << idle.err;
  EXPECT_TRUE(holds(idle.err, "Ma, Ja shape VOCAL's curves")) << idle.err;
  EXPECT_FALSE(holds(synth({"--text", kLine, "--ja", "2", "--method", "curves"}).err, "VOCAL's curves"));
  EXPECT_FALSE(holds(synth({"--text", kLine, "--jaw", "1.5"}).err, "VOCAL's curves"));
}

TEST_F(FirstSteps, ArkitsNameWritesArkit) {
  for (const char* name : {"arkit.csv", "talk.arkit.csv"}) {
    ASSERT_EQ(synth({"--text", kLine, "-o", path(name)}).exit_code, 0);
    EXPECT_TRUE(readAll(path(name)).starts_with("Timecode,BlendShapeCount,EyeBlinkLeft")) << name;
  }
  ASSERT_EQ(synth({"--text", kLine, "-o", path("motion.csv")}).exit_code, 0);
  EXPECT_TRUE(readAll(path("motion.csv")).starts_with("time_s,"));
}

TEST_F(FirstSteps, GuessedWordsAreToldAndCanBeMended) {
  const ProgramResult first = synth({"--text", "the zworbelak is here", "-o", path("lexicon.txt")});
  ASSERT_EQ(first.exit_code, 0) << first.err;
  EXPECT_TRUE(holds(first.err, "no dictionary has zworbelak (0.")) << first.err;
  EXPECT_FALSE(holds(first.err, "no dictionary has here")) << first.err;
  EXPECT_TRUE(report()["warnings"].empty()) << "a guess is no doubt";
  ASSERT_EQ(report()["guesses"].size(), 1U);
  EXPECT_EQ(report()["guesses"][0]["word"], "zworbelak");
  EXPECT_GT(report()["guesses"][0]["phones"].size(), 5U);
  ASSERT_FALSE(report()["notices"].empty());
  EXPECT_TRUE(holds(report()["notices"].back(), "zworbelak")) << "what page and manifest show";
  std::string stub = readAll(path("lexicon.txt"));
  std::smatch entry;
  ASSERT_TRUE(std::regex_search(stub, entry, std::regex(R"(\n# 0\.\d\d to \d\.\d\d s\nzworbelak ([A-Z ]+)\n)")))
      << stub;
  const std::string mended =
      file("mended.txt", std::regex_replace(stub, std::regex("zworbelak .*"), "zworbelak M AA M"));
  const ProgramResult again =
      synth({"--text", "the zworbelak is here", "--lexicon", mended, "-o", path("phones.TextGrid")});
  ASSERT_EQ(again.exit_code, 0) << again.err;
  EXPECT_FALSE(holds(again.err, "no dictionary")) << again.err;
  std::string phones;
  const json told = report();
  for (const json& phone : told["phones"]) phones += phone["phone"].get<std::string>() + " ";
  EXPECT_TRUE(holds(phones, "M AA M ")) << phones;
}

TEST_F(FirstSteps, OneCharacterThatNobodySaysRefusesNoText) {
  const ProgramResult run = synth({"--text", "the angle \u03B8 is small", "-o", path("phones.TextGrid")});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_TRUE(holds(run.err, "left out, since no voice of English says them: \u03B8")) << run.err;
  EXPECT_EQ(report()["text"], "the angle is small");
  EXPECT_TRUE(holds(synth({"--text", "\u03B8", "-o", path("phones.TextGrid")}).err, "U+03B8"));
}

/// Once the program was silent for minutes, and then refused.
TEST_F(FirstSteps, FiveMinutesOfRecordingAreDone) {
  const std::string once = readAll(recorded("now.wav"));
  constexpr std::size_t kHeader = 44, kRateAt = 24, kFileSizeAt = 4, kSizeAt = 40;
  ASSERT_EQ(once.substr(kSizeAt - 4, 4), "data");
  std::uint32_t rate = 0;
  std::memcpy(&rate, once.data() + kRateAt, 4);
  constexpr std::size_t kSilenceS = 300, kBytesASample = 2;
  std::string sound = once + std::string(kSilenceS * kBytesASample * rate, '\0') + once.substr(kHeader);
  const auto size = static_cast<std::uint32_t>(sound.size() - kHeader),
             whole = static_cast<std::uint32_t>(sound.size() - 8);
  std::memcpy(sound.data() + kSizeAt, &size, 4);
  std::memcpy(sound.data() + kFileSizeAt, &whole, 4);
  const ProgramResult made = synth({"--audio", file("five.wav", sound), "--transcript",
                                    std::string(kLine) + " " + kLine, "--fps", "24", "-o", path("motion.csv")});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const json told = report();
  EXPECT_GT(told["duration_s"], 300);
  double first = -1, second = -1;
  for (const json& phone : told["phones"]) {
    if (phone["word"] != "now") continue;
    (phone["start_s"] < 150 ? first : second) = phone["start_s"].get<double>();
  }
  EXPECT_GT(first, 0) << told["phones"];
  EXPECT_NEAR(second - first, 300 + 0.5 * static_cast<double>(once.size() - kHeader) / rate, 0.03);
  EXPECT_TRUE(told["warnings"].empty()) << told["warnings"];
}

/// What subtitles hold and nobody says is told, and is no doubt.
TEST_F(FirstSteps, ABatchTellsWhatIsNotSaid) {
  fs::copy_file(recorded("now.wav"), path("now.wav"));
  (void)file("now.srt", "1\n00:00:00,000 --> 00:00:01,200\n(laughs) the time is now\n");
  const ProgramResult made = runProgram("synth", {"batch", file("lines.csv", "id,audio,times\na,now.wav,now.srt\n"),
                                                  "--out", path("made"), "--format", "wav"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const json line = json::parse(readAll(path("made/manifest.json")))["lines"].at(0);
  EXPECT_TRUE(line["warnings"].empty()) << line;
  EXPECT_TRUE(holds(line["notices"].dump(), "(laughs)")) << line;
  EXPECT_TRUE(holds(readAll(path("made/manifest.csv")), "(laughs)"));
  EXPECT_TRUE(holds(readAll(path("made/manifest.html")), "(laughs)"));
}

TEST_F(FirstSteps, SongsOfOtherProgramsAreSung) {
  // 120 quarters a minute, 480 ticks each: half a second a note, "hap-py day".
  const auto event = [](int kind, const std::string& data) {
    return std::string({'\0', '\xFF', static_cast<char>(kind), static_cast<char>(data.size())}) + data;
  };
  const auto note = [](char pitch) {
    return std::string({'\0', '\x90', pitch, '\x40', '\x83', '\x60', '\x80', pitch, '\0'});
  };
  std::string track = event(3, "PART VOCALS") + event(0x51, std::string("\x07\xA1\x20", 3)) + event(5, "hap-") +
                      note(60) + event(5, "py") + note(62) + event(5, "day") + note(64) + event(0x2F, "");
  const std::string midi =
      std::string("MThd\0\0\0\x06\0\0\0\x01\x01\xE0MTrk\0\0\0", 21) + static_cast<char>(track.size()) + track;
  const std::string ust =
      "[#VERSION]\nUST Version1.2\n[#SETTING]\nTempo=120.00\n[#0000]\nLength=480\nLyric=hap\nNoteNum=60\n"
      "[#0001]\nLength=480\nLyric=+py\nNoteNum=62\n[#0002]\nLength=480\nLyric=day\nNoteNum=64\n[#TRACKEND]\n";
  for (const auto& [name, bytes] : {std::pair("song.mid", midi), {"song.ust", ust}}) {
    const ProgramResult sung = synth({"--song", file(name, bytes), "-o", path("phones.TextGrid")});
    ASSERT_EQ(sung.exit_code, 0) << name << sung.err;
    EXPECT_EQ(report()["style"], "sing") << name;
    EXPECT_TRUE(holds(labels(), "\"happy\"") && holds(labels(), "\"day\"")) << name << labels();
    EXPECT_NEAR(report()["duration_s"], 1.5, 1) << name;
  }
  const ProgramResult kana = synth({"--song",
                                    file("kana.ust",
                                         "[#SETTING]\nTempo=120.00\n[#0000]\nLength=480\nLyric=- ぴ\nNoteNum=60\n"
                                         "[#0001]\nLength=480\nLyric=i か\nNoteNum=62\n"),
                                    "-o", path("phones.TextGrid")});
  ASSERT_EQ(kana.exit_code, 0) << kana.err;
  EXPECT_TRUE(holds(labels(), "\"ぴ\"") && holds(labels(), "\"pʲ\"")) << labels();
  EXPECT_FALSE(holds(kana.err, "no dictionary has")) << "kana tell how they are said: " << kana.err;
}

/// The JSON of a GLB.
json glbJson(const std::string& bytes) {
  std::uint32_t size = 0;
  std::memcpy(&size, bytes.data() + 12, 4);
  return json::parse(bytes.substr(20, size));
}

TEST_F(FirstSteps, ShapesHaveTheSameNamesInEveryLine) {
  for (const auto& [ending, shape, count] : {std::tuple("arkit.glb", "jawOpen", 52U), {"visemes.glb", "PP", 14U}}) {
    std::vector<json> names;
    for (const char* text : {kLine, "a hot pot"}) {
      const std::string file = path(std::string("talk.") + ending);
      ASSERT_EQ(synth({"--text", text, "-o", file}).exit_code, 0) << ending;
      const std::string bytes = readAll(file);
      const json scene = glbJson(bytes);
      names.push_back(scene["meshes"][0]["extras"]["targetNames"]);
      // The weights are all of the file's animated floats: a row a frame.
      const json& output = scene["accessors"][scene["animations"][0]["samplers"][0]["output"].get<std::size_t>()];
      const json& view = scene["bufferViews"][output["bufferView"].get<std::size_t>()];
      std::uint32_t json_size = 0;
      std::memcpy(&json_size, bytes.data() + 12, 4);
      std::vector<float> weights(output["count"].get<std::size_t>());
      std::memcpy(weights.data(), bytes.data() + 28 + json_size + view["byteOffset"].get<std::size_t>(),
                  4 * weights.size());
      EXPECT_EQ(weights.size(), count * report()["frames"].get<std::size_t>());
      const auto [least, most] = std::minmax_element(weights.begin(), weights.end());
      EXPECT_GE(*least, 0);
      EXPECT_LE(*most, 1);
      EXPECT_GT(*most, 0.2F) << ending << ": something moves";
    }
    EXPECT_EQ(names[0].size(), count) << ending;
    EXPECT_EQ(names[0], names[1]);
    EXPECT_TRUE(holds(names[0].dump(), std::string("\"") + shape + "\"")) << names[0];
  }
}

TEST_F(FirstSteps, AFilmComesOutAsLongAsTheLine) {
  if (runProgram("/bin/sh", {"-c", "command -v ffmpeg"}).exit_code != 0) GTEST_SKIP() << "no ffmpeg on the PATH";
  const ProgramResult made = synth({"--text", "pot", "-o", path("talk.mp4"), "-o", path("talk.png.zip")});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const std::string film = readAll(path("talk.mp4"));
  EXPECT_EQ(film.substr(4, 4), "ftyp");
  const std::string pictures = readAll(path("talk.png.zip"));
  std::size_t count = 0;
  for (std::size_t at = pictures.find(".png"); at != std::string::npos; at = pictures.find(".png", at + 4)) ++count;
  EXPECT_EQ(count, 2 * ((report()["frames"].get<std::size_t>() + 1) / 2)) << "each name twice, every second frame";
}

TEST_F(FirstSteps, TakesWithoutMotionAreNamed) {
  const std::string takes = path("takes");
  fs::create_directories(takes);
  for (const char* name : {"one.wav", "two.wav"}) fs::copy_file(recorded("now.wav"), fs::path(takes) / name);
  (void)file("takes/one.txt", kLine);
  const ProgramResult built = runProgram("corpus", {"build", takes, "--out", path("mine.corpus")});
  EXPECT_EQ(built.exit_code, 1);
  EXPECT_TRUE(holds(built.err, "one") && holds(built.err, "no motion (expected one.c3d, .trc or .csv)")) << built.err;
}

/// eSpeak's library would look for a sound server, which keeps a folder at the user's home and one for what passes.
TEST_F(FirstSteps, AVoiceLeavesNothingAtHome) {
  const ProgramResult said =
      runProgram("/bin/sh",
                 {"-c", R"(mkdir home tmp && HOME=$PWD/home TMPDIR=$PWD/tmp ")" MOUTHPIECE_BIN_DIR
                        R"(/synth" --language de --text "Hallo" -o hallo.wav -q && find home tmp)"},
                 folder_.path());
  EXPECT_EQ(said.exit_code, 0);
  EXPECT_EQ(said.err, "");
  EXPECT_EQ(said.out, "home\ntmp\n");
}

TEST(FirstStart, LoadsNoLibraryThatOnlyAVoiceOrAnEarNeeds) {
  // What the dynamic linker says that it would load. Sound servers took half of a start; OpenBLAS, which LAPACK may be,
  // has a thread for each core that is busy at first.
  for (const char* program : {"synth", "corpus", "retarget"}) {
    const ProgramResult listed = runProgram(
        "/bin/sh", {"-c", std::string("LD_TRACE_LOADED_OBJECTS=1 exec '" MOUTHPIECE_BIN_DIR "/") + program + "'"});
    ASSERT_NE(listed.out.find("libc.so"), std::string::npos) << listed.err;
    for (const char* library :
         {"libflite", "libespeak", "libpulse", "libX11", "libasound", "libpocketsphinx", "liblapack"})
      EXPECT_EQ(listed.out.find(library), std::string::npos) << program << " loads " << library;
  }
}

}  // namespace
}  // namespace mouthpiece::test
