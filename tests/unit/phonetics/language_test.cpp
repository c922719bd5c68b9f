#include "phonetics/language/language.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <iterator>
#include <set>
#include <sstream>

#include "base/errors.h"
#include "phonetics/labels/syllables.h"
#include "phonetics/labels/textgrid.h"
#include "phonetics/language/language_tag.h"
#include "phonetics/text/lexicon.h"
#include "phonetics/text/speakable_text.h"
#include "support/error_of.h"
#include "support/made_up_language.h"

namespace mouthpiece {
namespace {

std::vector<std::string> words(std::string_view list) {
  std::istringstream stream{std::string(list)};
  return {std::istream_iterator<std::string>(stream), {}};
}

class EveryLanguage : public testing::TestWithParam<const Language*> {};

TEST_P(EveryLanguage, ItsInventoryIsComplete) {
  const Language& language = *GetParam();
  std::set<Phone> phones;
  bool has_vowel = false;
  for (const LanguagePhone& phone : language.inventory) {
    EXPECT_NE(phone.phone, Phone::kSil);
    EXPECT_TRUE(phones.insert(phone.phone).second) << phoneName(phone.phone) << " stands there twice";
    EXPECT_FALSE(phone.ipa.empty()) << phoneName(phone.phone);
    EXPECT_EQ(language.find(phone.phone), &phone);
    has_vowel = has_vowel || isVowel(phone.phone);
  }
  EXPECT_TRUE(has_vowel);
  EXPECT_TRUE(isVowel(language.reduced_vowel));
  EXPECT_EQ(language.find(Phone::kSil), nullptr);
  EXPECT_FALSE(language.text.expected.empty());
}

TEST_P(EveryLanguage, ASymbolNamesOnePhone) {
  const Language& language = *GetParam();
  for (const auto& [set, names] :
       {std::pair(PhoneSet::kIpa, &LanguagePhone::ipa), std::pair(PhoneSet::kXSampa, &LanguagePhone::x_sampa)}) {
    std::set<std::string> seen;
    for (const LanguagePhone& phone : language.inventory) {
      for (const std::string& name : words(phone.*names)) {
        EXPECT_TRUE(seen.insert(name).second) << name << " stands for two phones";
        EXPECT_EQ(phoneFromName(name, set, language), phone.phone) << name;
      }
    }
  }
}

TEST_P(EveryLanguage, ItsVoiceSymbolsArePhonesItHas) {
  for (const VoiceSymbol& symbol : GetParam()->voice_symbols) {
    for (const std::string& name : words(symbol.phones)) {
      const auto phone = phoneFromName(name);
      ASSERT_TRUE(phone) << name;
      EXPECT_NE(GetParam()->find(*phone), nullptr) << name;
    }
    EXPECT_FALSE(phoneFromName(symbol.ipa, PhoneSet::kIpa, *GetParam())) << symbol.ipa << " needs no row of its own";
  }
}

TEST_P(EveryLanguage, ItsSignsAreSaidInItsOwnLetters) {
  const TextRules& rules = GetParam()->text;
  std::set<char32_t> seen;
  for (const SpelledSign& sign : rules.signs) {
    EXPECT_TRUE(seen.insert(sign.sign).second) << sign.spelled;
    const std::string said = speakableText("x " + std::string(sign.spelled) + " x", *GetParam());
    EXPECT_EQ(words(said), words("x " + std::string(sign.spelled) + " x"));
  }
  for (const char32_t currency : rules.currencies) EXPECT_TRUE(seen.contains(currency));
}

TEST_P(EveryLanguage, SingleConsonantsOrPairsOpenItsSyllables) {
  std::size_t legal = 0;
  for (const LanguagePhone& phone : GetParam()->inventory) {
    const bool opens = isLegalOnset(std::span(&phone.phone, 1), *GetParam());
    EXPECT_FALSE(opens && isVowel(phone.phone));
    legal += opens ? 1 : 0;
  }
  EXPECT_GT(legal, 0U);
  EXPECT_TRUE(isLegalOnset({}, *GetParam()));
}

INSTANTIATE_TEST_SUITE_P(Known, EveryLanguage, testing::ValuesIn(languages().begin(), languages().end()),
                         [](const auto& language) {
                           std::string name(language.param->tag);
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });
INSTANTIATE_TEST_SUITE_P(MadeUp, EveryLanguage, testing::Values(&madeUpLanguage()));

TEST(Languages, AreFoundByTheirTags) {
  for (const char* tag : {"en", "EN", "en-US", "en-GB-oxendict"}) EXPECT_EQ(&languageOf(tag), &english()) << tag;
  EXPECT_EQ(languages().front(), &english());
  for (const auto& [tag, name] :
       {std::pair("de-AT", "German"), std::pair("pt-br", "Portuguese of Brazil"), std::pair("pt-PT", "Portuguese"),
        std::pair("zh-Hans-CN", "Mandarin"), std::pair("cmn", "Mandarin"), std::pair("JA", "Japanese"),
        std::pair("sv-SE", "Swedish"), std::pair("iw", "Hebrew"), std::pair("in-ID", "Indonesian")})
    EXPECT_EQ(languageOf(tag).name, name) << tag;
  for (const auto& [name, tag] :
       {std::pair("de_DE", "de"), std::pair("DE_de.UTF-8", "de"), std::pair("de_DE@euro", "de"),
        std::pair("pt_BR.UTF-8", "pt-BR"), std::pair("en_GB", "en"), std::pair("sv_SE.utf8", "sv"),
        std::pair("German", "de"), std::pair("deutsch", "de"), std::pair("Français", "fr"), std::pair("english", "en"),
        std::pair("Spanish of Latin America", "es-419"), std::pair("日本語", "ja"), std::pair("Swedish", "sv"),
        std::pair("polski", "pl"), std::pair("Chinese", "zh")})
    EXPECT_EQ(languageOf(name).tag, tag) << name;
  EXPECT_EQ(plainTag("pt_BR.UTF-8"), "pt-br");
  EXPECT_EQ(&languageOf("no"), &languageOf("nb-NO"));
  EXPECT_NE(errorOf([] { languageOf("yue-HK"); }).find("'yue-HK', of which eSpeak NG gives no usable phones"),
            std::string::npos);
  EXPECT_TRUE(languageOf("de").is_tuned);
  EXPECT_FALSE(languageOf("sv").is_tuned);
  EXPECT_EQ(&languageOf("sv"), &languageOf("sv-SE"));
  for (const char* tag : {"", "-", "xx", "e", "eng", "x-en", "C.UTF-8", "of", "_"})
    EXPECT_NE(errorOf([&] { languageOf(tag); }).find("expected one of en"), std::string::npos) << tag;
}

TEST(English, HasEveryRowButSilence) {
  EXPECT_EQ(english().inventory.size(), kPhoneCount - 1);
  for (const LanguagePhone& phone : english().inventory) EXPECT_FALSE(phone.x_sampa.empty()) << phoneName(phone.phone);
}

TEST(English, ReadsTheUsualTranscriptions) {
  const auto spelled = [](std::string_view symbols, PhoneSet set) {
    std::string names;
    for (const std::string& symbol : words(symbols))
      names += std::string(phoneName(phoneFromName(symbol, set).value())) + " ";
    return names;
  };
  EXPECT_EQ(spelled("ð ə t aɪ m ɪ z n aʊ", PhoneSet::kIpa), "DH AH T AY M IH Z N AW ");
  EXPECT_EQ(spelled("D @ t aI m I z n aU", PhoneSet::kXSampa), "DH AH T AY M IH Z N AW ");
  EXPECT_EQ(spelled("tʰ iː t͡ʃ ˈɜː", PhoneSet::kIpa), "T IY CH ER ");  // marks are passed over
  EXPECT_EQ(spelled("DH_B AH0_I sil", PhoneSet::kArpabet), "DH AH sil ");
  EXPECT_FALSE(phoneFromName("ʙ", PhoneSet::kIpa));
}

TEST(English, KnowsHowToSayWhatNoLexiconHas) {
  EXPECT_EQ(english().read_out("25"), (std::vector<std::string>{"twenty", "five"}));
  const Pronunciation said = english().pronounce("Blorvik");
  ASSERT_FALSE(said.phones.empty());
  EXPECT_EQ(said.phones.front(), Phone::kB);
  EXPECT_EQ(said.phones.size(), said.stress.size());
  for (std::size_t i = 0; i < said.phones.size(); ++i) {
    EXPECT_NE(english().find(said.phones[i]), nullptr);
    EXPECT_TRUE(said.stress[i] == -1 || isVowel(said.phones[i])) << "stress stands with vowels";
  }
}

TEST(PhoneNames, ClosuresAreThoseOfThePlosives) {
  for (std::size_t i = 1; i < kPhoneCount; ++i) {
    const PhoneRow& row = rowOf(static_cast<Phone>(i));
    std::string name(row.name);
    std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) { return std::tolower(c); });
    EXPECT_EQ(closedStop(name + "cl").has_value(), row.manner == Articulation::kPlosive) << name;
  }
  for (const char* name : {"", "cl", "Bcl", "bCL", "xcl", "bclo"}) EXPECT_FALSE(closedStop(name)) << name;
}

// A language that was made up on one page: nothing but its own source file says anything of it.

TEST(MadeUpLanguage, WritesTextByItsOwnRules) {
  EXPECT_EQ(speakableText("Mö & pa, 3 \u20B9!", madeUpLanguage()), "Mö un pa, 3 rupi!");
  EXPECT_EQ(speakableText("\u20B95 \u2014 té", madeUpLanguage()), "5 rupi, te");
  EXPECT_EQ(speakableText(std::string(39, 'a') + "\u00F6b", madeUpLanguage()), std::string(39, 'a') + "\u00F6 b")
      << "letters are not cut in two";
  EXPECT_NE(errorOf([] { speakableText("\u041F", madeUpLanguage()); }).find("expected Tokish letters"),
            std::string::npos);
}

TEST(MadeUpLanguage, SpellsItsLexiconInItsOwnSymbols) {
  const Lexicon lexicon = Lexicon::parse(kMadeUpLexicon, "tokish", PhoneSet::kIpa, madeUpLanguage());
  EXPECT_EQ(lexicon.find("tok").at(0).phones, (std::vector{Phone::kT, Phone::kOW, Phone::kK}));
  EXPECT_EQ(lexicon.find("mö").at(0).phones, (std::vector{Phone::kM, Phone::kUW}));
  // A sound from elsewhere is still IPA; what no row describes is refused.
  EXPECT_EQ(Lexicon::parse("a ʒ", "tokish", PhoneSet::kIpa, madeUpLanguage()).find("a").at(0).ipa.at(0), "ʒ");
  EXPECT_EQ(Lexicon::parse("a ʒ", "tokish", PhoneSet::kIpa, madeUpLanguage()).find("a").at(0).phones.at(0), Phone::kZH);
  EXPECT_NE(errorOf([] { Lexicon::parse("a ☃", "tokish", PhoneSet::kIpa, madeUpLanguage()); }).find("expected IPA"),
            std::string::npos);
}

TEST(MadeUpLanguage, CutsSyllablesByItsOwnOnsets) {
  const std::array word{Phone::kAA, Phone::kS, Phone::kP, Phone::kAA};
  EXPECT_EQ(syllabify(word)[1].first, 1U) << "English: a-spa";
  EXPECT_EQ(syllabify(word, madeUpLanguage())[1].first, 2U) << "no two consonants: as-pa";
  const std::array reduced_first{Phone::kAA, Phone::kT, Phone::kUW};
  const std::array syllables{WordSyllable{0, 1}, WordSyllable{1, 2}};
  EXPECT_EQ(likelyStressedSyllable(reduced_first, syllables), 0U);
  EXPECT_EQ(likelyStressedSyllable(reduced_first, syllables, madeUpLanguage()), 1U) << "its reduced vowel is another";
}

TEST(MadeUpLanguage, ReadsLabelFilesInItsOwnSymbols) {
  const std::string grid =
      "\"ooTextFile\" \"TextGrid\" 0 1 <exists> 1 \"IntervalTier\" \"phones\" 0 1 3 "
      "0.1 0.3 \"t\" 0.3 0.6 \"ø\" 0.6 0.9 \"k\"";
  const SpeechLabels labels = parseTextGrid(grid, "a.TextGrid", madeUpLanguage());
  EXPECT_EQ(labels.phones.at(2).phone, Phone::kUW);
  const SpeechLabels in_english = parseTextGrid(grid, "a.TextGrid");
  EXPECT_EQ(in_english.phones.at(2).name(), "ø") << "English has none; IPA is read by articulation";
  EXPECT_EQ(in_english.phones.at(2).phone, Phone::kOW);
}

}  // namespace
}  // namespace mouthpiece
