#include "phonetics/language/ipa.h"

#include <gtest/gtest.h>

#include <random>

#include "base/unicode.h"
#include "phonetics/labels/labels_builder.h"
#include "phonetics/labels/textgrid.h"
#include "phonetics/language/language.h"
#include "phonetics/text/lexicon.h"
#include "phonetics/text/speakable_text.h"
#include "support/error_of.h"

namespace mouthpiece {
namespace {

/// "K W" for the phones of an IPA text.
std::string seenAs(std::string_view ipa) {
  std::vector<std::string> unknown;
  std::string names;
  for (const SpelledPhone& phone : phonesOfIpa(ipa, unknown))
    names += (names.empty() ? "" : " ") + std::string(phoneName(phone.phone));
  EXPECT_TRUE(unknown.empty()) << ipa;
  return names;
}

IpaSound only(std::string_view ipa) {
  const IpaReading reading = readIpa(ipa);
  EXPECT_EQ(reading.sounds.size(), 1U) << ipa;
  EXPECT_TRUE(reading.unknown.empty()) << ipa;
  return reading.sounds.empty() ? IpaSound() : reading.sounds.front();
}

// The chart of 2020, by its tables.
constexpr const char* kPulmonic =
    "p b t d ʈ ɖ c ɟ k ɡ q ɢ ʔ m ɱ n ɳ ɲ ŋ ɴ ʙ r ʀ ⱱ ɾ ɽ ɸ β f v θ ð s z ʃ ʒ ʂ ʐ ç ʝ x ɣ χ ʁ ħ ʕ h ɦ ɬ ɮ ʋ ɹ ɻ j ɰ l ɭ "
    "ʎ ʟ";
constexpr const char* kOthers = "ʘ ǀ ǃ ǂ ǁ ɓ ɗ ʄ ɠ ʛ pʼ tʼ kʼ sʼ ʍ w ɥ ʜ ʢ ʡ ɕ ʑ ɺ ɧ t͡s k͡p";
constexpr const char* kVowels = "i y ɨ ʉ ɯ u ɪ ʏ ʊ e ø ɘ ɵ ɤ o ə ɛ œ ɜ ɞ ʌ ɔ æ ɐ a ɶ ɑ ɒ";
constexpr const char* kDiacritics =
    "n̥ d̥ s̬ t̬ tʰ dʰ ɔ̹ ɔ̜ u̟ e̠ ë e̽ n̩ e̯ ɚ a˞ b̤ a̤ b̰ a̰ t̼ d̼ tʷ dʷ tʲ dʲ tˠ dˠ tˤ dˤ ɫ e̝ ɹ̝ e̞ β̞ e̘ e̙ t̪ d̪ t̺ d̺ t̻ d̻ ẽ dⁿ dˡ d̚ "
    "ŋ̊ iː iˑ ĭ é ē è ě ê e̋ ȅ e᷄ e᷅ e᷈ ˈa ˌa a˥ a˩ a↗ a.a";

TEST(Ipa, EverySymbolOfTheChartHasARow) {
  for (const char* table : {kPulmonic, kOthers, kVowels, kDiacritics}) {
    const IpaReading reading = readIpa(table);
    EXPECT_TRUE(reading.unknown.empty()) << table << ": " << (reading.unknown.empty() ? "" : reading.unknown.front());
    std::vector<std::string> unknown;
    EXPECT_FALSE(phonesOfIpa(table, unknown).empty());
  }
  EXPECT_EQ(readIpa(kPulmonic).sounds.size(), 59U);
  EXPECT_EQ(readIpa(kVowels).sounds.size(), 28U);
  for (const std::string& letter : ipaLetters()) {
    for (const std::string& mark : ipaMarks()) {
      EXPECT_TRUE(readIpa(letter + mark).unknown.empty()) << letter << mark;
      EXPECT_FALSE(readIpa(letter + mark).sounds.empty()) << letter << mark;
    }
  }
}

TEST(Ipa, NothingIsDroppedInSilence) {
  EXPECT_EQ(readIpa("a☃b☃").unknown, std::vector<std::string>{"☃"});
  EXPECT_EQ(readIpa("\xff").unknown.size(), 1U);
  EXPECT_EQ(readIpa("").sounds.size(), 0U);
  EXPECT_EQ(readIpa("A").unknown, std::vector<std::string>{"A"}) << "capitals are no letters of the chart";
}

TEST(Ipa, LipsFollowTheArticulation) {
  for (const char* shut : {"p", "b", "m", "pʼ", "ɓ", "ʘ", "ʙ", "k͡p", "pː", "m̥", "p͡f"})
    EXPECT_TRUE(readIpa(shut).sounds.front().closesLips()) << shut;
  for (const char* open : {"β", "ɸ", "w", "f", "ɱ", "t", "a"}) EXPECT_FALSE(only(open).closesLips()) << open;
  for (const char* bitten : {"f", "v", "ɱ", "ʋ", "ⱱ", "p̪"}) EXPECT_TRUE(only(bitten).touchesTeeth()) << bitten;
  for (const char* round : {"y", "ʏ", "ø", "œ", "u", "o", "ɔ", "ɥ", "w", "tʷ", "ʉ"})
    EXPECT_GE(only(round).rounding, 0.7) << round;
  for (const char* spread : {"i", "e", "ɛ", "a", "ɯ", "ɤ", "s", "ɕ"}) EXPECT_EQ(only(spread).rounding, 0) << spread;
  EXPECT_LT(only("ɔ̜").rounding, only("ɔ").rounding);
  EXPECT_GT(only("ɔ̹").rounding, only("ɔ").rounding);
}

TEST(Ipa, MarksChangeTheirRow) {
  EXPECT_FALSE(only("z̥").voiced);
  EXPECT_TRUE(only("s̬").voiced);
  EXPECT_TRUE(only("ɑ̃").nasal);
  EXPECT_TRUE(only("ã").nasal) << "composed";
  EXPECT_TRUE(only("n̩").syllabic);
  EXPECT_FALSE(only("i̯").syllabic);
  EXPECT_EQ(only("tʼ").airstream, Airstream::kEjective);
  EXPECT_EQ(only("ǃ").airstream, Airstream::kClick);
  EXPECT_EQ(only("t̪").place, Place::kDental);
  EXPECT_EQ(only("tː").length, 2);
  EXPECT_EQ(only("ˈa").stress, 1);
  EXPECT_EQ(only("é").symbol, "e") << "a tone changes nothing that is seen";
  EXPECT_EQ(only("ç").manner, SoundManner::kFricative) << "c and cedilla, apart or not";
  EXPECT_TRUE(readIpa("ts").sounds.front().opens_affricate);
  EXPECT_FALSE(readIpa("tf").sounds.front().opens_affricate);
}

TEST(Ipa, SoundsLookLikeTheirNearestPhone) {
  const std::pair<const char*, const char*> kSeen[] = {
      {"y", "UW"},   {"ʏ", "UW"},     {"ø", "OW"},   {"œ", "AO"},    {"ɥ", "W"},    {"u", "UW"},   {"ɯ", "IY"},
      {"ʈ", "T"},    {"ɭ", "L"},      {"pʼ", "P"},   {"kʼ", "K"},    {"ʘ", "P"},    {"ǃ", "T"},    {"ǀ", "T"},
      {"ɓ", "B"},    {"pː", "P"},     {"x", "K"},    {"ɲ", "NG"},    {"t͡s", "T S"}, {"ts", "T S"}, {"tʃ", "CH"},
      {"t͡ɕ", "T S"}, {"pf", "P F"},   {"kʷ", "K W"}, {"ɕ", "S"},     {"ʂ", "SH"},   {"aɪ", "AY"},  {"aʊ", "AW"},
      {"œy", "OW"},  {"ɛ̃", "EH"},     {"ɱ", "V"},    {"θ", "TH"},    {"oʊ", "OW"},  {"əʊ", "OW"},  {"eɪ", "EY"},
      {"ɔɪ", "OY"},  {"eu", "EY UW"}, {"ɐʊ", "AW"},  {"ʊu", "UW UW"}};
  for (const auto& [ipa, phones] : kSeen) EXPECT_EQ(seenAs(ipa), phones) << ipa;
  for (const LanguagePhone& row : worldInventory()) {
    // English lips hardly round in UH; ʊ elsewhere is round.
    EXPECT_EQ(seenAs(row.ipa), row.phone == Phone::kUH ? "UW" : phoneName(row.phone)) << row.ipa;
  }
}

TEST(Ipa, DistancesAreMetrics) {
  std::vector<IpaSound> sounds;
  for (const std::string& letter : ipaLetters()) {
    for (IpaSound& sound : readIpa(letter).sounds) sounds.push_back(sound);
  }
  for (const IpaSound& a : sounds) {
    EXPECT_EQ(visibleDistance(a, a), 0);
    EXPECT_EQ(audibleDistance(a, a), 0);
    for (const IpaSound& b : sounds) {
      EXPECT_EQ(visibleDistance(a, b), visibleDistance(b, a));
      if (a.closesLips() != b.closesLips()) {
        EXPECT_GT(visibleDistance(a, b), 3.9);
      }
    }
  }
}

TEST(Ipa, IsReadFromXSampa) {
  for (const auto& [sampa, ipa] : {std::pair("\"bRYk@", "ˈbʁʏkə"), std::pair("a_~", "ã"), std::pair("t_>", "tʼ"),
                                   std::pair("s`", "ʂ"), std::pair("2:", "øː"), std::pair("r\\`", "ɻ"),
                                   std::pair("O\\", "ʘ"), std::pair("9~", "œ̃"), std::pair("s\\", "ɕ")}) {
    const IpaReading a = readIpa(ipaFromXSampa(sampa)), b = readIpa(ipa);
    ASSERT_EQ(a.sounds.size(), b.sounds.size()) << sampa;
    for (std::size_t i = 0; i < a.sounds.size(); ++i) EXPECT_EQ(a.sounds[i].symbol, b.sounds[i].symbol) << sampa;
  }
}

TEST(Ipa, AnyBytesAreTaken) {
  std::mt19937 random(20261122);
  const std::vector<std::string> letters = ipaLetters(), marks = ipaMarks();
  for (int round = 0; round < 3000; ++round) {
    std::string text;
    for (int i = 0; i < 12; ++i) {
      const unsigned kind = random() % 4;
      if (kind == 0) text += letters[random() % letters.size()];
      if (kind == 1) text += marks[random() % marks.size()];
      if (kind == 2) text += static_cast<char>(random() % 256);
      if (kind == 3) text += "\u0361";
    }
    const IpaReading reading = readIpa(text);
    for (const IpaSound& sound : reading.sounds) {
      EXPECT_TRUE(sound.rounding >= 0 && sound.rounding <= 1 && sound.height >= 0 && sound.height <= 1);
      EXPECT_FALSE(sound.symbol.empty());
    }
    EXPECT_LE(reading.sounds.size() + reading.unknown.size(), 2 * text.size() + 1);
    ipaFromXSampa(text);
  }
}

TEST(LexiconSets, AreToldApart) {
  const Lexicon arpabet = Lexicon::parseAnySet("red R EH1 D\nsoo S UW\n", "l");
  EXPECT_EQ(arpabet.find("red").at(0).phones, (std::vector{Phone::kR, Phone::kEH, Phone::kD}));
  EXPECT_TRUE(arpabet.find("red").at(0).ipa.empty());
  const Lexicon ipa = Lexicon::parseAnySet("Brücke ˈbʁʏkə\nmüde ˈ m yː d ə\n", "l", languageOf("de"));
  EXPECT_EQ(ipa.find("Brücke").at(0).phones, (std::vector{Phone::kB, Phone::kHH, Phone::kUW, Phone::kK, Phone::kAH}));
  EXPECT_EQ(ipa.find("Brücke").at(0).stress, (std::vector{-1, -1, 1, -1, -1}));
  EXPECT_EQ(ipa.find("müde").at(0).ipa, (std::vector<std::string>{"m", "yː", "d", "ə"}));
  EXPECT_EQ(ipa.find("müde").at(0).stress, (std::vector{-1, 1, -1, -1}));
  EXPECT_EQ(ipa.find("Bru\u0308cke").size(), 1U) << "the same word, its letters apart";
  const Lexicon sampa = Lexicon::parseAnySet("Brücke b R Y k @\nschön S 2: n\n", "l", languageOf("de"));
  EXPECT_EQ(sampa.find("schön").at(0).ipa, (std::vector<std::string>{"ʃ", "øː", "n"}));
  const Lexicon said = Lexicon::parseAnySet("# phones: X-SAMPA\nsee S i\nthaw T O\n", "l", languageOf("de"));
  EXPECT_EQ(said.find("thaw").at(0).ipa, (std::vector<std::string>{"θ", "ɔ"}));
  EXPECT_NE(errorOf([] { Lexicon::parseAnySet("a ☃\n", "l"); }).find("expected IPA"), std::string::npos);
}

// Scripts stay whole: every letter, its marks, and the order that it was written in.

TEST(Scripts, StayWholeInTextAndLabels) {
  for (const auto& [tag, text] :
       {std::pair("ar", "مَرْحَبًا بالعالم"), std::pair("he", "שָׁלוֹם עולם"), std::pair("hi", "नमस्ते दुनिया"),
        std::pair("th", "สวัสดีครับ"), std::pair("ja", "今日は学校へ行きます"), std::pair("ru", "Привет мир")}) {
    EXPECT_EQ(speakableText(text, languageOf(tag)), toNfc(text)) << tag;
    SpeechLabels labels =
        buildSpeechLabels({{.phone = Phone::kM, .span = {0.1, 0.3}, .word = 0, .ipa = "ɱ̊"}}, {text}, 0.5);
    const SpeechLabels again = parseTextGrid(formatTextGrid(labels), "a.TextGrid", languageOf(tag));
    ASSERT_EQ(again.words.size(), 1U);
    EXPECT_EQ(again.words[0].text, text);
    EXPECT_EQ(again.phones.at(1).name(), "ɱ̊");
  }
  EXPECT_EQ(speakableText("Bru\u0308cke", languageOf("de")), "Brücke") << "joined";
  EXPECT_NE(errorOf([] { speakableText("Привет"); }).find("expected letters that an English"), std::string::npos);
}

}  // namespace
}  // namespace mouthpiece
