// Numbers read back from their words by one who knows how English says them.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "phonetics/text/speakable_text.h"

namespace mouthpiece {
namespace {

std::vector<std::string> wordsOf(const std::string& text) {
  std::istringstream stream(text);
  std::vector<std::string> words;
  for (std::string word; stream >> word;) words.push_back(word);
  return words;
}

const std::map<std::string, std::uint64_t>& smallNumbers() {
  static const std::map<std::string, std::uint64_t> numbers = [] {
    std::map<std::string, std::uint64_t> made;
    constexpr std::array kUnits{"zero",     "one",     "two",     "three",     "four",     "five",    "six",
                                "seven",    "eight",   "nine",    "ten",       "eleven",   "twelve",  "thirteen",
                                "fourteen", "fifteen", "sixteen", "seventeen", "eighteen", "nineteen"};
    constexpr std::array kTens{"twenty", "thirty", "forty", "fifty", "sixty", "seventy", "eighty", "ninety"};
    for (std::size_t i = 0; i < kUnits.size(); ++i) made[kUnits[i]] = i;
    for (std::size_t i = 0; i < kTens.size(); ++i) made[kTens[i]] = 10 * (i + 2);
    return made;
  }();
  return numbers;
}

/// The number that words say, all of them; -1 where they are no number.
std::int64_t numberSaid(const std::vector<std::string>& words) {
  static const std::map<std::string, std::uint64_t> kScales{{"thousand", 1'000},
                                                            {"million", 1'000'000},
                                                            {"billion", 1'000'000'000},
                                                            {"trillion", 1'000'000'000'000},
                                                            {"quadrillion", 1'000'000'000'000'000}};
  std::uint64_t whole = 0, group = 0, last_scale = ~std::uint64_t{0};
  for (const std::string& word : words) {
    if (const auto small = smallNumbers().find(word); small != smallNumbers().end()) {
      const std::uint64_t tens = group % 100;
      // Units follow tens, and neither follows what it would replace.
      const bool fits = small->second < 10 ? tens == 0 || (tens >= 20 && tens % 10 == 0) : tens == 0;
      if (!fits) return -1;
      group += small->second;
    } else if (word == "hundred" && group > 0 && group < 10) {
      group *= 100;
    } else if (const auto scale = kScales.find(word); scale != kScales.end()) {
      if (group == 0 || scale->second >= last_scale) return -1;
      whole += group * scale->second;
      last_scale = scale->second;
      group = 0;
    } else {
      return -1;
    }
  }
  return words.empty() ? -1 : static_cast<std::int64_t>(whole + group);
}

/// A year in hundreds: "nineteen oh five", "eighteen hundred", "twenty twenty one"; or as a number.
std::int64_t yearSaid(const std::vector<std::string>& words) {
  if (const std::int64_t number = numberSaid(words); number >= 0) return number;
  for (std::size_t cut = 1; cut < words.size(); ++cut) {
    const std::vector<std::string> before(words.begin(), words.begin() + static_cast<std::ptrdiff_t>(cut));
    std::vector<std::string> after(words.begin() + static_cast<std::ptrdiff_t>(cut), words.end());
    const std::int64_t century = numberSaid(before);
    if (century < 10 || century > 99) continue;
    if (after == std::vector<std::string>{"hundred"}) return 100 * century;
    const bool is_oh = after[0] == "oh";
    if (is_oh) after.erase(after.begin());
    const std::int64_t rest = numberSaid(after);
    if (rest >= 0 && rest < 100 && is_oh == (rest < 10)) return 100 * century + rest;
  }
  return -1;
}

TEST(EnglishNumbers, CanBeReadBackFromTheirWords) {
  std::mt19937_64 random(11);
  std::vector<std::uint64_t> numbers{0, 9, 10, 11, 19, 20, 21, 99, 100, 101, 110, 119, 120, 999};
  for (std::uint64_t power = 10'000; power <= 100'000'000'000'000'000; power *= 10)
    for (const std::uint64_t number : {power - 1, power, power + 1, 2 * power, 5 * power + 12})
      numbers.push_back(number);
  for (int i = 0; i < 400; ++i) {
    std::uint64_t limit = 10'000;
    for (std::uint64_t digits = random() % 14; digits > 0; --digits) limit *= 10;
    numbers.push_back(limit + random() % (9 * limit));
  }
  for (const std::uint64_t number : numbers) {
    if (number >= 1000 && number < 10000) continue;  // those are years
    std::string with_commas = std::to_string(number);
    for (std::size_t at = with_commas.size(); at > 3;) with_commas.insert(at -= 3, ",");
    const std::string said = speakableText(with_commas);
    EXPECT_EQ(numberSaid(wordsOf(said)), static_cast<std::int64_t>(number)) << number << ": " << said;
    if (number >= 1'000'000) continue;  // of more digits without commas each is said
    EXPECT_EQ(speakableText(std::to_string(number)), said) << number;
  }
}

TEST(EnglishNumbers, EveryYearCanBeReadBack) {
  for (int year = 1000; year <= 2999; ++year) {
    const std::string said = speakableText(fmt::format("in {}", year));
    const std::vector<std::string> words = wordsOf(said);
    ASSERT_EQ(words[0], "in");
    EXPECT_EQ(yearSaid({words.begin() + 1, words.end()}), year) << said;
  }
}

TEST(EnglishNumbers, OrdinalsAreTheirNumbersButForTheLastWord) {
  const std::map<std::string, std::string> odd{{"first", "one"},     {"second", "two"},   {"third", "three"},
                                               {"fifth", "five"},    {"eighth", "eight"}, {"ninth", "nine"},
                                               {"twelfth", "twelve"}};
  for (int number = 1; number <= 400; ++number) {
    const char* ending = number % 100 / 10 == 1 ? "th"
                         : number % 10 == 1     ? "st"
                         : number % 10 == 2     ? "nd"
                         : number % 10 == 3     ? "rd"
                                                : "th";
    const std::string said = speakableText(fmt::format("the {}{}", number, ending));
    std::vector<std::string> words = wordsOf(said);
    words.erase(words.begin());
    std::string& last = words.back();
    if (const auto found = odd.find(last); found != odd.end()) {
      last = found->second;
    } else if (last.ends_with("ieth")) {
      last = last.substr(0, last.size() - 4) + "y";
    } else {
      ASSERT_TRUE(last.ends_with("th")) << said;
      last = last.substr(0, last.size() - 2);
    }
    EXPECT_EQ(numberSaid(words), number) << said;
  }
}

/// Money in all its ways is so many dollars and cents: one of each is singular, none is left out.
TEST(EnglishNumbers, DollarsAndCentsAreCounted) {
  std::mt19937 random(12);
  for (int round = 0; round < 300; ++round) {
    const int dollars = round % 5 == 0 ? static_cast<int>(random() % 3) : static_cast<int>(random() % 1000);
    const int cents = round % 7 == 0 ? 1 : static_cast<int>(random() % 100);
    if (dollars == 0 && cents == 0) continue;
    const std::string said = speakableText(fmt::format("${}.{:02}", dollars, cents));
    std::vector<std::string> words = wordsOf(said), before;
    int read_dollars = 0, read_cents = 0;
    for (const std::string& word : words) {
      if (word == "dollar" || word == "dollars") {
        read_dollars = static_cast<int>(numberSaid(before));
        EXPECT_EQ(word == "dollar", read_dollars == 1) << said;
        before.clear();
      } else if (word == "cent" || word == "cents") {
        read_cents = static_cast<int>(numberSaid(before));
        EXPECT_EQ(word == "cent", read_cents == 1) << said;
        before.clear();
      } else if (word != "and") {
        before.push_back(word);
      }
    }
    EXPECT_EQ(read_dollars, dollars) << said;
    EXPECT_EQ(read_cents, cents) << said;
    EXPECT_TRUE(before.empty()) << said;
  }
}

TEST(EnglishNumbers, DecimalsAreReadDigitByDigit) {
  std::mt19937 random(13);
  for (int round = 0; round < 200; ++round) {
    const std::uint64_t whole = random() % 1000;
    std::string digits;
    for (std::size_t n = 1 + random() % 6; n > 0; --n) digits += static_cast<char>('0' + random() % 10);
    const std::string said = speakableText(fmt::format("it is {}.{} now", whole, digits));
    const std::vector<std::string> words = wordsOf(said);
    const auto point = std::find(words.begin(), words.end(), "point");
    ASSERT_NE(point, words.end()) << said;
    EXPECT_EQ(numberSaid({words.begin() + 2, point}), static_cast<std::int64_t>(whole)) << said;
    std::string read;
    for (auto word = point + 1; word + 1 != words.end(); ++word) {
      ASSERT_TRUE(smallNumbers().contains(*word)) << said;
      read += std::to_string(smallNumbers().at(*word));
    }
    EXPECT_EQ(read, digits) << said;
  }
}

/// Times of day, all of them: hours and minutes come back, and on the hour nobody says minutes.
TEST(EnglishNumbers, EveryTimeOfDayCanBeReadBack) {
  for (int hour = 1; hour <= 12; ++hour) {
    for (int minute = 0; minute < 60; ++minute) {
      const std::string said = speakableText(fmt::format("at {}:{:02} p.m.", hour, minute));
      std::vector<std::string> words = wordsOf(said);
      ASSERT_GE(words.size(), 3U) << said;
      EXPECT_EQ(smallNumbers().at(words[1]), static_cast<std::uint64_t>(hour)) << said;
      std::vector<std::string> rest;
      for (std::size_t i = 2; i < words.size() && (smallNumbers().contains(words[i]) || words[i] == "oh"); ++i)
        rest.push_back(words[i]);
      const bool is_oh = !rest.empty() && rest[0] == "oh";
      if (is_oh) rest.erase(rest.begin());
      EXPECT_EQ(rest.empty() ? 0 : numberSaid(rest), minute) << said;
      EXPECT_EQ(is_oh, minute > 0 && minute < 10) << said;
    }
  }
}

}  // namespace
}  // namespace mouthpiece
