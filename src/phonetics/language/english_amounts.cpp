#include "phonetics/language/english_amounts.h"

#include <algorithm>
#include <span>
#include <vector>

#include "phonetics/language/english_numbers.h"
#include "phonetics/language/english_tables.h"
#include "phonetics/language/phone.h"

namespace mouthpiece::english_text {

using Kind = Said::Kind;

std::string joined(std::initializer_list<std::string_view> words) {
  std::string out;
  for (const std::string_view word : words) {
    if (!out.empty() && !word.empty()) out += ' ';
    out += word;
  }
  return out;
}

bool endsHere(std::string_view rest) { return rest.empty() || !(isDigit(rest[0]) || isLetter(rest[0])); }

int smallValue(std::string_view digits) {
  int value = 0;
  for (const char c : digits.substr(0, 4)) value = 10 * value + (c - '0');
  return value;
}

std::string WrittenAmount::words() const {
  const std::string before = whole.empty() ? "zero" : cardinal(whole);
  return fraction.empty() ? before : joined({whole.empty() ? "" : before, "point", digitByDigit(fraction)});
}

namespace {

/// How long "5,00,000" is, as it is written in India: pairs of digits before the last three, of which one
/// alone tells whole thousands ("5,10,100" is a list); 0 for another number.
std::size_t indianLength(std::string_view token) {
  std::size_t at = countDigits(token);
  if (at == 0 || at > 2) return 0;
  const std::size_t first = at;
  while (token.substr(at).starts_with(',') && countDigits(token.substr(at + 1)) == 2) at += 3;
  const bool has_pairs = at > first + 3, has_one = at > first && token.substr(at).starts_with(",000");
  const bool ends =
      (has_pairs || has_one) && token.substr(at).starts_with(',') && countDigits(token.substr(at + 1)) == 3;
  return ends ? at + 4 : 0;
}

}  // namespace

std::optional<WrittenAmount> readAmount(std::string_view token) {
  WrittenAmount amount;
  const std::size_t first = countDigits(token);
  amount.whole = token.substr(0, first);
  amount.size = first;
  if (const std::size_t indian = indianLength(token); indian > 0) {
    amount.whole = token.substr(0, indian);
    std::erase(amount.whole, ',');
    amount.size = indian;
    amount.has_commas = true;
  }
  while (first >= 1 && first <= 3 && token.substr(amount.size).starts_with(',') &&
         countDigits(token.substr(amount.size + 1)) == 3) {
    amount.whole += token.substr(amount.size + 1, 3);
    amount.size += 4;
    amount.has_commas = true;
  }
  const std::string_view rest = token.substr(amount.size);
  if (const std::size_t behind = rest.starts_with('.') ? countDigits(rest.substr(1)) : 0; behind > 0) {
    amount.fraction = rest.substr(1, behind);
    amount.size += 1 + behind;
  }
  if (amount.size == 0) return std::nullopt;
  return amount;
}

constexpr std::size_t kMostGroups = 16;

DigitGroups readGroups(std::string_view token, std::string_view signs) {
  DigitGroups groups;
  for (std::size_t at = 0;;) {
    const std::size_t count = countDigits(token.substr(at));
    if (count == 0) break;
    groups.digits.push_back(token.substr(at, count));
    at += count;
    groups.size = at;
    if (at >= token.size() || signs.find(token[at]) == std::string_view::npos) break;
    if ((groups.sign != 0 && token[at] != groups.sign) || groups.digits.size() == kMostGroups) break;
    groups.sign = token[at++];
  }
  return groups;
}

std::string minutesWords(std::string_view minutes) {
  return minutes[0] == '0' ? "oh " + cardinal(minutes.substr(1)) : cardinal(minutes);
}

namespace {

/// 3:1
std::optional<Said> sayRatio(std::string_view token) {
  const DigitGroups groups = readGroups(token, ":");
  if (groups.digits.size() != 2 || !endsHere(token.substr(groups.size))) return std::nullopt;
  return Said{joined({cardinal(groups.digits[0]), "to", cardinal(groups.digits[1])}), groups.size};
}

std::optional<Said> sayOrdinal(std::string_view token) {
  const auto amount = readAmount(token);
  if (!amount || !amount->isWhole()) return std::nullopt;
  const std::string_view rest = token.substr(amount->size);
  for (const std::string_view ending : {"st", "nd", "rd", "th"}) {
    if (rest.starts_with(ending) && endsHere(rest.substr(2))) return Said{ordinal(amount->whole), amount->size + 2};
  }
  return std::nullopt;
}

/// The part after a whole number: 2 1/2.
std::optional<Said> sayFraction(std::string_view token) {
  const DigitGroups groups = readGroups(token, "/");
  if (groups.digits.size() != 2) return std::nullopt;
  if (groups.digits[0] == "1" && token.substr(groups.size).starts_with('s') && endsHere(token.substr(groups.size + 1)))
    return Said{joined({"one", fractionPart(groups.digits[1], false), "of a second"}),
                groups.size + 1};  // of a shutter
  if (!endsHere(token.substr(groups.size))) return std::nullopt;
  const std::string_view over = groups.digits[0], under = groups.digits[1];
  const std::string both =
      over == "9" && under == "11" ? "nine eleven" : joined({sayPlainNumber(over), sayPlainNumber(under)});
  if (isWordOf("24/7 50/50 9/11 20/20 365/24", token.substr(0, groups.size)) || over.size() == 4) {
    return Said{both, groups.size};
  }
  const int part = smallValue(under);
  const bool is_usual = under.size() <= 3 && part >= 2 && (part <= 20 || part % 10 == 0 || part == 32 || part == 64) &&
                        over.size() <= 2 && under[0] != '0' && over != "0";
  if (!is_usual && over.size() <= 2 && under.size() == 2) {  // 12/25
    const int first = smallValue(over);
    const bool day_first = first > 12;
    const std::string_view month = monthOf(day_first ? part : first);
    const int day = day_first ? first : part;
    if (!month.empty() && day >= 1 && day <= 31) {
      return Said{joined({month, ordinal(std::to_string(day))}), groups.size};
    }
  }
  const std::string part_words = joined({cardinal(over), fractionPart(under, over != "1")});
  const std::string words = is_usual ? part_words : joined({cardinal(over), "over", cardinal(under)});
  return Said{words, groups.size, Kind::kFraction, false, part_words};
}

/// Thousands, millions: "m", "bn", behind an amount of money.
std::size_t magnitude(std::string_view rest, std::string& words) {
  struct Row {
    std::string_view sign, word;
  };
  constexpr Row kRows[] = {{"bn", "billion"},  {"b", "billion"},  {"B", "billion"},
                           {"mn", "million"},  {"m", "million"},  {"M", "million"},
                           {"tn", "trillion"}, {"k", "thousand"}, {"K", "thousand"}};
  for (const Row& row : kRows) {
    if (!rest.starts_with(row.sign) || !endsHere(rest.substr(row.sign.size()))) continue;
    words = row.word;
    return row.sign.size();
  }
  return 0;
}

std::string moneyWords(const WrittenAmount& amount, const Currency& currency) {
  if (amount.fraction.size() == 2 && !currency.cents.empty()) {
    const std::string cents = std::to_string(smallValue(amount.fraction));
    const std::string small = joined({cardinal(cents), cents == "1" ? currency.cent : currency.cents});
    if (amount.whole.empty() || amount.whole == "0") return small;
    const std::string large = joined({cardinal(amount.whole), amount.whole == "1" ? currency.one : currency.many});
    return cents == "0" ? large : joined({large, "and", small});
  }
  return joined({amount.words(), amount.isOne() ? currency.one : currency.many});
}

std::optional<Said> sayMoney(std::string_view token) {
  for (const Currency& currency : currencies()) {
    if (!token.starts_with(currency.sign)) continue;
    const std::string_view rest = token.substr(currency.sign.size());
    auto amount = readAmount(rest);
    if (!amount) continue;
    std::string many;
    const std::size_t size = magnitude(rest.substr(amount->size), many);
    const std::size_t used = currency.sign.size() + amount->size + size;
    if (size > 0) return Said{joined({amount->words(), many, currency.many}), used};
    if (!endsHere(token.substr(used))) continue;
    return Said{moneyWords(*amount, currency), used, Kind::kMoney, amount->isOne(), amount->words(),
                std::string(currency.many)};
  }
  const auto amount = readAmount(token);
  if (!amount) return std::nullopt;
  for (const Currency& currency : currencies()) {
    const std::string_view rest = token.substr(amount->size);
    if (rest.starts_with(currency.sign) && endsHere(rest.substr(currency.sign.size()))) {
      return Said{moneyWords(*amount, currency), amount->size + currency.sign.size()};
    }
  }
  return std::nullopt;
}

/// 1e9, 10^6
std::optional<Said> sayPower(std::string_view token) {
  const auto amount = readAmount(token);
  if (!amount) return std::nullopt;
  std::string_view rest = token.substr(amount->size);
  const bool is_power = rest.starts_with('^');
  if (!is_power && !rest.starts_with('e') && !rest.starts_with('E')) return std::nullopt;
  const std::size_t sign = rest.size() > 1 && (rest[1] == '-' || rest[1] == '+') ? 1 : 0;
  const std::size_t count = countDigits(rest.substr(1 + sign));
  if (count == 0 || count > 4 || !endsHere(rest.substr(1 + sign + count))) return std::nullopt;
  const std::string power =
      joined({"to the power of", sign == 1 && rest[1] == '-' ? "minus" : "", cardinal(rest.substr(1 + sign, count))});
  return Said{joined({amount->words(), is_power ? "" : "times ten", power}), amount->size + 1 + sign + count};
}

/// 5'11"
std::optional<Said> sayFeet(std::string_view token) {
  const std::size_t feet = countDigits(token);
  if (feet == 0 || feet > 3 || feet >= token.size() || token[feet] != '\'') return std::nullopt;
  const std::string_view rest = token.substr(feet + 1);
  const std::size_t inches = countDigits(rest);
  const std::string_view whole = token.substr(0, feet);
  if (inches == 0) {
    if (!isPunctuation(rest)) return std::nullopt;
    return Said{joined({cardinal(whole), whole == "1" ? "foot" : "feet"}), feet + 1};
  }
  const std::size_t mark = rest.substr(inches).starts_with("''") ? 2 : rest.substr(inches).starts_with('"') ? 1 : 0;
  if (inches > 2 || !endsHere(rest.substr(inches + mark))) return std::nullopt;
  return Said{joined({cardinal(whole), "foot", cardinal(rest.substr(0, inches))}), feet + 1 + inches + mark};
}

struct SmallFraction {
  std::string_view sign, alone, after;
};
constexpr SmallFraction kSmallFractions[] = {
    {"½", "one half", "a half"},   {"¼", "one quarter", "a quarter"}, {"¾", "three quarters", "three quarters"},
    {"⅓", "one third", "a third"}, {"⅔", "two thirds", "two thirds"}, {"⅛", "one eighth", "an eighth"}};

std::optional<Said> saySmallFraction(std::string_view token) {
  const std::size_t count = countDigits(token);
  const std::string_view rest = token.substr(count);
  for (const SmallFraction& fraction : kSmallFractions) {
    if (!rest.starts_with(fraction.sign)) continue;
    const std::size_t size = count + fraction.sign.size();
    const std::string words =
        count == 0 ? std::string(fraction.alone) : joined({cardinal(token.substr(0, count)), "and", fraction.after});
    return Said{words, size, Kind::kNumber, false, words};
  }
  return std::nullopt;
}

std::optional<Said> sayAmount(std::string_view token) {
  const auto amount = readAmount(token);
  if (!amount) return std::nullopt;
  const std::string_view rest = token.substr(amount->size);
  if (const auto unit = sayUnit(rest, amount->isOne(), false)) {
    return Said{joined({amount->words(), unit->words}), amount->size + unit->size};
  }
  if (!endsHere(rest)) return std::nullopt;
  const bool is_whole = amount->isWhole();
  const std::string words = is_whole && !amount->has_commas ? sayPlainNumber(amount->whole) : amount->words();
  return Said{words, amount->size, is_whole ? Kind::kWholeNumber : Kind::kNumber, amount->isOne(), amount->words(), {}};
}

std::optional<Said> sayOne(std::string_view token) {
  using Rule = std::optional<Said> (*)(std::string_view);
  constexpr Rule kRules[] = {sayDate,  sayHexadecimal,   sayCoordinate, sayVersion,      sayTelephone, sayAeroplane,
                             sayTime,  sayRatio,         sayOrdinal,    sayDecade,       sayMoney,     sayFraction,
                             sayPower, saySmallFraction, sayFeet,       sayPictureLines, sayAmount};
  for (const Rule rule : kRules) {
    if (auto said = rule(token)) return said;
  }
  return std::nullopt;
}

/// "$5-10": the unit of the first is said once, after the second.
std::optional<Said> sayMoneyRange(std::string_view token, const Said& first) {
  const auto rest = readAmount(token.substr(first.size + 1));
  if (first.kind != Kind::kMoney || !rest || !rest->isWhole()) return std::nullopt;
  for (const Currency& currency : currencies()) {
    if (!token.starts_with(currency.sign)) continue;
    const auto from = readAmount(token.substr(currency.sign.size()));
    if (!from) continue;
    const auto to = sayMoney(std::string(currency.sign) + std::string(token.substr(first.size + 1)));
    if (!to) return std::nullopt;
    Said range{joined({from->words(), "to", to->words}), first.size + 1 + to->size - currency.sign.size(), to->kind};
    range.bare = joined({from->words(), "to", to->bare});
    range.unit = to->unit;
    return range;
  }
  return std::nullopt;
}

}  // namespace

bool isDigit(char c) { return c >= '0' && c <= '9'; }
bool isCapital(char c) { return c >= 'A' && c <= 'Z'; }
bool isLetter(char c) { return (c >= 'a' && c <= 'z') || isCapital(c); }

bool isPunctuation(std::string_view rest) {
  return rest.find_first_not_of(".,;:!?)]}\"'*_~>") == std::string_view::npos;
}

std::size_t countDigits(std::string_view text) { return std::min(text.find_first_not_of("0123456789"), text.size()); }

std::string sayPlainNumber(std::string_view digits) {
  constexpr std::size_t kLongestCount = 6;  // longer without commas: a number of somebody or something
  if (digits == "007") return "double oh seven";
  if (digits.size() == 4 && (digits[0] == '1' || digits.starts_with("20"))) return year(digits);
  if (digits.size() > kLongestCount && !digits.ends_with("000")) return digitByDigit(digits);
  return cardinal(digits);
}

std::optional<UnitSaid> sayUnit(std::string_view token, bool is_one, bool is_apart) {
  const Unit* best = nullptr;
  for (const Unit& unit : units()) {
    if (is_apart && !unit.stands_apart) continue;
    if (!token.starts_with(unit.sign) || !endsHere(token.substr(unit.sign.size()))) continue;
    const std::string_view rest = token.substr(unit.sign.size());
    const bool goes_on =
        rest.starts_with('-') || (rest.starts_with('/') && countDigits(rest.substr(1)) > 0);  // 72°F/22°C
    if (!isPunctuation(rest.substr(0, 1)) && !goes_on) continue;
    if (best == nullptr || unit.sign.size() > best->sign.size()) best = &unit;
  }
  if (best == nullptr) return std::nullopt;
  return UnitSaid{std::string(is_one ? best->one : best->many), best->sign.size()};
}

std::optional<UnitSaid> sayHalfOfDay(std::string_view token) {
  for (const std::string_view half : {"a.m.", "p.m.", "A.M.", "P.M.", "am", "pm", "AM", "PM"}) {
    if (!token.starts_with(half) || !endsHere(token.substr(half.size()))) continue;
    return UnitSaid{half[0] == 'a' || half[0] == 'A' ? "A M" : "P M", half.size()};
  }
  return std::nullopt;
}

std::optional<UnitSaid> sayCurrency(std::string_view token, bool is_one) {
  for (const Currency& currency : currencies()) {
    if (token.starts_with(currency.sign) && isPunctuation(token.substr(currency.sign.size()))) {
      return UnitSaid{std::string(is_one ? currency.one : currency.many), currency.sign.size()};
    }
  }
  return std::nullopt;
}

std::optional<Said> sayNumbers(std::string_view token) {
  auto said = sayOne(token);
  const bool is_signed = !said && token.size() > 1 && (token[0] == '-' || token[0] == '+');
  if (is_signed) said = sayOne(token.substr(1));
  if (!said) return std::nullopt;
  if (is_signed) {
    const std::string sign = token[0] == '-' ? "minus " : "plus ";
    said->words = sign + said->words;
    said->bare = sign + said->bare;
    ++said->size;
  }
  const std::string_view rest = token.substr(said->size);
  if (rest.size() < 2 || rest[0] != '-') return said;
  if (!is_signed) {
    if (const auto range = sayMoneyRange(token, *said)) return range;
  }
  auto to = sayOne(rest.substr(1));
  if (!to) return said;
  if (said->kind == Kind::kWholeNumber && to->kind == Kind::kTime) said->words = said->bare;
  Said range{joined({said->words, "to", to->words}), said->size + 1 + to->size, to->kind};
  range.bare = joined({said->bare.empty() ? said->words : said->bare, "to", to->bare.empty() ? to->words : to->bare});
  range.unit = to->unit;
  return range;
}

}  // namespace mouthpiece::english_text
