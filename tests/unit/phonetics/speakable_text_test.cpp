#include "phonetics/text/speakable_text.h"

#include "support/voice_testing.h"
#include "phonetics/text/latin_letters.h"

namespace mouthpiece {
namespace {

TEST(SpeakableText, KeepsPlainText) {
  EXPECT_EQ(speakableText("The time is now: \"ten\" (or so), isn't it? $5 - no!"),
            "The time is now: \"ten\" (or so), isn't it? $5, no!");
}

TEST(SpeakableText, SpellsAccentsQuotesAndDashesPlainly) {
  EXPECT_EQ(speakableText("caf\u00E9 na\u00EFve \u00C5ngstr\u00F6m stra\u00DFe \u0141\u00F3d\u017A \u0152uvre \u1EC7"),
            "cafe naive Angstrom strasse Lodz Oeuvre e");
  EXPECT_EQ(speakableText("cafe\u0301"), "cafe");
  EXPECT_EQ(speakableText("\u201Cit\u2019s\u201D \u2018so\u2019 1\u20132 a\u2014b\u2026"), "\"it's\" 'so' 1-2 a, b...");
  EXPECT_EQ(speakableText("\uFF28\uFF45\uFF4C\uFF4C\uFF4F\uFF01 \uFB01ne"), "Hello! fine");
  EXPECT_EQ(speakableText("zero\u200Bwidth so\u00ADft \uFEFFmark"), "zerowidth soft mark");
}

TEST(SpeakableText, SaysSigns) {
  EXPECT_EQ(speakableText("\u20AC5.50, \u00A33"), "5.50 euros, 3 pounds");
  EXPECT_EQ(speakableText("5 % & 3+4=7 @ 20\u00B0"), "5 percent and 3 plus 4 equals 7 at 20 degrees");
  EXPECT_EQ(speakableText("US$ x $20"), "US x $20");
}

TEST(SpeakableText, TakesControlCharactersAndOtherSignsForBlanks) {
  using namespace std::string_literals;
  EXPECT_EQ(speakableText("a\tb\nc\r\nd\0e\x1B[31mf\x7Fg"s), "a b c d e 31mf g");
  EXPECT_EQ(speakableText("a\\b{c}[d]<e>|f`g~h^i*j_k#l/m;n"), "a b c d e f g h i j k l m;n");
  EXPECT_EQ(speakableText("wow \U0001F600 \u2192 ok \u2764\uFE0F"), "wow ok");
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

TEST(SpeakableText, RefusesNothingToSayBrokenBytesAndEndlessText) {
  for (const char* text : {"", "   ", "...", "?!", "\n\n", "\u201C\u201D", "\U0001F600", "$", "\u0301"}) {
    EXPECT_NE(errorOf([&] { speakableText(text); }).find("has nothing to say"), std::string::npos) << text;
  }
  EXPECT_EQ(errorOf([] { speakableText("abc\xFF"); }), "text:byte 3: is broken UTF-8; expected text in UTF-8");
  EXPECT_EQ(errorOf([] { speakableText(std::string(kMaxSpokenCharacters + 1, 'a')); }),
            "text: is longer than 20000 characters; expected a shorter line, or several");
  EXPECT_NO_THROW(speakableText(std::string(kMaxSpokenCharacters, 'a')));
}

TEST(SpeakableText, BreaksUpEndlessWordsAndRowsOfSigns) {
  const std::string text = speakableText(std::string(100, 'a') + "!!!!!!!!");
  EXPECT_EQ(text, std::string(40, 'a') + " " + std::string(40, 'a') + " " + std::string(20, 'a') + "!!!");
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

TEST(LatinLetters, AreAsciiForTheWholeLatinRange) {
  for (char32_t c = 0x80; c < 0x2000; ++c) {
    for (const char letter : plainLatinLetters(c))
      EXPECT_TRUE((letter >= 'a' && letter <= 'z') || (letter >= 'A' && letter <= 'Z'));
  }
  EXPECT_EQ(plainLatinLetters(0xE9), "e");
  EXPECT_EQ(plainLatinLetters(0x1E9E), "SS");
  EXPECT_EQ(plainLatinLetters(0xD7), "");
  EXPECT_EQ(plainLatinLetters('a'), "");
}

}  // namespace
}  // namespace mouthpiece
