// Words of other programs, put into the sound that they were heard in.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>

#include "base/errors.h"
#include "base/files.h"
#include "hearing/times/times_file.h"
#include "support/error_of.h"
#include "voices/voice.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

const fs::path kFixtures = fs::path(MOUTHPIECE_SOURCE_DIR) / "tests/data/times";

/// The words of `line` as a CTM has them; `gap` seconds are missing at the end of each, `word` says how it is written.
template <typename Written>
fs::path ctmOf(const SpokenLine& line, const std::string& name, Seconds gap, const Written& written) {
  std::string ctm;
  for (const LabelledWord& word : line.labels.words) {
    const TimeSpan span = line.labels.spanOf(word.phones);
    ctm += fmt::format("a 1 {:.6f} {:.6f} {}\n", span.start, span.duration() - gap, written(word.text));
  }
  const fs::path file = fs::path(testing::TempDir()) / name;
  writeFileAtomically(file, ctm);
  return file;
}

std::string inCapitals(std::string word) {
  std::transform(word.begin(), word.end(), word.begin(), [](unsigned char c) { return std::toupper(c); });
  return word;
}

/// A word keeps the times it was given; the phones that the file lacks come from the sound.
TEST(TimedRecogniser, AlignsPhonesInsideTheirWords) {
  const SpokenLine line = makeVoice("flite:slt")->speak("the birch canoe slid on the smooth planks");
  const fs::path file = fs::path(testing::TempDir()) / "mouthpiece_words.ctm";
  std::string ctm;
  for (const LabelledWord& word : line.labels.words) {
    const TimeSpan span = line.labels.spanOf(word.phones);
    ctm += "a 1 " + std::to_string(span.start) + " " + std::to_string(span.duration()) + " " + word.text + "\n";
  }
  writeFileAtomically(file, ctm);
  const HeardSpeech heard = makeTimedRecogniser(file)->hear(line.audio, "line");
  ASSERT_EQ(heard.labels.words.size(), line.labels.words.size());
  EXPECT_EQ(heard.confidence.size(), heard.labels.phones.size());
  double off = 0, count = 0;
  for (std::size_t w = 0; w < line.labels.words.size(); ++w) {
    const TimeSpan given = line.labels.spanOf(line.labels.words[w].phones);
    const TimeSpan found = heard.labels.spanOf(heard.labels.words[w].phones);
    // 20 ms of a line's first and last phone may go to its silences.
    EXPECT_NEAR(given.start, found.start, 0.021) << line.labels.words[w].text;
    EXPECT_NEAR(given.end, found.end, 0.021) << line.labels.words[w].text;
    const PhoneRange said = line.labels.words[w].phones, range = heard.labels.words[w].phones;
    if (said.last.value - said.first.value != range.last.value - range.first.value) continue;
    for (std::size_t i = 0; i < said.last.value - said.first.value; ++i) {
      off += std::abs(line.labels.phones[said.first.value + i].span.end -
                      heard.labels.phones[range.first.value + i].span.end);
      count += 1;
    }
  }
  ASSERT_GT(count, 8);
  EXPECT_LT(off / count, 0.020);
}

/// "spn" is the Montreal Forced Aligner's mark for a word that its dictionary lacks.
TEST(TimedRecogniser, AlignsTheWordsWhosePhonesTheFileLacks) {
  const SpokenLine line = makeVoice("flite:slt")->speak("bring my yellow pumpkin home");
  std::string words, phones;
  const auto entry = [](const TimeSpan& span, std::string_view text) {
    return fmt::format("[{}, {}, \"{}\"]", span.start, span.end, text);
  };
  for (const LabelledWord& word : line.labels.words) {
    const TimeSpan span = line.labels.spanOf(word.phones);
    words += (words.empty() ? "" : ", ") + entry(span, word.text);
    if (word.text == "yellow") phones += ", " + entry(span, "spn");
    for (std::size_t i = word.phones.first.value; word.text != "yellow" && i <= word.phones.last.value; ++i)
      phones +=
          (phones.empty() ? "" : ", ") + entry(line.labels.phones[i].span, phoneName(line.labels.phones[i].phone));
  }
  const fs::path file = fs::path(testing::TempDir()) / "mouthpiece_unknown_word.json";
  writeFileAtomically(
      file,
      fmt::format(R"({{"tiers": {{"words": {{"entries": [{}]}}, "phones": {{"entries": [{}]}}}}}})", words, phones));
  const HeardSpeech heard = makeTimedRecogniser(file)->hear(line.audio, "line");
  EXPECT_EQ(heard.text, "bring my yellow pumpkin home");
  ASSERT_EQ(heard.labels.phones.size(), line.labels.phones.size());
  for (std::size_t i = 0; i < heard.labels.phones.size(); ++i) {
    EXPECT_EQ(heard.labels.phones[i].phone, line.labels.phones[i].phone);
    EXPECT_EQ(heard.labels.phones[i].word, line.labels.phones[i].word);
    const bool is_aligned =
        heard.labels.phones[i].word && line.labels.words[*heard.labels.phones[i].word].text == "yellow";
    EXPECT_NEAR(heard.labels.phones[i].span.start, line.labels.phones[i].span.start, is_aligned ? 0.04 : 0.001) << i;
  }
  EXPECT_TRUE(heard.warnings.empty());
}

TEST(TimedRecogniser, RefusesTimesOfALongerSound) {
  const AudioClip sound{16000, std::vector<float>(8000, 0.0F)};
  EXPECT_NE(
      errorOf([&] { makeTimedRecogniser(kFixtures / "vosk.json")->hear(sound, "a.wav"); }).find("a.wav lasts 0.50 s"),
      std::string::npos);
}

TEST(TimedRecogniser, TellsThatNobodySpeaksWhereItsWordsAre) {
  AudioClip sound = makeVoice("flite:slt")->speak("the time is now").audio;
  const std::size_t spoken = sound.samples.size();
  sound.samples.resize(3 * spoken, 0.0F);
  const fs::path file = fs::path(testing::TempDir()) / "mouthpiece_beside.ctm";
  const auto warnings = [&](Seconds start) {
    writeFileAtomically(file, "a 1 " + std::to_string(start) + " 0.4 time\n");
    return makeTimedRecogniser(file)->hear(sound, "line").warnings;
  };
  EXPECT_TRUE(warnings(0.2).empty());
  const std::vector<std::string> told = warnings(2 * static_cast<double>(spoken) / sound.sample_rate_hz);
  ASSERT_EQ(told.size(), 2U);
  EXPECT_NE(told[0].find("evenly spread"), std::string::npos) << told[0];
  EXPECT_TRUE(told[1].starts_with("hardly any speech is heard where ")) << told[1];
}

TEST(TimedRecogniser, CountsWhatIsNotSaid) {
  const AudioClip sound = makeVoice("flite:slt")->speak("the time is now").audio;
  const fs::path file = fs::path(testing::TempDir()) / "mouthpiece_sounds.srt";
  writeFileAtomically(file, "1\n00:00:00,000 --> 00:00:01,500\nJOHN: (sighs) [a] [b] [c] [d] the time is now\n");
  const HeardSpeech heard = makeTimedRecogniser(file)->hear(sound, "line");
  EXPECT_EQ(heard.text, "the time is now");
  EXPECT_EQ(heard.warnings, std::vector<std::string>{});
  EXPECT_EQ(heard.notices, std::vector<std::string>{"6 left out as not said, by SRT: JOHN: (sighs) [a] [b] [c] ..."});
}

TEST(TimedRecogniser, TellsOfSubtitlesThatOverlap) {
  const AudioClip sound = makeVoice("flite:slt")->speak("the time is now").audio;
  const fs::path file = fs::path(testing::TempDir()) / "mouthpiece_overlap.srt";
  writeFileAtomically(file, "1\n00:00:00,000 --> 00:00:00,700\nthe time\n\n2\n00:00:00,600 --> 00:00:01,500\nis now\n");
  const HeardSpeech heard = makeTimedRecogniser(file)->hear(sound, "line");
  EXPECT_EQ(heard.text, "the time is now");
  EXPECT_EQ(heard.notices,
            std::vector<std::string>{"1 line of SRT cut where the next line begins, which it overlapped"});
  EXPECT_NE(errorOf([] {
              parseTimes("1\n00:00:00,000 --> 00:00:00,700\na\n\n2\n00:00:00,100 --> 00:00:01,500\nb\n", "x");
            }).find("before the one before it ends"),
            std::string::npos)
      << "most of a line cannot be cut";
}

TEST(TimedRecogniser, TellsThatAWordIsCutAtTheEndOfTheSound) {
  const AudioClip sound = makeVoice("flite:slt")->speak("the time is now").audio;
  const fs::path file = fs::path(testing::TempDir()) / "mouthpiece_long.ctm";
  const auto warnings = [&](const std::string& last) {
    writeFileAtomically(file, "a 1 0.2 0.3 time\na 1 0.6 " + last + " now\n");
    return makeTimedRecogniser(file)->hear(sound, "line").warnings;
  };
  EXPECT_TRUE(warnings("0.4").empty());
  const std::vector<std::string> told = warnings("48.4");
  ASSERT_EQ(told.size(), 1U);
  EXPECT_TRUE(told[0].starts_with("'now' ends at 49.00 s by ")) << told[0];
}

/// Programs write words in capitals, each alone: no word beside it tells that they are not spelled.
TEST(TimedRecogniser, ReadsAFileInCapitalsAsWords) {
  const SpokenLine line = makeVoice("flite:slt")->speak("Bob and I met him, and the FBI was here");
  const fs::path file = ctmOf(line, "mouthpiece_loud.ctm", 0, inCapitals);
  EXPECT_EQ(makeTimedRecogniser(file)->hear(line.audio, "line").text, "BOB AND I MET HIM AND THE F B I WAS HERE");
  writeFileAtomically(file, "a 1 0.2 0.3 the\na 1 0.6 0.5 USA\n");
  EXPECT_EQ(makeTimedRecogniser(file)->hear(line.audio, "line").labels.words.size(), 4U) << "the U S A";
}

/// A gap of a rounding's length is no pause; a pause stays.
TEST(TimedRecogniser, ClosesGapsThatAreNoPauses) {
  const SpokenLine line = makeVoice("flite:slt")->speak("many men are in my room now, and more are here");
  const auto silencesAt = [&](Seconds gap) {
    const HeardSpeech heard = makeTimedRecogniser(ctmOf(line, "mouthpiece_gaps.ctm", gap, [](const std::string& word) {
                                return word;
                              }))->hear(line.audio, "line");
    EXPECT_EQ(heard.labels.words.size(), line.labels.words.size());
    return std::ranges::count(heard.labels.phones, Phone::kSil, &LabelledPhone::phone);
  };
  const auto said = std::ranges::count(line.labels.phones, Phone::kSil, &LabelledPhone::phone);
  ASSERT_EQ(said, 3);
  for (const Seconds gap : {0.0, 0.0005, 0.02, 0.05}) EXPECT_EQ(silencesAt(gap), said) << gap;
}

TEST(TimedRecogniser, LeavesOutWordsBehindTheSoundsEnd) {
  const SpokenLine line = makeVoice("flite:slt")->speak("the time is now");
  const fs::path file = ctmOf(line, "mouthpiece_behind.ctm", 0, [](const std::string& word) { return word; });
  const std::string own = readFile(file);
  writeFileAtomically(file, own + "a 1 9.1 0.2 Thanks\na 1 9.3 0.2 for\na 1 9.5 0.2 watching!\n");
  const HeardSpeech heard = makeTimedRecogniser(file)->hear(line.audio, "line");
  EXPECT_EQ(heard.text, "the time is now");
  ASSERT_EQ(heard.warnings.size(), 1U);
  EXPECT_TRUE(heard.warnings[0].starts_with("'Thanks for watching!' begins at 9.10 s by ")) << heard.warnings[0];
  writeFileAtomically(file, own + "a 1 9.1 0.2 a\na 1 9.3 0.2 b\na 1 9.5 0.2 c\na 1 9.7 0.2 d\n");
  EXPECT_NE(errorOf([&] { makeTimedRecogniser(file)->hear(line.audio, "line"); }).find("expected times of this sound"),
            std::string::npos);
}

TEST(TimedRecogniser, TellsOfAnotherLanguage) {
  const AudioClip sound = makeVoice("flite:slt")->speak("the time is now").audio;
  const fs::path file = fs::path(testing::TempDir()) / "mouthpiece_language.json";
  const auto warnings = [&](const std::string& language, const Language& own) {
    writeFileAtomically(file, R"({"language": ")" + language +
                                  R"(", "segments": [{"words": [{"word": "time", "start": 0.2, "end": 0.6}]}]})");
    return makeTimedRecogniser(file, nullptr, own)->hear(sound, "line").warnings;
  };
  for (const char* const own : {"en", "English", "en-US"}) EXPECT_TRUE(warnings(own, english()).empty()) << own;
  EXPECT_EQ(warnings("de", english()), std::vector<std::string>{"Whisper JSON tells that its language is de, and is "
                                                                "read as English: say which it is"});
  EXPECT_TRUE(warnings("german", languageOf("de")).empty());
}

}  // namespace
}  // namespace mouthpiece
