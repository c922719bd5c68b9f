#include "phonetics/language/english_tokens.h"

#include <algorithm>
#include <array>

#include "base/text_encoding.h"
#include "base/text_numbers.h"
#include "phonetics/language/english_spelling.h"
#include "phonetics/language/english_tables.h"

namespace mouthpiece::english_text {
namespace {

/// The digits of "⁻³" as ASCII, from `at` on, which moves behind them; "" where it is no power.
std::string powerAt(std::string_view text, std::size_t& at) {
  std::string power;
  while (at < text.size()) {
    std::size_t next = at;
    const char32_t c = decodeUtf8(text, next).value_or(0);
    const bool is_high = (c >= 0x2074 && c <= 0x2079) || c == 0x2070 || c == 0xB9 || c == 0xB2 || c == 0xB3;
    if (c == 0x207B && power.empty()) {
      power = "-";
    } else if (is_high) {
      power += static_cast<char>('0' + (c >= 0x2070 ? c - 0x2070 : c == 0xB9 ? 1 : c - 0xB0));
    } else {
      break;
    }
    at = next;
  }
  return power == "-" ? std::string() : power;
}

/// A Roman number that is one sign: as letters behind a name ("Chapter Ⅳ"), else in digits; "" for any other sign.
std::string romanSign(char32_t sign, std::string_view before) {
  constexpr std::array<std::string_view, 12> kLetters{"I",   "II",   "III", "IV", "V",  "VI",
                                                      "VII", "VIII", "IX",  "X",  "XI", "XII"};
  const char32_t from = sign >= 0x2170 ? 0x2170 : 0x2160;
  if (sign < from || sign - from >= kLetters.size()) return {};
  before = trimmed(before);
  const std::size_t word = before.rfind(' ') + 1;
  const bool is_named = word < before.size() && isCapital(before[word]);
  return is_named ? std::string(kLetters[sign - from]) : std::to_string(sign - from + 1);
}

}  // namespace

int romanValue(std::string_view word) {
  struct Row {
    std::string_view sign;
    int value;
  };
  constexpr Row kRows[] = {{"M", 1000}, {"CM", 900}, {"D", 500}, {"CD", 400}, {"C", 100}, {"XC", 90}, {"L", 50},
                           {"XL", 40},  {"X", 10},   {"IX", 9},  {"V", 5},    {"IV", 4},  {"I", 1}};
  int value = 0;
  for (const Row& row : kRows) {
    for (int times = 0; word.starts_with(row.sign) && times < (row.sign.size() == 1 && row.sign[0] != 'V' ? 3 : 1);
         ++times) {
      value += row.value;
      word.remove_prefix(row.sign.size());
    }
  }
  return word.empty() ? value : 0;
}

std::string named(std::string_view text) {
  std::string out;
  char32_t last = 0;
  const auto isFlag = [](char32_t c) { return c >= 0x1F1E6 && c <= 0x1F1FF; };
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t begin = at;
    const auto sign = decodeUtf8(text, at);
    if (!sign) {
      at = begin + 1;
      continue;
    }
    constexpr char32_t kJoiner = 0x200D;
    if (*sign == kJoiner || (last == kJoiner && *sign >= 0x2190)) {  // joined emoji: the first has been named
      last = *sign == kJoiner || *sign == 0xFE0F ? kJoiner : 0;
      continue;
    }
    if (isFlag(*sign)) {
      std::size_t behind = at;
      const char32_t second = at < text.size() ? decodeUtf8(text, behind).value_or(0) : 0;
      if (!isFlag(second)) continue;
      const auto letter = [](char32_t c) { return static_cast<char>('A' + (c - 0x1F1E6)); };
      out += " flag " + letterByLetter(std::string{letter(*sign), letter(second)}) + " ";
      at = behind;
      continue;
    }
    const std::string_view after_heart = text.substr(std::min(begin + 2, text.size()));
    if (text.substr(begin).starts_with("<3") && (out.empty() || out.back() == ' ') &&
        isPunctuation(after_heart.substr(0, after_heart.find(' ')))) {
      out += "heart";
      at = begin + 2;
      continue;
    }
    const auto emoji =
        std::find_if(emojis().begin(), emojis().end(), [&](const Emoji& candidate) { return candidate.sign == *sign; });
    std::size_t behind = begin;
    const std::string power = !out.empty() && isDigit(out.back()) ? powerAt(text, behind) : std::string();
    if (!power.empty() && power != "2" && power != "3") {
      out += "^" + power;
      at = behind;
    } else if (const std::string roman = romanSign(*sign, out); !roman.empty()) {
      out += roman;
    } else if (*sign == 0x2126) {
      out += "Ω";
    } else if (*sign == 0x3BC) {
      out += "µ";
    } else if (emoji != emojis().end()) {
      if (*sign != last) out += " " + std::string(emoji->name) + " ";
    } else if (*sign <= ' ' || *sign == 0x7F || *sign == 0xA0 || (*sign >= 0x2000 && *sign <= 0x200A) ||
               *sign == 0x202F) {
      out += ' ';
    } else if (*sign == 0x2033) {
      out += '"';
    } else {
      out += text.substr(begin, at - begin);
    }
    last = *sign;
  }
  return out;
}

std::vector<TextToken> tokensOf(std::string_view text) {
  std::vector<TextToken> tokens;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(' '), text.size());
    const std::string_view token = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    if (token.empty()) continue;
    std::size_t lead = std::min(token.find_first_not_of("([{<\"'*_~"), token.size());
    // '90s
    if (lead > 0 && token[lead - 1] == '\'' && countDigits(token.substr(lead)) == 2) --lead;
    tokens.push_back({token.substr(0, lead), token.substr(lead)});
  }
  return tokens;
}

}  // namespace mouthpiece::english_text
