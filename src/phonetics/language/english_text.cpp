#include "phonetics/language/english_text.h"

#include <algorithm>
#include <vector>

#include "base/text_encoding.h"
#include "phonetics/language/english_numbers.h"
#include "phonetics/language/english_tables.h"
#include "phonetics/language/language.h"

namespace mouthpiece::english_text {
namespace {

using Kind = Said::Kind;

bool areCapitals(std::string_view word) { return std::all_of(word.begin(), word.end(), isCapital); }
bool areLetters(std::string_view word) { return std::all_of(word.begin(), word.end(), isLetter); }
bool hasDigit(std::string_view word) { return std::any_of(word.begin(), word.end(), isDigit); }
char capital(char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c; }

std::string capitals(std::string_view word) {
  std::string out(word);
  std::transform(out.begin(), out.end(), out.begin(), capital);
  return out;
}

/// "FBI" -> "F B I". A last A has a point before it, "U S.A": standing alone before a word it would be the article.
std::string letterByLetter(std::string_view word) {
  std::string out;
  for (const char c : word) {
    if (!out.empty()) out += ' ';
    out += capital(c);
  }
  if (out.ends_with(" A")) out[out.size() - 2] = '.';
  return out;
}

bool hasVowel(std::string_view word) { return word.find_first_of("aeiouyAEIOUY") != std::string_view::npos; }

/// I to 3999; 0 for what is no Roman number.
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

/// Emoji are named, rows of one once; blanks of every kind are blanks.
std::string named(std::string_view text) {
  std::string out;
  char32_t last = 0;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t begin = at;
    const auto sign = decodeUtf8(text, at);
    if (!sign) {
      at = begin + 1;
      continue;
    }
    const auto emoji =
        std::find_if(emojis().begin(), emojis().end(), [&](const Emoji& candidate) { return candidate.sign == *sign; });
    if (emoji != emojis().end()) {
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

/// What stands between blanks: opening punctuation and the rest.
struct Token {
  std::string_view lead, body;

  /// Without the punctuation after it.
  [[nodiscard]] std::string_view core() const {
    const std::size_t last = body.find_last_not_of(".,;:!?)]}\"'*_~>");
    return last == std::string_view::npos ? std::string_view() : body.substr(0, last + 1);
  }
  [[nodiscard]] bool startsWithDigit() const { return !body.empty() && isDigit(body[0]); }
  [[nodiscard]] bool startsWithCapital() const { return !body.empty() && isCapital(body[0]); }
};

std::vector<Token> tokensOf(std::string_view text) {
  std::vector<Token> tokens;
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

class Reader {
 public:
  Reader(std::string_view text, const std::function<bool(std::string_view)>& is_known)
      : is_known_(is_known), is_loud_(isLoud(text)), text_(named(text)), tokens_(tokensOf(text_)) {}

  std::string read() {
    while (at_ < tokens_.size()) {
      const std::size_t was = at_;
      const Token token = tokens_[at_];
      std::string words = readToken(token);
      if (at_ == was) ++at_;
      if (!out_.empty()) out_ += ' ';
      out_ += token.lead;
      out_ += words;
      for (std::size_t i = was; i < at_; ++i) countQuotes(tokens_[i]);
    }
    return is_loud_ ? loud(out_) : std::move(out_);
  }

 private:
  /// Nothing but capitals, in more than one word: they say nothing about the words.
  static bool isLoud(std::string_view text) {
    if (std::any_of(text.begin(), text.end(), [](char c) { return c >= 'a' && c <= 'z'; })) return false;
    std::size_t words = 0;
    for (const Token& token : tokensOf(text)) words += std::any_of(token.body.begin(), token.body.end(), isLetter);
    return words > 1;
  }

  /// In capitals, signs too, so that it is read alike again.
  static std::string loud(std::string_view words) {
    std::string out;
    for (std::size_t at = 0; at < words.size();) {
      const std::size_t begin = at;
      const auto c = decodeUtf8(words, at);
      const auto& signs = english().text.signs;
      const auto sign = std::find_if(signs.begin(), signs.end(), [&](const SpelledSign& s) { return s.sign == c; });
      out += capitals(sign == signs.end() ? words.substr(begin, at - begin) : sign->spelled);
    }
    return out;
  }

  void countQuotes(const Token& token) {
    for (const std::string_view part : {token.lead, token.body}) {
      is_quoted_ ^= std::count(part.begin(), part.end(), '"') % 2 == 1;
    }
  }

  [[nodiscard]] const Token* next(std::size_t ahead = 1) const {
    return at_ + ahead < tokens_.size() ? &tokens_[at_ + ahead] : nullptr;
  }
  /// The one before, unless punctuation parts them.
  [[nodiscard]] std::string_view previousWord() const {
    if (at_ == 0 || !tokens_[at_].lead.empty()) return {};
    const Token& token = tokens_[at_ - 1];
    return token.core() == token.body || token.body.ends_with('.') ? token.core() : std::string_view();
  }

  std::string readToken(const Token& token) {
    const std::string_view core = token.core();
    if (core.empty()) return std::string(token.body);
    const bool is_odd = hasDigit(core) || (core.size() > 1 && areCapitals(core));
    if (is_odd && is_known_ && is_known_(core)) return std::string(token.body);
    using Rule = std::optional<std::string> (Reader::*)(const Token&);
    constexpr Rule kRules[] = {&Reader::readCry,          &Reader::readAddress,  &Reader::readStreetOrTitle,
                               &Reader::readAbbreviation, &Reader::readRoman,    &Reader::readTelephone,
                               &Reader::readMoneyApart,   &Reader::readNumber,   &Reader::readSigned,
                               &Reader::readInitials,     &Reader::readCapitals, &Reader::readMixed};
    for (const Rule rule : kRules) {
      if (auto words = (this->*rule)(token)) return std::move(*words);
    }
    return std::string(token.body);
  }

  /// Hmm, shh, nooo: voices spell or garble them.
  std::optional<std::string> readCry(const Token& token) {
    const std::string_view core = token.core();
    const std::string letters = lowerCase(core);
    std::string plain;
    std::size_t row = 0, longest = 0;
    for (const char c : letters) {
      if (!isLetter(c) && c != '-') return std::nullopt;
      row = !plain.empty() && plain.back() == c ? row + 1 : 1;
      longest = std::max(longest, row);
      if (row == 1) plain += c;
    }
    // "5 mm" is a length, PST a time zone, "br" and "m" are abbreviations.
    const bool is_short = longest == 1 && (plain.size() < 3 && plain != "hm");
    const bool is_capital = core.size() > 1 && areCapitals(core) && longest == 1;
    if (is_short || is_capital || hasDigit(previousWord()) || (plain == "sh" && !letters.ends_with("hh")))
      return std::nullopt;
    const std::string_view word = wordOfCry(plain);
    const bool is_long = longest >= 3 || (letters.ends_with("hh") && letters.size() > plain.size());
    const std::string said = !word.empty() ? std::string(word) : is_long && isStretched(plain) ? plain : std::string();
    if (said.empty() || (is_known_ && is_known_(core))) return std::nullopt;
    return (isCapital(core[0]) ? capitals(said.substr(0, 1)) + said.substr(1) : said) +
           std::string(token.body.substr(core.size()));
  }

  // Addresses.

  static bool isDomain(std::string_view core) {
    core = core.substr(0, core.find_first_of("/?#:"));
    const std::size_t point = core.rfind('.');
    if (point == std::string_view::npos || point == 0 || core.find("..") != std::string_view::npos) return false;
    const auto fits = [](char c) { return isLetter(c) || isDigit(c) || c == '-' || c == '.'; };
    return isTopDomain(core.substr(point + 1)) && std::all_of(core.begin(), core.end(), fits);
  }

  static bool isMail(std::string_view core) {
    const std::size_t at = core.find('@');
    const auto fits = [](char c) { return isLetter(c) || isDigit(c) || std::string_view("@-._+%").find(c) < 6; };
    return at != std::string_view::npos && at > 0 && core.find('.', at + 2) != std::string_view::npos &&
           std::all_of(core.begin(), core.end(), fits);
  }

  std::optional<std::string> readAddress(const Token& token) {
    std::string_view core = token.core();
    const std::string_view rest = token.body.substr(core.size());
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
    return words + std::string(rest);
  }

  static std::string addressSign(std::string_view sign) {
    struct Row {
      std::string_view sign, name;
    };
    constexpr Row kRows[] = {
        {".", "dot"},     {"/", "slash"}, {"-", "dash"}, {"_", "underscore"}, {"?", "question mark"},
        {"=", "equals"},  {"&", "and"},   {"#", "hash"}, {"~", "tilde"},      {":", "colon"},
        {"%", "percent"}, {"+", "plus"},  {"@", "at"}};
    for (const Row& row : kRows) {
      if (row.sign == sign) return std::string(row.name);
    }
    return std::string(sign);
  }

  /// Of letters, of digits, or one sign.
  static std::size_t runLength(std::string_view text) {
    const auto kind = [](char c) {
      return isDigit(c) ? 1 : isLetter(c) ? 2 : static_cast<unsigned char>(c) >= 0x80 ? 3 : 0;
    };
    std::size_t length = 1;
    while (kind(text[0]) != 0 && length < text.size() && kind(text[length]) == kind(text[0])) ++length;
    return length;
  }

  // Abbreviations.

  /// Dr. and St., before a name or after one.
  std::optional<std::string> readStreetOrTitle(const Token& token) {
    const bool is_doctor = token.body.starts_with("Dr"), is_saint = token.body.starts_with("St");
    if (!is_doctor && !is_saint) return std::nullopt;
    const bool has_point = token.body.substr(2).starts_with('.');
    const std::string_view rest = token.body.substr(has_point ? 3 : 2);
    if (!isPunctuation(rest)) return std::nullopt;
    const std::string_view before = previousWord();
    const bool follows_name = !before.empty() && (at_ > 1 || hasDigit(before)) &&
                              (isCapital(before[0]) || isDigit(before[0])) && !isLoudWord(capitals(before));
    const bool precedes_name = rest.empty() && next() != nullptr && next()->startsWithCapital();
    if (!follows_name && precedes_name) return is_doctor ? "Doctor" : "Saint";
    if (!has_point && !follows_name) return std::nullopt;
    return std::string(is_doctor ? "Drive" : "Street") + endOfSentence(rest);
  }

  /// The point of an abbreviation ends the text's last sentence too.
  [[nodiscard]] std::string endOfSentence(std::string_view rest, bool before_capitals = false) const {
    const bool ends = next() == nullptr || (before_capitals && next()->startsWithCapital());
    return rest.empty() && ends ? "." : std::string(rest);
  }

  [[nodiscard]] bool fits(AbbreviationPlace place, std::string_view rest) const {
    const Token* after = next();
    const bool before_digit = rest.empty() ? after != nullptr && (after->startsWithDigit()) : isDigit(rest[0]);
    switch (place) {
      case AbbreviationPlace::kAnywhere:
        return true;
      case AbbreviationPlace::kBeforeName:
        return rest.empty() && after != nullptr && after->startsWithCapital();
      case AbbreviationPlace::kBeforeNumber:
        return before_digit;
      case AbbreviationPlace::kNearNumber:
        return before_digit || rest.starts_with(',') || hasDigit(previousWord());
      case AbbreviationPlace::kAfterName:
        return !previousWord().empty() && isCapital(previousWord()[0]);
    }
    return false;
  }

  std::optional<std::string> readAbbreviation(const Token& token) {
    for (const Abbreviation& row : abbreviations()) {
      if (!token.body.starts_with(row.written)) continue;
      const std::string_view rest = token.body.substr(row.written.size());
      const bool holds_number = row.place == AbbreviationPlace::kBeforeNumber && !rest.empty() && isDigit(rest[0]);
      if ((!isPunctuation(rest) && !holds_number) || !fits(row.place, rest)) continue;
      if (holds_number) {
        const auto number = sayNumbers(rest);
        if (!number || !isPunctuation(rest.substr(number->size))) continue;
        return std::string(row.said) + " " + number->words + std::string(rest.substr(number->size));
      }
      if (!row.written.ends_with('.')) return std::string(row.said) + std::string(rest);
      return std::string(row.said) + endOfSentence(rest, row.said == "et cetera");
    }
    return std::nullopt;
  }

  /// U.S., p.m., J.R.R.
  std::optional<std::string> readInitials(const Token& token) {
    std::string letters;
    std::size_t size = 0, points = 0;
    for (std::string_view rest = token.body; !rest.empty() && isLetter(rest[0]); rest = token.body.substr(size)) {
      letters += rest[0];
      ++size;
      if (rest.substr(1).starts_with('.')) {
        ++size;
        ++points;
      } else {
        break;
      }
    }
    const std::string_view rest = token.body.substr(size);
    if (letters.size() < 2 || !(points > 1 || areCapitals(letters))) return std::nullopt;
    if (!isPunctuation(rest) && rest != "'s") return std::nullopt;
    return letterByLetter(letters) + (points == letters.size() ? endOfSentence(rest) : std::string(rest));
  }

  // Roman numbers.

  std::optional<std::string> readRoman(const Token& token) {
    const std::size_t length = std::min(token.body.find_first_not_of("IVXLCDM"), token.body.size());
    const std::string_view number = token.body.substr(0, length), rest = token.body.substr(length);
    constexpr std::size_t kLongest = 15;
    if (length == 0 || length > kLongest || (!isPunctuation(rest) && !rest.starts_with("'s"))) return std::nullopt;
    const int value = romanValue(number);
    if (value == 0 || (length == 1 && std::string_view("IVX").find(number[0]) > 2)) return std::nullopt;
    const std::string digits = std::to_string(value);
    const std::string_view before = previousWord();
    const bool is_name = !before.empty() && isCapital(before[0]);
    const bool is_first = number == "I";
    if (next() != nullptr && rest.empty() && !is_first &&
        (next()->body.starts_with("century") || next()->body.starts_with("centuries"))) {
      return ordinal(digits);
    }
    if (is_name && isNumberedThing(before)) return cardinal(digits) + std::string(rest);
    if (is_name && isRulerName(before)) {
      const bool ends = next() == nullptr || !rest.empty() || next()->body == "of";
      if (is_first && !ends) return std::nullopt;
      return "the " + ordinal(digits) + std::string(rest);
    }
    const bool is_small = number.find_first_not_of("IVX") == std::string_view::npos && length > 1;
    const bool is_titled = is_name && before.size() > 1 && !areCapitals(before) && !isLoudWord(capitals(before));
    if (is_small && (is_titled || length > 3)) return cardinal(digits) + std::string(rest);
    return std::nullopt;
  }

  // Numbers.

  [[nodiscard]] bool isDigitGroup(const Token* token) const {
    if (token == nullptr) return false;
    const std::string_view core = token->core();
    return countDigits(core) >= 2 && core.find_first_not_of("0123456789-.") == std::string_view::npos;
  }

  static std::string eachDigit(std::string_view text) {
    std::string words;
    for (const char c : text) {
      if (isDigit(c)) words += (words.empty() ? "" : " ") + digitByDigit({&c, 1});
    }
    return words;
  }

  /// +1 (555) 123-4567, 020 7946 0958: groups apart.
  std::optional<std::string> readTelephone(const Token& token) {
    const std::string_view core = token.core();
    const bool is_abroad = core.starts_with('+') && core.size() > 1 && core.size() <= 4 && isDigit(core[1]);
    const bool in_brackets = token.lead.ends_with('(') && countDigits(core) == core.size() && core.size() >= 3 &&
                             token.body.substr(core.size()) == ")";
    const bool starts_zero = core.starts_with('0') && core.size() >= 3 && countDigits(core) == core.size() &&
                             core.size() == token.body.size();
    if (!(is_abroad || in_brackets || starts_zero) || !isDigitGroup(next())) return std::nullopt;
    if (in_brackets && next()->core().size() < 3) return std::nullopt;
    std::string words = (is_abroad ? "plus " : "") + eachDigit(core) + std::string(token.body.substr(core.size()));
    bool goes_on = token.body.size() == core.size() || in_brackets;
    for (++at_; goes_on && at_ < tokens_.size() && isDigitGroup(&tokens_[at_]); ++at_) {
      const std::string_view group = tokens_[at_].core();
      words +=
          " " + std::string(tokens_[at_].lead) + eachDigit(group) + std::string(tokens_[at_].body.substr(group.size()));
      goes_on = tokens_[at_].body.size() == group.size() || tokens_[at_].body.ends_with(')');
    }
    return words;
  }

  /// EUR 20
  std::optional<std::string> readMoneyApart(const Token& token) {
    const auto unit = sayCurrency(token.body, false);
    if (!unit || unit->size != token.body.size() || next() == nullptr || !next()->startsWithDigit())
      return std::nullopt;
    const std::string_view amount = next()->body;
    const auto said = sayNumbers(std::string(token.body) + std::string(amount));
    if (!said || !isPunctuation(amount.substr(said->size - token.body.size()))) return std::nullopt;
    at_ += 2;
    return said->words + std::string(amount.substr(said->size - token.body.size()));
  }

  std::optional<std::string> readNumber(const Token& token) {
    const auto said = sayNumbers(token.body);
    if (!said) return std::nullopt;
    const std::string_view rest = token.body.substr(said->size);
    if (rest.starts_with("'s") && isPunctuation(rest.substr(2))) {
      const bool is_year = said->words != said->bare;  // 2015's summer, 10's
      return (is_year ? said->words + "'s" : plural(said->words)) + std::string(rest.substr(2));
    }
    const bool is_number = said->kind == Kind::kWholeNumber || said->kind == Kind::kNumber;
    if (rest.starts_with('"') && isPunctuation(rest) && is_number && !is_quoted_ &&
        token.lead.find('"') == std::string_view::npos) {
      return said->bare + (said->is_one ? " inch" : " inches") + std::string(rest.substr(1));
    }
    if (!isPunctuation(rest)) return std::nullopt;
    if (rest.empty() && next() != nullptr && next()->lead.empty()) {
      if (auto with_next = readWithNext(*said, *next())) return with_next;
    }
    const bool is_day = said->kind == Kind::kWholeNumber && countDigits(token.body) <= 2 && said->bare != "zero";
    if (is_day && !monthOf(previousWord()).empty() && countDigits(token.body) == token.core().size()) {
      return ordinal(token.core()) + std::string(rest);
    }
    return said->words + std::string(rest);
  }

  /// What is said for a number and the token after it, which is used up.
  std::optional<std::string> readWithNext(const Said& said, const Token& after) {
    const auto take = [&](std::string words, std::size_t size) {
      std::string_view rest = after.body.substr(size);
      const Token* beyond = next(2);
      const bool goes_on = beyond != nullptr && !beyond->startsWithCapital();
      if (rest.starts_with('.') && goes_on) rest.remove_prefix(1);  // 5 min. later
      at_ += 2;
      return words + std::string(rest);
    };
    const bool is_number = said.kind == Kind::kWholeNumber || said.kind == Kind::kNumber;
    if (said.kind == Kind::kMoney) {
      for (const std::string_view many : {"thousand", "million", "billion", "trillion", "bn", "m"}) {
        if (!after.body.starts_with(many) || !isPunctuation(after.body.substr(many.size()))) continue;
        const std::string_view word = many == "bn" ? "billion" : many == "m" ? "million" : many;
        return take(said.bare + " " + std::string(word) + " " + said.unit, many.size());
      }
    }
    if (said.kind == Kind::kTime || said.kind == Kind::kWholeNumber) {
      if (const auto half = sayHalfOfDay(after.body); half && isPunctuation(after.body.substr(half->size))) {
        std::string time = said.kind == Kind::kTime ? said.words : said.bare;
        if (const std::size_t clock = time.rfind(" o'clock"); clock != std::string::npos) time.resize(clock);
        const bool ends = after.body[half->size - 1] == '.' && next(2) == nullptr;
        return take(time + " " + half->words + (ends ? "." : ""), half->size);
      }
    }
    if (!is_number) return std::nullopt;
    if (const auto unit = sayUnit(after.body, said.is_one, true);
        unit && isPunctuation(after.body.substr(unit->size))) {
      return take(said.bare + " " + unit->words, unit->size);
    }
    if (const auto unit = sayCurrency(after.body, said.is_one)) return take(said.bare + " " + unit->words, unit->size);
    if (said.kind != Kind::kWholeNumber) return std::nullopt;
    return readWithFractionOrMonth(said, after);
  }

  std::optional<std::string> readWithFractionOrMonth(const Said& said, const Token& after) {
    if (after.body.find('/') == 1 || after.body.find('/') == 2) {
      const auto part = sayNumbers(after.body);
      if (part && isPunctuation(after.body.substr(part->size)) && !part->words.starts_with("twenty")) {
        const bool is_one = part->words.starts_with("one ");
        const std::string_view some = std::string_view(part->words).substr(is_one ? 4 : 0);
        const std::string words =
            said.bare + " and " + (is_one ? some == "eighth" ? "an " : "a " : "") + std::string(some);
        const std::string result = words + std::string(after.body.substr(part->size));
        at_ += 2;
        return result;
      }
    }
    const std::string_view month = monthOf(after.core());
    const std::string_view digits = tokens_[at_].core();
    if (month.empty() || digits.size() > 2) return std::nullopt;
    const bool has_article = lowerCase(previousWord()) == "the";
    std::string_view rest = after.body.substr(after.core().size());
    if (rest.starts_with('.') && after.core() != month) rest.remove_prefix(1);
    at_ += 2;
    return (has_article ? "" : "the ") + ordinal(digits) + " of " + std::string(month) + std::string(rest);
  }

  // Signs, capitals, and what has letters and digits in it.

  std::optional<std::string> readSigned(const Token& token) {
    const std::string_view body = token.body, core = token.core();
    const std::string rest(body.substr(core.size()));
    if (core.size() < 2) return std::nullopt;
    if (core[0] == '#') {
      const auto number = sayNumbers(core.substr(1));
      if (number && number->size + 1 == core.size()) return "number " + number->words + rest;
      return "hashtag " + pieces(core.substr(1)) + rest;
    }
    if (core[0] == '@') return "at " + pieces(core.substr(1)) + rest;
    if (core[0] == 'v' && isDigit(core[1])) {
      const auto number = sayNumbers(core.substr(1));
      if (number && number->size + 1 == core.size()) return "version " + number->words + rest;
    }
    return std::nullopt;
  }

  /// "ThrowbackThursday_2" -> "Throwback Thursday two".
  std::string pieces(std::string_view name) const {
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

  /// Capitals as letters, where they are; else as it stands.
  [[nodiscard]] std::string capitalsIn(std::string_view part) const { return spelt(part).value_or(std::string(part)); }

  [[nodiscard]] std::optional<std::string> spelt(std::string_view part) const {
    constexpr std::size_t kLongestInitialism = 6;
    const bool has_many = part.size() > 2 && part.ends_with('s') && areCapitals(part.substr(0, part.size() - 1));
    const std::string_view letters = has_many ? part.substr(0, part.size() - 1) : part;
    if (letters.size() < 2 || letters.size() > kLongestInitialism || !areCapitals(letters)) return std::nullopt;
    if (isAcronym(letters) || (isLoudWord(letters) && !has_many)) return std::nullopt;
    const bool is_short = letters.size() <= 3 && !is_loud_;
    if (!isInitialism(letters) && hasVowel(letters) && !is_short) return std::nullopt;
    return letterByLetter(letters) + (has_many ? "'s" : "");
  }

  /// Letters beside digits or in an address.
  [[nodiscard]] std::string lettersIn(std::string_view run) const {
    constexpr std::size_t kLongestSpelt = 5;
    if (run.size() == 1 || (!hasVowel(run) && run.size() <= kLongestSpelt)) return letterByLetter(run);
    return capitalsIn(run);
  }

  /// Letters and the apostrophes within them, but for that of "'s".
  static std::size_t wordLength(std::string_view text) {
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

  std::optional<std::string> readCapitals(const Token& token) {
    if (hasDigit(token.body)) return std::nullopt;
    const bool is_joined = token.body.find('&') != std::string_view::npos;  // AT&T
    std::string words;
    bool is_changed = false;
    for (std::size_t i = 0; i < token.body.size();) {
      const std::size_t length = wordLength(token.body.substr(i));
      const std::string_view part = token.body.substr(i, std::max<std::size_t>(length, 1));
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

  std::optional<std::string> readMixed(const Token& token) {
    const std::string_view body = token.body;
    if (!hasDigit(body)) return std::nullopt;
    std::string words;
    const auto addWord = [&](std::string_view word) {
      const bool touches = !words.empty() && (isLetter(words.back()) || words.ends_with("'s"));
      words += touches ? " " + std::string(word) : std::string(word);
    };
    for (std::size_t i = 0; i < body.size();) {
      const char before = i == 0 ? ' ' : body[i - 1];
      const bool is_free = !isLetter(before) && !isDigit(before);
      const bool starts = isDigit(body[i]) || (is_free && before != '.' && std::string_view("$-.").find(body[i]) < 3) ||
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
      } else if (isLetter(run[0])) {
        const bool is_between = isDigit(before) && i < body.size() && isDigit(body[i]);
        addWord(run == "x" && is_between ? "by" : lettersIn(run));
      } else {
        words += run == "-" || run == "^" ? " " : std::string(run);
      }
    }
    return words;
  }

  const std::function<bool(std::string_view)>& is_known_;
  bool is_loud_;
  std::string text_;
  std::vector<Token> tokens_;
  std::size_t at_ = 0;
  bool is_quoted_ = false;  ///< a double quote is open
  std::string out_;
};

}  // namespace

std::string inWords(std::string_view text, const std::function<bool(std::string_view)>& is_known) {
  return Reader(text, is_known).read();
}

}  // namespace mouthpiece::english_text
