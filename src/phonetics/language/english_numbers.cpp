#include "phonetics/language/english_numbers.h"

#include <algorithm>
#include <array>
#include <utility>

#include "base/errors.h"

namespace mouthpiece::english_text {
namespace {

constexpr std::array<std::string_view, 20> kSmall = {
    "zero", "one",    "two",    "three",    "four",     "five",    "six",     "seven",     "eight",    "nine",
    "ten",  "eleven", "twelve", "thirteen", "fourteen", "fifteen", "sixteen", "seventeen", "eighteen", "nineteen"};
constexpr std::array<std::string_view, 10> kTens = {"",      "",      "twenty",  "thirty", "forty",
                                                    "fifty", "sixty", "seventy", "eighty", "ninety"};
constexpr std::array<std::string_view, 6> kThousands = {"",        "thousand", "million",
                                                        "billion", "trillion", "quadrillion"};
constexpr std::size_t kMostDigits = 3 * kThousands.size();

constexpr std::array<std::pair<std::string_view, std::string_view>, 7> kOddOrdinals = {{{"one", "first"},
                                                                                        {"two", "second"},
                                                                                        {"three", "third"},
                                                                                        {"five", "fifth"},
                                                                                        {"eight", "eighth"},
                                                                                        {"nine", "ninth"},
                                                                                        {"twelve", "twelfth"}}};

void addWord(std::string& words, std::string_view word) {
  if (!words.empty()) words += ' ';
  words += word;
}

std::size_t valueOf(std::string_view digits) {
  std::size_t value = 0;
  for (const char c : digits) value = 10 * value + static_cast<std::size_t>(c - '0');
  return value;
}

/// Below 1000; nothing for 0.
void addBelowThousand(std::string& words, std::size_t value) {
  if (value >= 100) {
    addWord(words, kSmall[value / 100]);
    addWord(words, "hundred");
    value %= 100;
  }
  if (value >= 20) {
    addWord(words, kTens[value / 10]);
    value %= 10;
  }
  if (value > 0) addWord(words, kSmall[value]);
}

std::string belowThousand(std::size_t value) {
  std::string words;
  addBelowThousand(words, value);
  return words;
}

std::size_t lastWordOf(std::string_view words) {
  const std::size_t blank = words.rfind(' ');
  return blank == std::string_view::npos ? 0 : blank + 1;
}

}  // namespace

std::string digitByDigit(std::string_view digits) {
  std::string words;
  for (const char c : digits) addWord(words, kSmall[valueOf({&c, 1})]);
  return words;
}

std::string cardinal(std::string_view digits) {
  MOUTHPIECE_EXPECT(!digits.empty());
  if (digits == "0") return std::string(kSmall[0]);
  if (digits.size() > kMostDigits || digits[0] == '0') return digitByDigit(digits);
  std::string words;
  while (!digits.empty()) {
    const std::size_t groups = (digits.size() + 2) / 3;
    const std::size_t length = digits.size() - 3 * (groups - 1);
    const std::size_t value = valueOf(digits.substr(0, length));
    addBelowThousand(words, value);
    if (value > 0 && groups > 1) addWord(words, kThousands[groups - 1]);
    digits.remove_prefix(length);
  }
  return words;
}

std::string ordinal(std::string_view digits) {
  // "05" is the fifth.
  while (digits.size() > 1 && digits.front() == '0') digits.remove_prefix(1);
  std::string words = cardinal(digits);
  const std::size_t last = lastWordOf(words);
  const std::string_view word = std::string_view(words).substr(last);
  const auto odd = std::find_if(kOddOrdinals.begin(), kOddOrdinals.end(),
                                [&](const auto& candidate) { return candidate.first == word; });
  if (odd != kOddOrdinals.end()) return words.substr(0, last) + std::string(odd->second);
  if (words.back() == 'y') return words.substr(0, words.size() - 1) + "ieth";
  return words + "th";
}

std::string year(std::string_view digits) {
  const std::size_t value = valueOf(digits);
  const std::size_t century = value / 100, rest = value % 100;
  if (digits.size() != 4 || digits[0] == '0' || (century % 10 == 0 && rest < 10)) return cardinal(digits);
  std::string words = belowThousand(century);
  if (rest == 0) {
    addWord(words, "hundred");
  } else {
    if (rest < 10) addWord(words, "oh");
    addBelowThousand(words, rest);
  }
  return words;
}

std::string fractionPart(std::string_view digits, bool many) {
  if (digits == "2") return many ? "halves" : "half";
  std::string part = digits == "4" ? "quarter" : ordinal(digits);
  if (digits.starts_with("1") && part.starts_with("one ")) part.erase(0, 4);  // three hundredths
  return many ? part + "s" : part;
}

std::string plural(std::string words) {
  if (words.ends_with("y")) {
    words.pop_back();
    return words + "ies";
  }
  return words + (words.ends_with("x") ? "es" : "s");
}

}  // namespace mouthpiece::english_text
