#pragma once

#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "phonetics/language/english_text.h"

// Numbers as they are written, and the rules of sayNumbers() by what they read; each gives nullopt for a token that
// does not begin so.
namespace mouthpiece::english_text {

/// With single blanks between those that are not empty.
std::string joined(std::initializer_list<std::string_view> words);

/// Whether the sign that a match ends before can follow it.
bool endsHere(std::string_view rest);

/// Of the first four digits.
int smallValue(std::string_view digits);

/// "1,200.50": digits without their commas, and those behind the point.
struct WrittenAmount {
  std::string whole, fraction;
  std::size_t size = 0;
  bool has_commas = false;

  [[nodiscard]] bool isOne() const { return whole == "1" && fraction.empty(); }
  [[nodiscard]] bool isWhole() const { return fraction.empty(); }
  [[nodiscard]] std::string words() const;
};
std::optional<WrittenAmount> readAmount(std::string_view token);

/// Groups of digits with one of `signs` between them, the same everywhere.
struct DigitGroups {
  std::vector<std::string_view> digits;
  char sign = 0;
  std::size_t size = 0;
};
DigitGroups readGroups(std::string_view token, std::string_view signs);

/// "05" -> "oh five".
std::string minutesWords(std::string_view minutes);

// english_dates.cpp
std::optional<Said> sayDate(std::string_view token);
std::optional<Said> sayTime(std::string_view token);
std::optional<Said> sayDecade(std::string_view token);

// english_codes.cpp: what is named by its digits.
std::optional<Said> sayTelephone(std::string_view token);
std::optional<Said> sayVersion(std::string_view token);
std::optional<Said> sayAeroplane(std::string_view token);
std::optional<Said> sayPictureLines(std::string_view token);
/// 0x1F, 00:1A:2B
std::optional<Said> sayHexadecimal(std::string_view token);
/// 48°51'24"N
std::optional<Said> sayCoordinate(std::string_view token);

}  // namespace mouthpiece::english_text
