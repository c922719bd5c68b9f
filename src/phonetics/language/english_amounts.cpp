#include "phonetics/language/english_text.h"

#include <algorithm>
#include <span>
#include <vector>

#include "phonetics/language/english_numbers.h"
#include "phonetics/language/english_tables.h"
#include "phonetics/language/phone.h"

namespace mouthpiece::english_text {
namespace {

using Kind = Said::Kind;

std::string joined(std::initializer_list<std::string_view> words) {
  std::string out;
  for (const std::string_view word : words) {
    if (!out.empty() && !word.empty()) out += ' ';
    out += word;
  }
  return out;
}

std::string text(std::string_view view) { return std::string(view); }

/// Whether the sign that a match ends before can follow it.
bool endsHere(std::string_view rest) { return rest.empty() || !(isDigit(rest[0]) || isLetter(rest[0])); }

int smallValue(std::string_view digits) {
  int value = 0;
  for (const char c : digits.substr(0, 4)) value = 10 * value + (c - '0');
  return value;
}

/// "1,200.50": digits without their commas, and those behind the point.
struct Amount {
  std::string whole, fraction;
  std::size_t size = 0;
  bool has_commas = false;

  [[nodiscard]] bool isOne() const { return whole == "1" && fraction.empty(); }
  [[nodiscard]] bool isWhole() const { return fraction.empty(); }
  [[nodiscard]] std::string words() const {
    const std::string before = whole.empty() ? "zero" : cardinal(whole);
    return fraction.empty() ? before : joined({whole.empty() ? "" : before, "point", digitByDigit(fraction)});
  }
};

std::optional<Amount> readAmount(std::string_view token) {
  Amount amount;
  const std::size_t first = countDigits(token);
  amount.whole = token.substr(0, first);
  amount.size = first;
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

/// Groups of digits with one of `signs` between them, the same everywhere.
struct Groups {
  std::vector<std::string_view> digits;
  char sign = 0;
  std::size_t size = 0;
};

constexpr std::size_t kMostGroups = 16;

Groups readGroups(std::string_view token, std::string_view signs) {
  Groups groups;
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

std::optional<Said> sayTime(std::string_view token);

/// The time behind a date, as machines write both: T10:20:30Z.
std::optional<Said> sayTimeOfDate(std::string_view rest) {
  if (!rest.starts_with('T')) return std::nullopt;
  const std::size_t size = std::min(rest.find_first_not_of("0123456789:", 1), rest.size());
  auto time = sayTime(rest.substr(1, size - 1));
  if (!time || time->size + 1 != size) return std::nullopt;
  time->size = size;
  if (rest.substr(size).starts_with('.')) time->size += 1 + countDigits(rest.substr(size + 1));  // of a second
  if (rest.substr(time->size).starts_with('Z')) {
    time->words += " U T C";
    ++time->size;
  }
  return endsHere(rest.substr(time->size)) ? time : std::nullopt;
}

std::optional<Said> sayDate(std::string_view token) {
  const Groups groups = readGroups(token, "-/.");
  if (groups.digits.size() != 3) return std::nullopt;
  const auto time = sayTimeOfDate(token.substr(groups.size));
  if (!time && !endsHere(token.substr(groups.size))) return std::nullopt;
  std::string_view years = groups.digits[0], month = groups.digits[1], day = groups.digits[2];
  if (years.size() != 4) {
    years = groups.digits[2];
    // Month first, as Americans write it, where both can be one; with points day first.
    const bool day_first = groups.sign == '.' || smallValue(groups.digits[0]) > 12;
    month = groups.digits[day_first ? 1 : 0];
    day = groups.digits[day_first ? 0 : 1];
    if (years.size() != 4 && (years.size() != 2 || groups.sign == '.')) return std::nullopt;
  }
  const int number = smallValue(day);
  if (month.size() > 2 || day.size() > 2 || monthOf(smallValue(month)).empty() || number < 1 || number > 31) {
    return std::nullopt;
  }
  const std::string of_year = years.size() == 2 && years[0] == '0' ? "oh " + cardinal(years.substr(1)) : year(years);
  std::string words = joined({monthOf(smallValue(month)), ordinal(std::to_string(number)), of_year});
  if (time) words += ", " + time->words;
  return Said{std::move(words), groups.size + (time ? time->size : 0)};
}

/// The capitals that stand in place of a number's last digits, behind `rest`'s hyphen: 1-800-FLOWERS.
std::string_view lettersToDial(std::span<const std::string_view> digits, std::string_view rest) {
  constexpr std::size_t kFewest = 4, kMost = 8;
  const bool is_free = !digits.empty() && digits.back().size() == 3 && digits.back()[0] == '8' &&
                       (digits.size() == 1 || (digits.size() == 2 && digits[0] == "1"));
  if (!is_free || !rest.starts_with('-')) return {};
  rest.remove_prefix(1);
  const std::size_t letters = std::min(rest.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZ"), rest.size());
  return letters >= kFewest && letters <= kMost && endsHere(rest.substr(letters)) ? rest.substr(0, letters)
                                                                                  : std::string_view();
}

std::optional<Said> sayTelephone(std::string_view token) {
  const bool is_abroad = token.starts_with('+');
  const Groups groups = readGroups(token.substr(is_abroad ? 1 : 0), "-.");
  const auto& digits = groups.digits;
  const bool is_local = digits.size() == 2 && digits[0].size() == 3 && digits[1].size() == 4 && groups.sign == '-';
  const bool is_long =
      digits.size() >= 3 &&
      std::all_of(digits.begin(), digits.end() - 1, [](std::string_view group) { return group.size() <= 4; }) &&
      digits.back().size() >= (groups.sign == '.' ? 4U : 2U);
  // +10 and +1.5 are amounts.
  constexpr std::size_t kFewestAbroad = 7;
  std::size_t count = 0;
  for (const std::string_view group : digits) count += group.size();
  Said said{is_abroad ? "plus" : "", groups.size + (is_abroad ? 1 : 0)};
  for (const std::string_view group : digits) said.words = joined({said.words, digitByDigit(group)});
  const std::string_view rest = token.substr(said.size);
  if (const std::string_view letters = lettersToDial(digits, rest); !letters.empty()) {
    said.words = joined({said.words, letters});
    said.size += 1 + letters.size();
    return said;
  }
  const bool is_number = is_abroad ? count >= kFewestAbroad : is_local || is_long;
  return is_number && endsHere(rest) ? std::optional(std::move(said)) : std::nullopt;
}

/// 2.0.1; four groups are an address.
std::optional<Said> sayVersion(std::string_view token) {
  const Groups groups = readGroups(token, ".");
  if (groups.digits.size() < 3 || !endsHere(token.substr(groups.size))) return std::nullopt;
  const bool is_address = groups.digits.size() == 4;
  Said said{"", groups.size};
  for (const std::string_view group : groups.digits) {
    if (!said.words.empty()) said.words += is_address ? " dot" : " point";
    said.words = joined({said.words, is_address ? digitByDigit(group) : cardinal(group)});
  }
  return said;
}

std::string minutesWords(std::string_view minutes) {
  return minutes[0] == '0' ? "oh " + cardinal(minutes.substr(1)) : cardinal(minutes);
}

std::optional<Said> sayTime(std::string_view token) {
  const Groups groups = readGroups(token, ":");
  const auto& digits = groups.digits;
  const UnitSaid before_noon = sayHalfOfDay(token.substr(groups.size)).value_or(UnitSaid());
  const std::string& half = before_noon.words;
  const std::size_t half_size = before_noon.size;
  if (digits.empty() || digits.size() > 3 || digits[0].size() > 2 || smallValue(digits[0]) > 24) return std::nullopt;
  if (digits.size() == 1) {
    if (half_size == 0 || smallValue(digits[0]) > 12) return std::nullopt;
    return Said{joined({cardinal(std::to_string(smallValue(digits[0]))), half}), groups.size + half_size};
  }
  if (half_size == 0 && !endsHere(token.substr(groups.size))) return std::nullopt;
  if (!std::all_of(digits.begin() + 1, digits.end(), [](auto part) { return part.size() == 2 && part[0] < '6'; })) {
    return std::nullopt;
  }
  const int hour = smallValue(digits[0]);
  std::string words = cardinal(std::to_string(hour));
  if (digits[1] != "00") {
    words = joined({words, minutesWords(digits[1])});
  } else if (half_size == 0) {
    words = joined({words, hour == 0 || hour > 12 ? "hundred" : "o'clock"});
  }
  if (digits.size() == 3) {
    const std::string seconds = std::to_string(smallValue(digits[2]));
    words = joined({words, "and", cardinal(seconds), seconds == "1" ? "second" : "seconds"});
  }
  return Said{joined({words, half}), groups.size + half_size, half_size == 0 ? Kind::kTime : Kind::kOther};
}

/// 3:1
std::optional<Said> sayRatio(std::string_view token) {
  const Groups groups = readGroups(token, ":");
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

/// 1990s, '90s, 80s.
std::optional<Said> sayDecade(std::string_view token) {
  const std::size_t quote = token.starts_with('\'') ? 1 : 0;
  const std::size_t count = countDigits(token.substr(quote));
  const std::string_view digits = token.substr(quote, count);
  std::string_view rest = token.substr(quote + count);
  if (quote == 1 && count == 2 && endsHere(rest)) return Said{minutesWords(digits), 3};  // '99
  const std::size_t ending = rest.starts_with("'s") ? 2 : rest.starts_with('s') ? 1 : 0;
  if ((count != 2 && count != 4) || digits.back() != '0' || digits[0] == '0' || ending == 0 ||
      !endsHere(rest.substr(ending))) {
    return std::nullopt;
  }
  return Said{plural(year(digits)), quote + count + ending};
}

/// The part after a whole number: 2 1/2.
std::optional<Said> sayFraction(std::string_view token) {
  const Groups groups = readGroups(token, "/");
  if (groups.digits.size() != 2 || !endsHere(token.substr(groups.size))) return std::nullopt;
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
  if (!is_usual) return Said{joined({cardinal(over), "over", cardinal(under)}), groups.size};
  return Said{joined({cardinal(over), fractionPart(under, over != "1")}), groups.size};
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

std::string moneyWords(const Amount& amount, const Currency& currency) {
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
    return Said{
        moneyWords(*amount, currency), used, Kind::kMoney, amount->isOne(), amount->words(), text(currency.many)};
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
        count == 0 ? text(fraction.alone) : joined({cardinal(token.substr(0, count)), "and", fraction.after});
    return Said{words, size, Kind::kNumber, false, words};
  }
  return std::nullopt;
}

/// 747, 1080: in two halves.
std::string inHalves(std::string_view digits) {
  if (digits.size() == 4) return year(digits);
  if (digits.ends_with("00")) return cardinal(digits);
  return joined({cardinal(digits.substr(0, 1)), minutesWords(digits.substr(1))});
}

/// 747-400, 737-800: a type of aeroplane, no range or score.
std::optional<Said> sayAeroplane(std::string_view token) {
  const Groups groups = readGroups(token, "-");
  const auto& digits = groups.digits;
  if (digits.size() != 2 || digits[0].size() != 3 || digits[1].size() != 3 || !endsHere(token.substr(groups.size)))
    return std::nullopt;
  if (digits[0][0] != '7' || digits[0][2] != '7' || digits[1][0] == '0' || !digits[1].ends_with("00"))
    return std::nullopt;
  return Said{joined({inHalves(digits[0]), inHalves(digits[1])}), groups.size};
}

/// Lines of a picture: 1080p, 480i.
std::optional<Said> sayPictureLines(std::string_view token) {
  const std::size_t count = countDigits(token);
  if (!isWordOf("240 360 480 576 720 1080 1440 2160 4320", token.substr(0, count)) || count == 0) return std::nullopt;
  const std::string_view rest = token.substr(count);
  if ((!rest.starts_with('p') && !rest.starts_with('i')) || !endsHere(rest.substr(1))) return std::nullopt;
  return Said{joined({inHalves(token.substr(0, count)), rest[0] == 'p' ? "P" : "I"}), count + 1};
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
  constexpr Rule kRules[] = {sayDate,  sayVersion,       sayTelephone, sayAeroplane,    sayTime,
                             sayRatio, sayOrdinal,       sayDecade,    sayMoney,        sayFraction,
                             sayPower, saySmallFraction, sayFeet,      sayPictureLines, sayAmount};
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
    const auto to = sayMoney(std::string(currency.sign) + text(token.substr(first.size + 1)));
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
    if (!isPunctuation(token.substr(unit.sign.size()).substr(0, 1)) && token[unit.sign.size()] != '-') continue;
    if (best == nullptr || unit.sign.size() > best->sign.size()) best = &unit;
  }
  if (best == nullptr) return std::nullopt;
  return UnitSaid{text(is_one ? best->one : best->many), best->sign.size()};
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
      return UnitSaid{text(is_one ? currency.one : currency.many), currency.sign.size()};
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
