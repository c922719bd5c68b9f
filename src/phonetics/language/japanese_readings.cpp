#include "phonetics/language/japanese_readings.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>

#include "base/index.h"
#include "base/text_encoding.h"

namespace mouthpiece {
namespace {

constexpr std::size_t kMostDigits = 12;
constexpr std::array<std::string_view, 10> kOnes{"",   "イチ", "ニ",   "サン", "ヨン",
                                                 "ゴ", "ロク", "ナナ", "ハチ", "キュー"};
constexpr std::array<std::string_view, 10> kHundreds{"",           "ヒャク",      "ニヒャク",   "サンビャク",
                                                     "ヨンヒャク", "ゴヒャク",    "ロッピャク", "ナナヒャク",
                                                     "ハッピャク", "キューヒャク"};
constexpr std::array<std::string_view, 10> kThousands{"",       "セン",     "ニセン",   "サンゼン", "ヨンセン",
                                                      "ゴセン", "ロクセン", "ナナセン", "ハッセン", "キューセン"};
/// What four digits more count.
constexpr std::array<std::string_view, 3> kMyriads{"", "マン", "オク"};

/// Up to 9999; 1000 before a myriad is イッセン.
std::string belowMyriad(std::string_view digits, bool has_myriad) {
  std::array<std::size_t, 4> values{};
  for (std::size_t i = 0; i < digits.size(); ++i)
    values[values.size() - digits.size() + i] = static_cast<std::size_t>(digits[i] - '0');
  std::string reading(has_myriad && values[0] == 1 ? "イッセン" : kThousands[values[0]]);
  reading += kHundreds[values[1]];
  if (values[2] > 1) reading += kOnes[values[2]];
  if (values[2] > 0) reading += "ジュー";
  return reading.append(kOnes[values[3]]);
}

/// The digit that a word in full width is; nothing for another word.
std::optional<char> digitOf(std::string_view word) {
  constexpr std::string_view kFirst = "\uFF10";
  if (word.size() != kFirst.size() || word.substr(0, 2) != kFirst.substr(0, 2)) return std::nullopt;
  const int digit = static_cast<unsigned char>(word.back()) - static_cast<unsigned char>(kFirst.back());
  return digit >= 0 && digit <= 9 ? std::optional(static_cast<char>('0' + digit)) : std::nullopt;
}

/// Whether digits on both sides of `word` make no whole numbers.
bool joins(std::string_view word) {
  constexpr std::array<std::string_view, 10> kJoining{".", ",", "/", ":", "-", "．", "，", "／", "：", "－"};
  return std::find(kJoining.begin(), kJoining.end(), word) != kJoining.end();
}

}  // namespace

std::string japaneseNumber(std::string_view digits) {
  if (digits == "0") return "ゼロ";
  if (digits.empty() || digits.size() > kMostDigits || digits[0] == '0') return "";
  std::string reading;
  for (std::size_t left = digits.size(); left > 0;) {
    const std::size_t count = (left - 1) % 4 + 1, myriads = (left - count) / 4;
    const std::string part = belowMyriad(digits.substr(digits.size() - left, count), myriads > 0);
    if (!part.empty()) reading.append(part).append(kMyriads[myriads]);
    left -= count;
  }
  return reading;
}

std::vector<JapaneseReading> withCountedNumbers(const std::vector<JapaneseReading>& words) {
  const auto isDigitAt = [&](std::size_t i) { return i < words.size() && digitOf(words[i].word).has_value(); };
  std::vector<JapaneseReading> counted;
  for (std::size_t i = 0; i < words.size();) {
    std::string digits;
    std::size_t end = i;
    for (; isDigitAt(end); ++end) digits += *digitOf(words[end].word);
    const bool is_part = (i > 1 && joins(words[i - 1].word) && isDigitAt(i - 2)) ||
                         (end < words.size() && joins(words[end].word) && isDigitAt(end + 1));
    const std::string reading = digits.size() < 2 || is_part ? "" : japaneseNumber(digits);
    if (reading.empty()) {
      end = std::max(end, i + 1);
      counted.insert(counted.end(), words.begin() + signedIndex(i), words.begin() + signedIndex(end));
    } else {
      counted.push_back({digits, reading});
    }
    i = end;
  }
  return counted;
}

std::string katakanaOf(std::string_view text) {
  constexpr char32_t kFirst = 0x3041, kLast = 0x3096, kToKatakana = 0x60;
  std::string katakana;
  for (std::size_t at = 0; at < text.size();) {
    const std::optional<char32_t> sign = decodeUtf8(text, at);
    if (!sign) return std::string(text);
    appendUtf8(katakana, *sign >= kFirst && *sign <= kLast ? *sign + kToKatakana : *sign);
  }
  return katakana;
}

std::string latinWord(std::string_view word) {
  constexpr char32_t kFromAscii = 0xFEE0;
  std::string latin;
  for (std::size_t at = 0; at < word.size();) {
    const std::optional<char32_t> sign = decodeUtf8(word, at);
    if (!sign || *sign < kFromAscii) return "";
    const char32_t ascii = *sign - kFromAscii;
    if (!((ascii >= U'a' && ascii <= U'z') || (ascii >= U'A' && ascii <= U'Z'))) return "";
    latin += static_cast<char>(ascii);
  }
  return lowerCase(latin);
}

}  // namespace mouthpiece
