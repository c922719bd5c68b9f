// Dates, times of day and decades.
#include "phonetics/language/english_amounts.h"

#include <algorithm>

#include "phonetics/language/english_numbers.h"
#include "phonetics/language/english_tables.h"

namespace mouthpiece::english_text {
namespace {

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

}  // namespace

std::optional<Said> sayDate(std::string_view token) {
  const DigitGroups groups = readGroups(token, "-/.");
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

std::optional<Said> sayTime(std::string_view token) {
  const DigitGroups groups = readGroups(token, ":");
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
  return Said{joined({words, half}), groups.size + half_size, half_size == 0 ? Said::Kind::kTime : Said::Kind::kOther};
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

}  // namespace mouthpiece::english_text
