#pragma once

#include <string>
#include <string_view>

namespace mouthpiece::english_text {

/// Words for digits, American usage, single blanks between them. Digits are ASCII, at least one; any number of them.

/// "105" -> "one hundred five". More than 18 digits, and those with a zero before others, are said one by one.
std::string cardinal(std::string_view digits);
/// "21" -> "twenty first".
std::string ordinal(std::string_view digits);
/// "007" -> "zero zero seven".
std::string digitByDigit(std::string_view digits);
/// Of a year before 10000: "1905" -> "nineteen oh five", "2000" -> "two thousand", "44" -> "forty four".
std::string year(std::string_view digits);
/// "half", "quarter", "third", "sixteenth"; `many`: "halves", "thirds".
std::string fractionPart(std::string_view digits, bool many);
/// "fifty" -> "fifties", "foot" stays to others: the last word in -s.
std::string plural(std::string words);

}  // namespace mouthpiece::english_text
