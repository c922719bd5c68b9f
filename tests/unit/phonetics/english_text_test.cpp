#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <string>

#include "base/errors.h"
#include "phonetics/text/speakable_text.h"
#include "support/error_of.h"

namespace mouthpiece {
namespace {

constexpr std::string_view kTable = "tests/data/text/normaliser_en.tsv";

TEST(EnglishText, IsSaidAsTheTableSays) {
  std::ifstream table(std::filesystem::path(MOUTHPIECE_SOURCE_DIR) / kTable);
  std::size_t number = 0, rows = 0;
  for (std::string line; std::getline(table, line);) {
    ++number;
    if (line.starts_with("# ")) continue;
    const std::size_t tab = line.find('\t');
    ASSERT_NE(tab, std::string::npos) << kTable << ":" << number << " has no tab";
    const std::string text = line.substr(0, tab), expected = line.substr(tab + 1);
    std::string spoken;
    EXPECT_EQ(errorOf([&] { spoken = speakableText(text); }), "no error") << kTable << ":" << number;
    EXPECT_EQ(spoken, expected) << kTable << ":" << number << ": " << text;
    EXPECT_EQ(speakableText(expected), expected) << kTable << ":" << number << " read again";
    ++rows;
  }
  EXPECT_GE(rows, 300U);
}

TEST(EnglishText, LeavesNoDigit) {
  for (const char* text : {"x1y22z333", "1.2.3.4.5.6", "1/2/3/4", "--5--", "1:2:3:4", "$1.2.3", "9'9'9\"", "#1#2", "5e",
                           "1,2,3", "0x1F", "v1v2", "12:99", "99/99/9999", "1-2-3-4-5-6-7-8-9-0-1-2-3-4-5-6-7-8-9",
                           "\u00B2"
                           "5\u00BD5"}) {
    const std::string spoken = speakableText(text);
    EXPECT_EQ(spoken.find_first_of("0123456789"), std::string::npos) << text << " is said " << spoken;
  }
}

/// A sign before the number is no part of a day; it was read as a digit, beyond the names of numbers.
TEST(EnglishText, ASignedNumberIsNoDayOfAMonth) {
  for (const char* text : {"Closed 30 April -5 May.", "Open 3 \u20135 May", "+5 May", "-5 May"})
    EXPECT_NE(speakableText(text).find("May"), std::string::npos) << text;
}

TEST(EnglishText, OfHostileTextStaysBounded) {
  const std::string digits(3000, '7');
  EXPECT_EQ(speakableText(digits).size(), 3000 * std::string_view("seven ").size() - 1);
  EXPECT_NE(errorOf([] { speakableText(std::string(kMaxSpokenCharacters, '7')); }).find("is longer than 20000"),
            std::string::npos)
      << "its words are too many";
  EXPECT_EQ(errorOf([] { speakableText("5\xFF"); }), "text:byte 1: is broken UTF-8; expected text in UTF-8");
  EXPECT_EQ(speakableText(std::string("5\x01"
                                      "6\x1B\x7F",
                                      5)),
            "five six");
  const auto start = std::chrono::steady_clock::now();
  for (const char* part :
       {"1-", "1.", "1/", "1:", "1,", "$1", "-", "'1", "a1", "1'", "1\"", "@a.", "U.", "#1", "I", "1e"}) {
    std::string text = "a ";
    while (text.size() < 4000) text += part;
    EXPECT_NE(errorOf([&] { EXPECT_LE(speakableText(text).size(), 2 * kMaxSpokenCharacters); }), "") << part;
  }
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(20));
}

TEST(EnglishText, WordsThatALexiconKnowsStay) {
  const auto is_known = [](std::string_view word) { return word == "25" || word == "FBI"; };
  EXPECT_EQ(speakableText("the FBI, 25 and 26", english(), is_known), "the FBI, 25 and twenty six");
}

}  // namespace
}  // namespace mouthpiece
