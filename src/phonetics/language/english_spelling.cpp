#include "phonetics/language/english_spelling.h"

#include <algorithm>

#include "phonetics/language/english_numbers.h"
#include "phonetics/language/english_tables.h"
#include "phonetics/language/english_text.h"

namespace mouthpiece::english_text {
namespace {

bool areLetters(std::string_view word) { return std::all_of(word.begin(), word.end(), isLetter); }
char capital(char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c; }
bool hasVowel(std::string_view word) { return word.find_first_of("aeiouyAEIOUY") != std::string_view::npos; }

bool isDomain(std::string_view core) {
  core = core.substr(0, core.find_first_of("/?#:"));
  const std::size_t point = core.rfind('.');
  if (point == std::string_view::npos || point == 0 || core.find("..") != std::string_view::npos) return false;
  const auto fits = [](char c) { return isLetter(c) || isDigit(c) || c == '-' || c == '.'; };
  return isTopDomain(core.substr(point + 1)) && std::all_of(core.begin(), core.end(), fits);
}

bool isMail(std::string_view core) {
  const std::size_t at = core.find('@');
  const auto fits = [](char c) { return isLetter(c) || isDigit(c) || std::string_view("@-._+%").find(c) < 6; };
  return at != std::string_view::npos && at > 0 && core.find('.', at + 2) != std::string_view::npos &&
         std::all_of(core.begin(), core.end(), fits);
}

std::string addressSign(std::string_view sign) {
  struct Row {
    std::string_view sign, name;
  };
  constexpr Row kRows[] = {{".", "dot"},     {"/", "slash"}, {"-", "dash"}, {"_", "underscore"}, {"?", "question mark"},
                           {"=", "equals"},  {"&", "and"},   {"#", "hash"}, {"~", "tilde"},      {":", "colon"},
                           {"%", "percent"}, {"+", "plus"},  {"@", "at"}};
  for (const Row& row : kRows) {
    if (row.sign == sign) return std::string(row.name);
  }
  return std::string(sign);
}

/// Of letters, of digits, or one sign.
std::size_t runLength(std::string_view text) {
  const auto kind = [](char c) {
    return isDigit(c) ? 1 : isLetter(c) ? 2 : static_cast<unsigned char>(c) >= 0x80 ? 3 : 0;
  };
  std::size_t length = 1;
  while (kind(text[0]) != 0 && length < text.size() && kind(text[length]) == kind(text[0])) ++length;
  return length;
}

/// Letters and the apostrophes within them, but for that of "'s".
std::size_t wordLength(std::string_view text) {
  std::size_t length = 0;
  while (length < text.size()) {
    const std::string_view rest = text.substr(length);
    const bool joins = rest[0] == '\'' && rest.size() > 1 && isLetter(rest[1]) && length > 0 &&
                       !(capital(rest[1]) == 'S' && (rest.size() == 2 || !isLetter(rest[2])));
    if (!isLetter(rest[0]) && !joins) break;
    ++length;
  }
  return length;
}

}  // namespace

bool areCapitals(std::string_view word) { return std::all_of(word.begin(), word.end(), isCapital); }

std::string capitals(std::string_view word) {
  std::string out(word);
  std::transform(out.begin(), out.end(), out.begin(), capital);
  return out;
}

std::string letterByLetter(std::string_view word) {
  std::string out;
  for (const char c : word) {
    if (!out.empty()) out += ' ';
    out += capital(c);
  }
  if (out.ends_with(" A")) out[out.size() - 2] = '.';
  return out;
}

std::optional<std::string> Speller::spelt(std::string_view part) const {
  constexpr std::size_t kLongestInitialism = 6;
  const bool has_many = part.size() > 2 && part.ends_with('s') && areCapitals(part.substr(0, part.size() - 1));
  const std::string_view letters = has_many ? part.substr(0, part.size() - 1) : part;
  if (letters.size() < 2 || letters.size() > kLongestInitialism || !areCapitals(letters)) return std::nullopt;
  if (isAcronym(letters) || (isLoudWord(letters) && !has_many)) return std::nullopt;
  const bool is_short = letters.size() <= 3 && !is_loud_;
  if (!isInitialism(letters) && hasVowel(letters) && !is_short) return std::nullopt;
  return letterByLetter(letters) + (has_many ? "'s" : "");
}

std::string Speller::capitalsIn(std::string_view part) const { return spelt(part).value_or(std::string(part)); }

std::string Speller::lettersIn(std::string_view run) const {
  constexpr std::size_t kLongestSpelt = 5;
  if (run.size() == 1 || (!hasVowel(run) && run.size() <= kLongestSpelt)) return letterByLetter(run);
  return capitalsIn(run);
}

std::optional<std::string> Speller::address(std::string_view core) const {
  const std::size_t scheme = core.find("://");
  const bool has_scheme = scheme != std::string_view::npos && scheme > 0 && areLetters(core.substr(0, scheme));
  if (!has_scheme && !core.starts_with("www.") && !isMail(core) && !isDomain(core)) return std::nullopt;
  if (has_scheme) core.remove_prefix(scheme + 3);
  while (core.ends_with('/')) core.remove_suffix(1);
  std::string words;
  for (std::size_t i = 0; i < core.size();) {
    if (!words.empty()) words += ' ';
    const std::size_t length = runLength(core.substr(i));
    const std::string_view run = core.substr(i, length);
    const bool is_domain_letters = length == 2 && i > 0 && core[i - 1] == '.' && run != "co" && areLetters(run);
    if (isDigit(run[0])) {
      words += sayPlainNumber(run);
    } else if (isLetter(run[0])) {
      words += is_domain_letters ? letterByLetter(run) : lettersIn(run);
    } else {
      words += addressSign(run);
    }
    i += length;
  }
  return words;
}

std::string Speller::pieces(std::string_view name) const {
  std::string words;
  for (std::size_t i = 0; i < name.size();) {
    std::size_t length = 1;
    const auto goesOn = [&](char before, char after) {
      return isLetter(before) && isLetter(after) && !(isCapital(after) && !isCapital(before));
    };
    while (i + length < name.size() && ((isDigit(name[i + length]) && isDigit(name[i + length - 1])) ||
                                        goesOn(name[i + length - 1], name[i + length]))) {
      ++length;
    }
    const std::string_view piece = name.substr(i, length);
    i += length;
    const bool is_sign = !isLetter(piece[0]) && !isDigit(piece[0]);
    if (is_sign && static_cast<unsigned char>(piece[0]) < 0x80 && piece[0] != '&') {
      words += ' ';
      continue;
    }
    if (!words.empty() && words.back() != ' ' && !is_sign) words += ' ';
    words += is_sign ? std::string(piece) : isDigit(piece[0]) ? sayPlainNumber(piece) : capitalsIn(piece);
  }
  return words;
}

std::optional<std::string> Speller::capitalsWithin(std::string_view body) const {
  if (std::any_of(body.begin(), body.end(), isDigit)) return std::nullopt;
  const bool is_joined = body.find('&') != std::string_view::npos;  // AT&T
  std::string words;
  bool is_changed = false;
  for (std::size_t i = 0; i < body.size();) {
    const std::size_t length = wordLength(body.substr(i));
    const std::string_view part = body.substr(i, std::max<std::size_t>(length, 1));
    i += part.size();
    const bool is_letters = is_joined && part.size() > 1 && part.size() <= 3 && areCapitals(part);
    const auto letters = is_letters ? std::optional(letterByLetter(part)) : spelt(part);
    is_changed |= letters.has_value();
    words += letters.value_or(std::string(part));
  }
  if (!is_changed) return std::nullopt;
  std::replace(words.begin(), words.end(), '-', ' ');
  return words;
}

std::optional<std::string> Speller::mixed(std::string_view body) const {
  if (!std::any_of(body.begin(), body.end(), isDigit)) return std::nullopt;
  std::string words;
  const auto addWord = [&](std::string_view word) {
    const bool touches = !words.empty() && (isLetter(words.back()) || words.ends_with("'s"));
    words += touches ? " " + std::string(word) : std::string(word);
  };
  for (std::size_t i = 0; i < body.size();) {
    const char before = i == 0 ? ' ' : body[i - 1];
    const bool is_free = !isLetter(before) && !isDigit(before);
    // "3s" are three seconds, but not in "MP3s".
    const bool starts = (isDigit(body[i]) && !isLetter(before)) ||
                        (is_free && before != '.' && std::string_view("$-.").find(body[i]) < 3) ||
                        (is_free && static_cast<unsigned char>(body[i]) >= 0xC0);
    const auto number = starts ? sayNumbers(body.substr(i)) : std::nullopt;
    const std::size_t length = runLength(body.substr(i));
    const std::string_view run = body.substr(i, length);
    if (number) {
      addWord(number->words);
      i += number->size;
      continue;
    }
    i += length;
    if (isDigit(run[0])) {
      const std::size_t decimals = i < body.size() && body[i] == '.' ? countDigits(body.substr(i + 1)) : 0;
      addWord(decimals > 0 ? cardinal(run) + " point " + digitByDigit(body.substr(i + 1, decimals))
                           : sayPlainNumber(run));
      if (decimals > 0) i += 1 + decimals;
      const std::string_view rest = body.substr(i);
      if (isLetter(before) && rest.starts_with('s') && (rest.size() == 1 || !(isLetter(rest[1]) || isDigit(rest[1])))) {
        words = plural(std::move(words));
        ++i;
      }
    } else if (isLetter(run[0])) {
      const bool is_between = isDigit(before) && i < body.size() && isDigit(body[i]);
      addWord(run == "x" && is_between ? "by" : lettersIn(run));
    } else {
      words += run == "-" || run == "^" ? " " : std::string(run);
    }
  }
  return words;
}

}  // namespace mouthpiece::english_text
