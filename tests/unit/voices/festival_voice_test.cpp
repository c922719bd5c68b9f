#include <filesystem>

#include "base/child_process.h"
#include "base/files.h"
#include "support/voice_testing.h"
#include "voices/festival_script.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

constexpr const char* kBothVoices[] = {"festival:cmu_us_slt_arctic_hts", "festival:kal_diphone"};

TEST(FestivalVoice, SpeaksWithLabelsOnTheSoundsClock) {
  MOUTHPIECE_NEED_FESTIVAL();
  for (const char* name : kBothVoices) {
    const SpokenLine line = makeVoice(name)->speak("the time is now");
    expectGoodLine(line);
    EXPECT_EQ(line.voice, name);
    EXPECT_EQ(line.text, "the time is now");
    EXPECT_EQ(line.notice, "");
    EXPECT_EQ(namesOf(line.labels), "sil DH AH T AY M IH Z N AW sil");
    EXPECT_EQ(wordsOf(line.labels), "the time is now");
    ASSERT_EQ(line.labels.syllables.size(), 4U);
    EXPECT_EQ(line.labels.syllables[0].stress, 0);
    EXPECT_EQ(line.labels.syllables[1].stress, 1);
  }
}

TEST(FestivalVoice, SaysTheSameTwice) {
  MOUTHPIECE_NEED_FESTIVAL();
  const auto voice = makeVoice(kBothVoices[1]);
  const SpokenLine first = voice->speak("almost ten");
  EXPECT_EQ(first.audio.samples, voice->speak("almost ten").audio.samples);
}

TEST(FestivalVoice, JoinsSentencesInOneLine) {
  MOUTHPIECE_NEED_FESTIVAL();
  const SpokenLine line = makeVoice(kBothVoices[0])->speak("It is one. It is two! John's three?");
  expectGoodLine(line);
  EXPECT_EQ(wordsOf(line.labels), "It is one It is two John's three");
}

TEST(FestivalVoice, SaysLettersAndFollowsALexicon) {
  MOUTHPIECE_NEED_FESTIVAL();
  const auto plain = makeVoice(kBothVoices[0])->speak("place red at G nine again");
  EXPECT_EQ(namesOf(plain.labels), "sil P L EY S R EH D AE T JH IY N AY N AH G EH N sil");
  EXPECT_EQ(wordsOf(plain.labels), "place red at G nine again");
  const Lexicon lexicon = Lexicon::parse("Z Z EH D\nfour F AO\nagain AH G EY N\n", "l");
  const auto british = makeVoice(kBothVoices[0], {.lexicon = &lexicon})->speak("Z four again");
  EXPECT_EQ(namesOf(british.labels), "sil Z EH D F AO AH G EY N sil");
  EXPECT_EQ(wordsOf(british.labels), "Z four again");
  expectGoodLine(british);
}

/// What the language would say in another word.
TEST(FestivalVoice, SaysCriesAndCapitalsAsTheLexiconHasThem) {
  MOUTHPIECE_NEED_FESTIVAL();
  EXPECT_EQ(namesOf(makeVoice(kBothVoices[0])->speak("Hmm").labels), "sil HH AH M sil");
  const Lexicon lexicon = Lexicon::parse("hmm HH M\nCEO S IY AA\n", "l");
  const SpokenLine line = makeVoice(kBothVoices[0], {.lexicon = &lexicon})->speak("Hmm CEO");
  EXPECT_EQ(namesOf(line.labels), "sil HH M S IY AA sil");
  EXPECT_EQ(wordsOf(line.labels), "Hmm CEO");
}

/// Each tries to reach Scheme's reader, or a shell, in another way, to leave `trap` behind.
std::vector<std::string> injections(const fs::path& trap) {
  const std::string touch = "(system \"touch " + trap.string() + "\")";
  std::string escaped = "\\\") ";
  escaped.append("(system \\\"touch ").append(trap.string()).append("\\\") (\\\"");
  std::vector<std::string> texts{touch, escaped, "'(quit) #.(quit) ,(quit) #!eof"};
  texts.push_back(std::string("\") ").append(touch).append(" (\""));
  texts.push_back(std::string("one\n").append(touch).append("\n"));
  texts.push_back(std::string("one\n\n(set! x ").append(touch).append(")\n(quit)\n"));
  texts.push_back(std::string("$(touch ").append(trap.string()).append(") `touch ").append(trap.string()).append("`"));
  texts.push_back(std::string("<?xml version=\"1.0\"?><SABLE><!-- x -->").append(touch).append("</SABLE>"));
  texts.push_back(std::string("a\0b\x1B", 4).append(touch).append("\x04\x1A"));
  return texts;
}

TEST(FestivalVoice, TakesEveryTextForData) {
  MOUTHPIECE_NEED_FESTIVAL();
  const PrivateFolder folder;
  const fs::path trap = folder.path() / "trap";
  const auto voice = makeVoice(kBothVoices[1]);
  for (const std::string& text : injections(trap)) {
    expectGoodLine(voice->speak(text));
    EXPECT_FALSE(fs::exists(trap)) << text;
  }
}

/// The second wall: even without the normaliser, Festival's tokeniser takes the file for words.
TEST(FestivalVoice, TakesTheRawTextFileForDataToo) {
  MOUTHPIECE_NEED_FESTIVAL();
  for (std::size_t i = 0; i < injections("x").size(); ++i) {
    const PrivateFolder folder;
    const fs::path trap = folder.path() / "trap";
    const FestivalJob job = makeFestivalJob("kal_diphone", injections(trap)[i], nullptr);
    writeFileAtomically(folder.path() / "speak.scm", job.script);
    writeFileAtomically(folder.path() / kFestivalTextFile, job.text);
    const ChildResult result =
        runChild(findProgram("festival").value(), {"--heap", "1000000", "-b", "speak.scm"}, folder.path(), 60);
    EXPECT_EQ(result.exit_code, 0) << result.output;
    EXPECT_FALSE(fs::exists(trap)) << job.text;
    EXPECT_FALSE(parseFestivalLabels(readFile(folder.path() / kFestivalLabelsFile)).empty());
  }
}

TEST(FestivalVoice, SurvivesOddTexts) {
  MOUTHPIECE_NEED_FESTIVAL();
  const auto voice = makeVoice(kBothVoices[1]);
  for (const char* text : {"a",
                           "1",
                           "''s",
                           "- b -",
                           "$5",
                           "3.14159",
                           "1,000,000",
                           "12/25/2001",
                           "10:30 A.M.",
                           "U.S.A.",
                           "a'b'c",
                           "www.x.org",
                           "x@y.z",
                           "0x00",
                           "Dr. St. 5 St.",
                           "IV XII",
                           "99999999999999999999999999999999",
                           "!!! b",
                           "(((c",
                           "\"",
                           "hm hmm shh psst"}) {
    if (std::string_view(text) == "\"") {
      EXPECT_THROW(voice->speak(text), InputError);
    } else {
      EXPECT_NO_THROW(expectConsistent(voice->speak(text).labels)) << text;
    }
  }
}

TEST(FestivalVoice, SaysTenThousandCharacters) {
  MOUTHPIECE_NEED_FESTIVAL();
  std::string text;
  while (text.size() < 10000) text += "It is (exactly) \"ten\" past five, in the morning; or so \\ they say. ";
  text.resize(10000);
  const SpokenLine line = makeVoice(kBothVoices[1])->speak(text);
  expectGoodLine(line);
  EXPECT_GT(line.labels.words.size(), 1500U);
  EXPECT_GT(line.labels.duration(), 300);
}

TEST(FestivalVoice, LeavesNothingBehind) {
  MOUTHPIECE_NEED_FESTIVAL();
  const fs::path folder = fs::path(::testing::TempDir()) / "mouthpiece_tmpdir_test";
  fs::create_directories(folder);
  ::setenv("TMPDIR", folder.c_str(), 1);
  makeVoice(kBothVoices[1])->speak("one");
  ::unsetenv("TMPDIR");
  EXPECT_TRUE(fs::is_empty(folder));
  fs::remove_all(folder);
}

/// A stand-in for Festival on the PATH.
class BrokenFestivalTest : public ::testing::Test {
 protected:
  BrokenFestivalTest()
      : folder_(fs::path(::testing::TempDir()) / ("mouthpiece_broken_festival_" + std::to_string(::getpid()))),
        old_path_(std::getenv("PATH")) {}
  ~BrokenFestivalTest() override {
    ::setenv("PATH", old_path_.c_str(), 1);
    fs::remove_all(folder_);
  }
  /// What is said about it; the line itself is spoken all the same.
  std::string noticeWith(const std::string& script) {
    writeFileAtomically(folder_ / "festival", "#!/bin/sh\n" + script + "\n");
    fs::permissions(folder_ / "festival", fs::perms::owner_all);
    ::setenv("PATH", folder_.c_str(), 1);
    const auto voice = makeVoice(kBothVoices[0]);
    const SpokenLine line = voice->speak("one");
    EXPECT_EQ(line.labels.words.size(), 1U);
    EXPECT_GT(line.labels.duration(), 0.2);
    EXPECT_EQ(voice->speak("two").notice, line.notice) << "it is not asked again";
    return line.notice;
  }

 private:
  fs::path folder_;
  std::string old_path_;
};

TEST_F(BrokenFestivalTest, FliteSpeaksInItsPlaceAndSaysWhy) {
  EXPECT_EQ(noticeWith("echo 'SIOD ERROR: it is broken' >&2; exit 1"),
            "festival: failed: SIOD ERROR: it is broken; expected sound and labels: speaking with flite:slt");
  EXPECT_EQ(noticeWith("exit 7"), "festival: failed: exit code 7; expected sound and labels: speaking with flite:slt");
  EXPECT_EQ(noticeWith("echo 'SIOD ERROR: unbound variable : voice_cmu_us_slt_arctic_hts' >&2"),
            "festival: has no voice cmu_us_slt_arctic_hts. Get it with: sudo apt-get install festvox-us-slt-hts: "
            "speaking with flite:slt");
  EXPECT_EQ(noticeWith("echo utterance > labels.txt"),
            "festival:labels line 1: ended in the middle; expected its labels: speaking with flite:slt");
  EXPECT_NE(noticeWith("printf 'utterance\\nphone aa 1 0 0 0\\nend\\n' > labels.txt").find("no such file"),
            std::string::npos);
  EXPECT_NE(noticeWith("echo end > labels.txt").find("said nothing"), std::string::npos);
  EXPECT_NE(noticeWith("head -c 100000 /dev/urandom > labels.txt").find("festival:labels"), std::string::npos);
  EXPECT_NE(noticeWith("kill -SEGV $$").find("festival: failed: exit code 139"), std::string::npos);
}

TEST_F(BrokenFestivalTest, ATextWithNothingToSayIsStillRefused) {
  EXPECT_NE(errorOf([] { makeVoice(kBothVoices[0])->speak("..."); }).find("nothing to say"), std::string::npos);
}

}  // namespace
}  // namespace mouthpiece
