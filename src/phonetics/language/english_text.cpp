#include "phonetics/language/english_text.h"

#include <algorithm>
#include <array>
#include <vector>

#include "base/text_encoding.h"
#include "phonetics/language/english_numbers.h"
#include "phonetics/language/english_spelling.h"
#include "phonetics/language/english_tables.h"
#include "phonetics/language/english_tokens.h"
#include "phonetics/language/language.h"

namespace mouthpiece::english_text {
namespace {

using Kind = Said::Kind;

bool hasDigit(std::string_view word) { return std::any_of(word.begin(), word.end(), isDigit); }

class Reader {
 public:
  Reader(std::string_view text, const std::function<bool(std::string_view)>& is_known)
      : is_known_(is_known), is_loud_(isLoud(text)), speller_(is_loud_), text_(named(text)), tokens_(tokensOf(text_)) {}

  std::string read() {
    while (at_ < tokens_.size()) {
      const std::size_t was = at_;
      const TextToken token = tokens_[at_];
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
  /// In capitals "LET US GO" has the pronoun and "US ARMY" has not.
  static bool takesUs(std::string_view before) {
    constexpr std::array<std::string_view, 31> kWords{
        "about", "against", "all",  "among", "around", "ask",   "asked", "behind",  "between", "both", "bring",
        "for",   "gave",    "give", "help",  "join",   "leave", "let",   "lets",    "like",    "meet", "of",
        "sees",  "show",    "take", "tell",  "teach",  "told",  "with",  "without", "makes"};
    return std::find(kWords.begin(), kWords.end(), lowerCase(before)) != kWords.end();
  }

  /// Nothing but capitals, in more than one word: they say nothing about the words.
  static bool isLoud(std::string_view text) {
    if (std::any_of(text.begin(), text.end(), [](char c) { return c >= 'a' && c <= 'z'; })) return false;
    std::size_t words = 0;
    for (const TextToken& token : tokensOf(text))
      words += std::any_of(token.body.begin(), token.body.end(), isLetter) && !hasDigit(token.body);
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

  void countQuotes(const TextToken& token) {
    for (const std::string_view part : {token.lead, token.body}) {
      is_quoted_ ^= std::count(part.begin(), part.end(), '"') % 2 == 1;
    }
  }

  [[nodiscard]] const TextToken* next(std::size_t ahead = 1) const {
    return at_ + ahead < tokens_.size() ? &tokens_[at_ + ahead] : nullptr;
  }
  /// The one before, unless punctuation parts them.
  [[nodiscard]] std::string_view previousWord() const {
    if (at_ == 0 || !tokens_[at_].lead.empty()) return {};
    const TextToken& token = tokens_[at_ - 1];
    return token.core() == token.body || token.body.ends_with('.') ? token.core() : std::string_view();
  }

  std::string readToken(const TextToken& token) {
    const std::string_view core = token.core();
    if (core.empty()) return std::string(token.body);
    if (is_loud_ && core == "US" && takesUs(previousWord())) return std::string(token.body);
    const bool is_odd = hasDigit(core) || (core.size() > 1 && areCapitals(core));
    if (is_odd && is_known_ && is_known_(core)) return std::string(token.body);
    using Rule = std::optional<std::string> (Reader::*)(const TextToken&);
    constexpr Rule kRules[] = {&Reader::readCry,          &Reader::readAddress, &Reader::readStreetOrTitle,
                               &Reader::readAbbreviation, &Reader::readRoman,   &Reader::readTelephone,
                               &Reader::readMoneyApart,   &Reader::readNumber,  &Reader::readSigned,
                               &Reader::readInitials};
    for (const Rule rule : kRules) {
      if (auto words = (this->*rule)(token)) return std::move(*words);
    }
    if (auto words = speller_.capitalsWithin(token.body)) return std::move(*words);
    if (auto words = speller_.mixed(token.body)) return std::move(*words);
    return std::string(token.body);
  }

  /// Hmm, shh, nooo: voices spell or garble them.
  std::optional<std::string> readCry(const TextToken& token) {
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

  std::optional<std::string> readAddress(const TextToken& token) {
    const std::string_view core = token.core();
    auto words = speller_.address(core);
    if (words) *words += token.body.substr(core.size());
    return words;
  }

  // Abbreviations.

  /// Whether `token` begins with a title or another abbreviation, in loud text whatever its case.
  [[nodiscard]] bool begins(const TextToken& token, std::string_view written) const {
    if (token.body.starts_with(written)) return true;
    return is_loud_ && isCapital(written[0]) && token.body.starts_with(capitals(written));
  }

  /// A name may stand there: in loud text any word that is no common one.
  [[nodiscard]] bool mayBeName(const TextToken* token) const {
    return token != nullptr && token->startsWithCapital() && !(is_loud_ && isLoudWord(token->core()));
  }

  /// Dr. and St., before a name or after one.
  std::optional<std::string> readStreetOrTitle(const TextToken& token) {
    const bool is_doctor = begins(token, "Dr"), is_saint = begins(token, "St");
    if (!is_doctor && !is_saint) return std::nullopt;
    const bool has_point = token.body.substr(2).starts_with('.');
    const std::string_view rest = token.body.substr(has_point ? 3 : 2);
    if (!isPunctuation(rest)) return std::nullopt;
    const std::string_view before = previousWord();
    const bool precedes_name = rest.empty() && mayBeName(next());
    // 12 MAIN ST. BOSTON, but TELL DR. SMITH: in loud text all words may be names.
    const bool has_number = hasDigit(before) || (at_ > 1 && hasDigit(tokens_[at_ - 2].body));
    const bool follows_name = !before.empty() && (at_ > 1 || hasDigit(before)) &&
                              (isCapital(before[0]) || isDigit(before[0])) && !isLoudWord(capitals(before)) &&
                              !(is_loud_ && precedes_name && !has_number);
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
    const TextToken* after = next();
    const bool before_digit = rest.empty() ? after != nullptr && (after->startsWithDigit()) : isDigit(rest[0]);
    switch (place) {
      case AbbreviationPlace::kAnywhere:
        return true;
      case AbbreviationPlace::kBeforeName:
        return rest.empty() && mayBeName(after);
      case AbbreviationPlace::kBeforeNumber:
        return before_digit;
      case AbbreviationPlace::kNearNumber:
        return before_digit || rest.starts_with(',') || hasDigit(previousWord());
      case AbbreviationPlace::kAfterName:
        return !previousWord().empty() && isCapital(previousWord()[0]);
    }
    return false;
  }

  std::optional<std::string> readAbbreviation(const TextToken& token) {
    for (const Abbreviation& row : abbreviations()) {
      if (!begins(token, row.written)) continue;
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
  std::optional<std::string> readInitials(const TextToken& token) {
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

  std::optional<std::string> readRoman(const TextToken& token) {
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

  [[nodiscard]] bool isDigitGroup(const TextToken* token) const {
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
  std::optional<std::string> readTelephone(const TextToken& token) {
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
  std::optional<std::string> readMoneyApart(const TextToken& token) {
    const auto unit = sayCurrency(token.body, false);
    if (!unit || unit->size != token.body.size() || next() == nullptr || !next()->startsWithDigit())
      return std::nullopt;
    const std::string_view amount = next()->body;
    const auto said = sayNumbers(std::string(token.body) + std::string(amount));
    if (!said || !isPunctuation(amount.substr(said->size - token.body.size()))) return std::nullopt;
    at_ += 2;
    return said->words + std::string(amount.substr(said->size - token.body.size()));
  }

  std::optional<std::string> readNumber(const TextToken& token) {
    auto said = sayNumbers(token.body);
    if (!said) return std::nullopt;
    std::string_view rest = token.body.substr(said->size);
    if (token.lead.ends_with('~')) said->words = "about " + said->words;
    if (rest.starts_with('/')) {  // $5/hr
      if (const auto unit = sayUnit(rest.substr(1), true, false)) {
        said->words += " per " + unit->words;
        rest.remove_prefix(1 + unit->size);
        if (isPunctuation(rest)) return said->words + std::string(rest);
      }
    }
    // 72°F/22°C
    if (const auto other = rest.starts_with('/') ? sayNumbers(rest.substr(1)) : std::nullopt;
        other && said->kind == Kind::kOther && other->kind == Kind::kOther &&
        isPunctuation(rest.substr(1 + other->size)))
      return said->words + ", " + other->words + std::string(rest.substr(1 + other->size));
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
  std::optional<std::string> readWithNext(const Said& said, const TextToken& after) {
    const auto take = [&](std::string words, std::size_t size) {
      std::string_view rest = after.body.substr(size);
      const TextToken* beyond = next(2);
      const bool goes_on = beyond != nullptr && !beyond->startsWithCapital();
      if (rest.starts_with('.') && goes_on) rest.remove_prefix(1);  // 5 min. later
      at_ += 2;
      return words + std::string(rest);
    };
    const bool is_number = said.kind == Kind::kWholeNumber || said.kind == Kind::kNumber;
    if (said.kind == Kind::kMoney) {
      for (const std::string_view many : {"thousand", "million", "billion", "trillion", "lakh", "crore", "bn", "m"}) {
        if (!after.body.starts_with(many) || !isPunctuation(after.body.substr(many.size()))) continue;
        const std::string_view word = many == "bn" ? "billion" : many == "m" ? "million" : many;
        return take(said.bare + " " + std::string(word) + " " + said.unit, many.size());
      }
    }
    if (said.kind == Kind::kFraction && said.bare.starts_with("one ") && after.core() == "s")  // 1/60 s
      return take(said.bare + " of a second", 1);
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
    if (const TextToken* measured = next(2); measured != nullptr && (after.body == "sq" || after.body == "sq.")) {
      if (const auto unit = sayUnit(measured->body, said.is_one, true);
          unit && isPunctuation(measured->body.substr(unit->size))) {
        at_ += 3;
        return said.bare + " square " + unit->words + std::string(measured->body.substr(unit->size));
      }
    }
    if (const auto unit = sayCurrency(after.body, said.is_one)) return take(said.bare + " " + unit->words, unit->size);
    if (said.kind != Kind::kWholeNumber) return std::nullopt;
    return readWithFractionOrMonth(said, after);
  }

  std::optional<std::string> readWithFractionOrMonth(const Said& said, const TextToken& after) {
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
    if (month.empty() || digits.size() > 2 || countDigits(digits) != digits.size()) return std::nullopt;
    const bool has_article = lowerCase(previousWord()) == "the";
    std::string_view rest = after.body.substr(after.core().size());
    if (rest.starts_with('.') && after.core() != month) rest.remove_prefix(1);
    at_ += 2;
    return (has_article ? "" : "the ") + ordinal(digits) + " of " + std::string(month) + std::string(rest);
  }

  std::optional<std::string> readSigned(const TextToken& token) {
    const std::string_view body = token.body, core = token.core();
    const std::string rest(body.substr(core.size()));
    if (core.size() < 2) return std::nullopt;
    if (core[0] == '#') {
      const auto number = sayNumbers(core.substr(1));
      if (number && number->size + 1 == core.size()) return "number " + number->words + rest;
      return "hashtag " + speller_.pieces(core.substr(1)) + rest;
    }
    if (core[0] == '@') return "at " + speller_.pieces(core.substr(1)) + rest;
    if (core[0] == 'v' && isDigit(core[1])) {
      const auto number = sayNumbers(core.substr(1));
      if (number && number->size + 1 == core.size()) return "version " + number->words + rest;
      const std::string_view stage = number ? core.substr(1 + number->size) : std::string_view();  // -beta
      if (stage.size() > 1 && stage[0] == '-' && isLetter(stage[1]))
        return "version " + number->words + " " + speller_.pieces(stage.substr(1)) + rest;
    }
    return std::nullopt;
  }

  const std::function<bool(std::string_view)>& is_known_;
  bool is_loud_;
  Speller speller_;
  std::string text_;
  std::vector<TextToken> tokens_;
  std::size_t at_ = 0;
  bool is_quoted_ = false;  ///< a double quote is open
  std::string out_;
};

}  // namespace

std::string inWords(std::string_view text, const std::function<bool(std::string_view)>& is_known) {
  return Reader(text, is_known).read();
}

}  // namespace mouthpiece::english_text
