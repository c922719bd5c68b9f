#include "phonetics/text/speakable_text.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <sstream>

#include "base/text_encoding.h"
#include "support/error_of.h"

namespace mouthpiece {
namespace {

TEST(SpeakableText, KeepsPlainText) {
  EXPECT_EQ(speakableText("The time is now: \"ten\" (or so), isn't it? $5 - no!"),
            "The time is now: \"ten\" (or so), isn't it? five dollars, no!");
}

TEST(SpeakableText, SpellsAccentsQuotesAndDashesPlainly) {
  EXPECT_EQ(speakableText("caf\u00E9 na\u00EFve \u00C5ngstr\u00F6m stra\u00DFe \u0141\u00F3d\u017A \u0152uvre \u1EC7"),
            "cafe naive Angstrom strasse Lodz Oeuvre e");
  EXPECT_EQ(speakableText("cafe\u0301"), "cafe");
  EXPECT_EQ(speakableText("\u201Cit\u2019s\u201D \u2018so\u2019 1\u20132 a\u2014b\u2026"),
            "\"it's\" 'so' one to two a, b...");
  EXPECT_EQ(speakableText("\uFF28\uFF45\uFF4C\uFF4C\uFF4F\uFF01 \uFB01ne"), "Hello! fine");
  EXPECT_EQ(speakableText("zero\u200Bwidth so\u00ADft \uFEFFmark"), "zerowidth soft mark");
}

TEST(SpeakableText, SaysSigns) {
  EXPECT_EQ(speakableText("\u20AC5.50, \u00A33"), "five euros and fifty cents, three pounds");
  EXPECT_EQ(speakableText("5 % & 3+4=7 @ 20\u00B0"), "five percent and three plus four equals seven at twenty degrees");
  EXPECT_EQ(speakableText("US$ x $20"), "U S x twenty dollars");
}

TEST(SpeakableText, TakesControlCharactersAndOtherSignsForBlanks) {
  using namespace std::string_literals;
  EXPECT_EQ(speakableText("a\tb\nc\r\nd\0e\x1B[31mf\x7Fg"s), "a b c d e thirty one M F g");
  EXPECT_EQ(speakableText("a\\b{c}[d]<e>|f`g~h^i*j_k#l/m;n"), "a b c d e f g h i j k l m;n");
  EXPECT_EQ(speakableText("wow \U0001F600 \u2192 ok \u2764\uFE0F"), "wow grinning face ok red heart");
}

TEST(SpeakableText, RefusesOtherScriptsAndNamesTheFirstLetter) {
  const char* tail = "; expected letters that an English voice reads (Latin script)";
  EXPECT_EQ(errorOf([] { speakableText("\u041F\u0440\u0438\u0432\u0435\u0442"); }),
            std::string("text:character 1: found '\u041F' (U+041F)") + tail);
  EXPECT_EQ(errorOf([] { speakableText("hi \u4F60\u597D"); }),
            std::string("text:character 4: found '\u4F60' (U+4F60)") + tail);
  for (const char* text : {"\u0645\u0631\u062D\u0628\u0627", "\u05E9", "\u0915", "\u3042", "\uD55C", "\u03B1", "\u0E01",
                           "\U00020000", "\u0661"}) {
    EXPECT_NE(errorOf([&] { speakableText(text); }).find("(U+"), std::string::npos) << text;
  }
}

TEST(SpeakableText, LeavesOutACharacterThatStandsAlone) {
  const auto leftOf = [](std::string_view text) {
    std::vector<std::string> left_out;
    std::string said = withoutLoneCharacters(text, english(), left_out);
    for (const std::string& each : left_out) said += "|" + each;
    return said;
  };
  EXPECT_EQ(leftOf("angle \u03B8 is 5 \u03A9"), "angle   is 5 \u03A9|\u03B8");
  EXPECT_EQ(leftOf("the sign \u4EBA, and \u0416."), "the sign  , and  .|\u4EBA|\u0416");
  for (const char* text :
       {"\u0416", "\u0416 \u0417.", "hi \u4F60\u597D", "caf\u00E9 \u2603 now", "now \xFF \u0416", "\uFF21 now"})
    EXPECT_EQ(leftOf(text), text) << "nothing is lone, or nothing would be left";
}

TEST(SpeakableText, RefusesNothingToSayBrokenBytesAndEndlessText) {
  for (const char* text : {"", "   ", "...", "?!", "\n\n", "\u201C\u201D", "\U0001FA97", "$", "\u0301"}) {
    EXPECT_NE(errorOf([&] { speakableText(text); }).find("has nothing to say"), std::string::npos) << text;
  }
  EXPECT_EQ(errorOf([] { speakableText("abc\xFF"); }), "text:byte 3: is broken UTF-8; expected text in UTF-8");
  EXPECT_EQ(errorOf([] { speakableText(std::string(kMaxSpokenCharacters + 1, 'a')); }),
            "text: is longer than 20000 characters; expected a shorter line, or several");
  EXPECT_NO_THROW(speakableText(std::string(kMaxSpokenCharacters, 'a')));
  const auto transcript = [](std::size_t characters) {
    return speakableText(std::string(characters, 'a'), english(), {}, kMaxTranscriptCharacters);
  };
  EXPECT_NO_THROW(transcript(kMaxTranscriptCharacters));
  EXPECT_EQ(errorOf([&] { transcript(kMaxTranscriptCharacters + 1); }),
            "text: is longer than 100000 characters; expected a shorter line, or several");
}

TEST(SpeakableText, TellsOfNumbersThatAreTooLongAsWords) {
  EXPECT_EQ(errorOf([] { speakableText(std::string(4500, '7')); }),
            "text: is longer than 20000 characters once its numbers and signs are words; expected a shorter line, or "
            "several");
}

TEST(SpeakableText, BreaksUpEndlessWordsAndRowsOfSigns) {
  const std::string endless(100, 'a'), longest(40, 'a'), rest(20, 'a');
  EXPECT_EQ(speakableText(endless + "!!!!!!!!"), longest + " " + longest + " " + rest + "!!!");
}

TEST(SpeakableText, LeavesNoWordWithoutSounds) {
  EXPECT_EQ(speakableText("!!! b ... ' c - \" d ?! -"), "b. c, d?");
  EXPECT_EQ(speakableText("(a) -- 'b' ()"), "(a), 'b'");
}

TEST(SpeakableText, SplitsAtSentencesAndKeepsEveryWord) {
  EXPECT_EQ(splitSentences("One. Two 2.5 three! ... Four", 100),
            (std::vector<std::string>{"One.", "Two 2.5 three!", "Four"}));
  std::string text;
  for (int i = 0; i < 500; ++i) text += "word ";
  text.pop_back();
  std::string joined;
  for (const auto& piece : splitSentences(text, 80)) {
    EXPECT_LE(piece.size(), 80U);
    if (!joined.empty()) joined += ' ';
    joined += piece;
  }
  EXPECT_EQ(joined, text);
}

TEST(SpeakableText, LatinLettersGiveLettersOrAreRefused) {
  std::size_t spelled = 0;
  for (char32_t c = 0xC0; c < 0x250; ++c) {
    if (c == 0xD7 || c == 0xF7) continue;  // times, divided by
    std::string letter;
    appendUtf8(letter, c);
    const std::string error = errorOf([&] {
      const std::string text = speakableText("a" + letter);
      const auto is_letter = [](unsigned char l) { return std::isalpha(l) != 0; };
      EXPECT_TRUE(std::all_of(text.begin(), text.end(), is_letter)) << text;
      EXPECT_TRUE(text.size() == 2 || text.size() == 3) << text;
      ++spelled;
    });
    EXPECT_TRUE(error == "no error" || error.find("(U+") != std::string::npos) << error;
  }
  EXPECT_GT(spelled, 300U);
  EXPECT_EQ(speakableText("\u00E9\u1E9E\u00FE"), "eSSth");
}

/// Letters, digits, signs, blanks, marks and letters with marks, at random.
std::string randomText(std::mt19937& random) {
  constexpr std::u32string_view kAlphabet =
      U"aZe9 0 .,;:!?'-$\"()  %&@\u20AC\u00A3\u00E9\u00DF\u2019\u2014\u2026\u0301\u200B\t\n\uFF21\u00BD";
  std::string text = "a";
  const auto length = std::uniform_int_distribution<int>(0, 120)(random);
  for (int i = 0; i < length; ++i)
    appendUtf8(text, kAlphabet[std::uniform_int_distribution<std::size_t>(0, kAlphabet.size() - 1)(random)]);
  return text;
}

TEST(SpeakableText, KeepsItsPromisesAndIsItsOwnSpeakableText) {
  const unsigned seed = 20261122;
  for (unsigned round = 0; round < 2000; ++round) {
    std::mt19937 random(seed + round);
    const std::string text = speakableText(randomText(random));
    SCOPED_TRACE(testing::Message() << "seed " << seed + round << ": " << text);
    EXPECT_EQ(text.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789 .,;:!?'-$\"()"),
              std::string::npos);
    EXPECT_EQ(text.find("  "), std::string::npos);
    EXPECT_TRUE(text.front() != ' ' && text.back() != ' ');
    std::istringstream words(text);
    for (std::string word; words >> word;) {
      EXPECT_LE(word.size(), 41U);  // 40, and the pause after it
      EXPECT_TRUE(std::any_of(word.begin(), word.end(), [](unsigned char c) { return std::isalnum(c) != 0; })) << word;
    }
    EXPECT_EQ(speakableText(text), text);
  }
}

TEST(SpeakableText, NoWordIsLeftWithoutASoundWhereALongOneIsCut) {
  const std::string longest(40, 'a');
  EXPECT_EQ(speakableText(longest + "!!!"), longest + "!");
  EXPECT_EQ(speakableText(longest + "\"b"), longest + " \"b");
}

TEST(SplitSentences, KeepsEveryWordInOrder) {
  const unsigned seed = 20261122;
  for (unsigned round = 0; round < 500; ++round) {
    std::mt19937 random(seed + round);
    const std::string text = speakableText(randomText(random) + " " + randomText(random));
    SCOPED_TRACE(testing::Message() << "seed " << seed + round << ": " << text);
    std::string joined;
    for (const std::string& piece : splitSentences(text, 80)) {
      EXPECT_LE(piece.size(), 80U);
      joined += piece + " ";
    }
    std::istringstream was(text), is(joined);
    EXPECT_TRUE(std::equal(std::istream_iterator<std::string>(was), {}, std::istream_iterator<std::string>(is), {}));
  }
}

/// eSpeak NG spells them.
TEST(SpeakableText, SaysGermanAbbreviations) {
  const auto said = [](std::string_view text) { return speakableText(text, languageOf("de")); };
  EXPECT_EQ(said("Das geht z. B. so, d. h. leicht."), "Das geht zum Beispiel so, das heißt leicht.");
  EXPECT_EQ(said("Z.B. müde, u.\u00a0a. schön"), "Zum Beispiel müde, unter anderem schön");
  EXPECT_EQ(said("(i. d. R. Größe 4 % bzw. ca. 7)"), "(in der Regel Größe 4 % beziehungsweise circa 7)");
  EXPECT_EQ(said("Brot, Wein usw."), "Brot, Wein und so weiter.");
  EXPECT_EQ(said("Frau Dr. Ört ist da. Ihr Pizza. B. kommt."), "Frau Doktor Ört ist da. Ihr Pizza. B. kommt.");
  EXPECT_EQ(speakableText("z. B. hier", languageOf("nl")), "z. B. hier");
}

/// Units, dates, fractions, ordinals and years, which eSpeak NG spells or reads wrong; said once, they stay.
TEST(SpeakableText, SaysAmountsOfOtherLanguages) {
  std::ifstream table(std::filesystem::path(MOUTHPIECE_SOURCE_DIR) / "tests/data/text/amounts.tsv");
  std::size_t rows = 0;
  for (std::string line; std::getline(table, line);) {
    if (line.starts_with('#')) continue;
    const std::size_t first = line.find('\t'), second = line.find('\t', first + 1);
    ASSERT_NE(second, std::string::npos) << line;
    const Language& language = languageOf(line.substr(0, first));
    const std::string written = line.substr(first + 1, second - first - 1), said = line.substr(second + 1);
    EXPECT_EQ(speakableText(written, language), said) << language.tag << ": " << written;
    EXPECT_EQ(speakableText(said, language), said) << language.tag;
    ++rows;
  }
  EXPECT_GT(rows, 30U);
}

}  // namespace
}  // namespace mouthpiece
