// The aligner and the pronouncer by a language that was made up on one page (tests/support/made_up_language.h), and
// laws that hold for every alignment.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>
#include <random>
#include <span>
#include <sstream>
#include <string>

#include "base/errors.h"
#include "base/files.h"
#include "base/text_encoding.h"
#include "hearing/alignment/forced_alignment.h"
#include "hearing/alignment/pronouncer.h"
#include "support/made_up_language.h"
#include "voices/voice.h"

namespace mouthpiece {
namespace {

constexpr Seconds kNear = 0.080;  // English vowels stand for others here

std::string textOf(const std::vector<TranscriptWord>& words) {
  std::string text;
  for (const TranscriptWord& word : words) text += (text.empty() ? "" : " ") + word.text;
  return text;
}

class MadeUp : public testing::Test {
 protected:
  const Language& language_ = madeUpLanguage();
  const Lexicon lexicon_ = Lexicon::parse(kMadeUpLexicon, "tokish", PhoneSet::kIpa, madeUpLanguage());
  const Pronouncer pronouncer_{&lexicon_, madeUpLanguage()};
};

TEST_F(MadeUp, ItsTextIsReadByItsRules) {
  EXPECT_EQ(textOf(pronouncer_.wordsOf("Mö, tok-pa (3)!")), "Mö tok pa tok");
  EXPECT_THROW(pronouncer_.wordsOf("tok nowhere"), InputError) << "it has no rules for words it does not know";
  EXPECT_THROW(pronouncer_.wordsOf("\u041F"), InputError);
  EXPECT_TRUE(dictionaryWords(language_).empty());
}

TEST_F(MadeUp, ItsWordsAreFoundInASound) {
  const SpokenLine line = makeVoice("flite:slt")->speak("toke moo mats");
  ForcedAligner aligner({}, language_);
  const ForcedAlignment found = aligner.align(line.audio, pronouncer_.wordsOf("tok mö mats"), "line");
  ASSERT_EQ(found.labels.words.size(), 3U);
  EXPECT_EQ(found.labels.words[1].text, "mö");
  for (std::size_t w = 0; w < 3; ++w) {
    const TimeSpan said = line.labels.spanOf(line.labels.words[w].phones);
    const TimeSpan heard = found.labels.spanOf(found.labels.words[w].phones);
    EXPECT_NEAR(heard.start, said.start, kNear) << found.labels.words[w].text;
    EXPECT_NEAR(heard.end, said.end, kNear) << found.labels.words[w].text;
  }
  // One phone of this language is two of the acoustic model.
  const PhoneRange mats = found.labels.words[2].phones;
  EXPECT_EQ(mats.last.value - mats.first.value, 2U);
  EXPECT_EQ(found.labels.phones[mats.last.value].phone, Phone::kCH);
  const PhoneRange said = line.labels.words[2].phones;
  EXPECT_NEAR(found.labels.phones[mats.last.value].span.start, line.labels.phones[said.last.value - 1].span.start,
              kNear);
}

TEST_F(MadeUp, APhoneThatItLacksIsNamed) {
  const SpokenLine line = makeVoice("flite:slt")->speak("toke");
  ForcedAligner aligner({}, language_);
  const std::vector<TranscriptWord> words = {{"the", {{{Phone::kDH, Phone::kAA}, {-1, -1}}}}};
  try {
    aligner.align(line.audio, words, "line");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("has the phone DH; expected phones of Tokish"), std::string::npos);
  }
}

/// Lines and, the last four, languages that the doubt was not learnt from.
TEST(LanguageDoubt, BelievesWhatIsSaidAndNotAnothersText) {
  const std::array<std::array<std::string, 3>, 7> all{
      {{"it", "Mio padre beve il vino rosso ogni sera.", "La barca blu passa sotto il ponte vecchio."},
       {"es", "Mi primo vive en un pueblo muy pequeño.", "El tren sale temprano todas las mañanas."},
       {"fr", "Mon père boit un verre de vin le soir.", "La belle maison bleue est au bord du lac."},
       {"da", "Min bror bor i en lille by ved havet.", "Toget kører tidligt hver eneste morgen."},
       {"nb", "Min bror bor i en liten by ved havet.", "Toget går tidlig hver eneste morgen."},
       {"ro", "Fratele meu lucrează la o fabrică mare.", "Trenul pleacă devreme în fiecare dimineață."},
       {"hu", "A vonat minden reggel korán indul.", "A bátyám egy kis városban lakik."}}};
  std::size_t right = 0, other = 0, cut = 0;
  for (const auto& [tag, said, instead] : all) {
    const Language& language = languageOf(tag);
    const Pronouncer pronouncer(nullptr, language);
    ForcedAligner aligner({}, language);
    const AudioClip sound = makeVoice("espeak:" + tag)->speak(said).audio;
    right += doubtsAbout(aligner.align(sound, pronouncer.wordsOf(said), "line")).empty() ? 0U : 1U;
    other += doubtsAbout(aligner.align(sound, pronouncer.wordsOf(instead), "line")).empty() ? 0U : 1U;
    const std::string begun = said.substr(0, said.find(' ', said.size() / 2));
    cut += doubtsAbout(aligner.align(sound, pronouncer.wordsOf(begun), "line")).empty() ? 0U : 1U;
  }
  EXPECT_EQ(right, 0U) << "of 7";
  EXPECT_GE(other, 6U) << "of 7";
  EXPECT_GE(cut, 3U) << "of 7 that lack their last words";
}

/// Phones that are said, without the pauses between them.
std::vector<LabelledPhone> saidIn(const SpeechLabels& labels) {
  std::vector<LabelledPhone> said = labels.phones;
  std::erase_if(said, [](const LabelledPhone& phone) { return phone.phone == Phone::kSil; });
  return said;
}

/// eSpeak NG tells when it says each phone. The median of two lines a language was 8 to 16 ms when this was written.
TEST(LanguageTimes, AreThoseOfTheVoiceThatSpeaks) {
  constexpr Seconds kMost = 0.020;
  constexpr std::size_t kLinesEach = 2;
  std::istringstream table(readFile(MOUTHPIECE_SOURCE_DIR "/tests/data/language_lines.tsv"));
  std::map<std::string, std::vector<std::string>> lines;
  for (std::string line; std::getline(table, line);) {
    const std::size_t tab = line.find('\t');
    if (line.starts_with('#') || tab == std::string::npos) continue;
    lines[line.substr(0, tab)].push_back(line.substr(tab + 1));
  }
  EXPECT_EQ(lines.size(), 11U);
  for (const auto& [tag, texts] : lines) {
    const Language& language = languageOf(tag);
    const Pronouncer pronouncer(nullptr, language);
    ForcedAligner aligner({}, language);
    std::vector<Seconds> off;
    for (const std::string& text : std::span(texts).first(kLinesEach)) {
      const SpokenLine line = makeVoice("espeak:" + lowerCase(tag))->speak(text);
      const std::vector<LabelledPhone> said = saidIn(line.labels),
                                       heard = saidIn(aligner.labelsOf(line.audio, pronouncer.wordsOf(text), tag));
      if (said.size() != heard.size()) continue;  // English has a dictionary of its own
      for (std::size_t i = 1; i < said.size(); ++i) {
        if (said[i].span.start == said[i - 1].span.end)
          off.push_back(std::abs(heard[i].span.start - said[i].span.start));
      }
    }
    ASSERT_GT(off.size(), 15U) << tag;
    std::sort(off.begin(), off.end());
    EXPECT_LT(off[off.size() / 2], kMost) << tag;
  }
}

TEST(Alignment, LouderSofterAndLongerSoundsGiveTheSameTimes) {
  const SpokenLine line = makeVoice("flite:rms")->speak("four hours of steady work");
  const Pronouncer pronouncer;
  ForcedAligner aligner;
  const std::vector<TranscriptWord> words = pronouncer.wordsOf(line.text);
  const ForcedAlignment plain = aligner.align(line.audio, words, "line");
  AudioClip soft = line.audio, late = line.audio;
  for (float& sample : soft.samples) sample *= 0.5F;
  constexpr Seconds kLater = 0.5;
  late.samples.insert(late.samples.begin(), static_cast<std::size_t>(kLater * late.sample_rate_hz), 0.0F);
  const ForcedAlignment softer = aligner.align(soft, words, "soft"), later = aligner.align(late, words, "late");
  ASSERT_EQ(softer.labels.words.size(), plain.labels.words.size());
  ASSERT_EQ(later.labels.words.size(), plain.labels.words.size());
  for (std::size_t w = 0; w < plain.labels.words.size(); ++w) {
    const TimeSpan span = plain.labels.spanOf(plain.labels.words[w].phones);
    EXPECT_NEAR(softer.labels.spanOf(softer.labels.words[w].phones).end, span.end, 0.020) << w;
    EXPECT_NEAR(later.labels.spanOf(later.labels.words[w].phones).end, span.end + kLater, 0.030) << w;
  }
}

TEST(Alignment, AnyWordsGiveLabelsThatKeepTheirPromises) {
  const SpokenLine line = makeVoice("flite:slt")->speak("this is some sound or other that lasts a while");
  const Pronouncer pronouncer;
  ForcedAligner aligner;
  const std::vector<TranscriptWord> words =
      pronouncer.wordsOf("time river cat a string of beads under water seven eight");
  std::mt19937 random(20261122);
  for (int round = 0; round < 6; ++round) {
    std::vector<TranscriptWord> said;
    std::sample(words.begin(), words.end(), std::back_inserter(said), 1 + round, random);
    const ForcedAlignment alignment = aligner.align(line.audio, said, "line");
    EXPECT_NO_THROW(expectConsistent(alignment.labels));
    EXPECT_NEAR(alignment.labels.duration(), line.audio.duration(), 1e-6);
    ASSERT_EQ(alignment.labels.words.size(), said.size());
    ASSERT_EQ(alignment.confidence.size(), said.size());
    for (std::size_t w = 0; w < said.size(); ++w) {
      EXPECT_EQ(alignment.labels.words[w].text, said[w].text);
      EXPECT_TRUE(alignment.confidence[w] >= 0 && alignment.confidence[w] <= 1);
    }
  }
}

}  // namespace
}  // namespace mouthpiece
