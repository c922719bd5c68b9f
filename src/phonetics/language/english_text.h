#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>

namespace mouthpiece::english_text {

/// `text` with its numbers, dates, times, amounts, units, abbreviations, acronyms, addresses and emoji as the words
/// that are said for them, American usage (docs/theory/phonetics/text.md); other words stay as they are. `is_known`:
/// what not to touch; may be empty. No digit is left but in what is known. Any bytes are taken.
std::string inWords(std::string_view text, const std::function<bool(std::string_view)>& is_known);

// What it is made of.

/// The beginning of a token and the words for it.
struct Said {
  /// What may follow it in the next token.
  enum class Kind { kOther, kNumber, kWholeNumber, kFraction, kMoney, kTime };

  std::string words;
  std::size_t size = 0;  ///< bytes of the token
  Kind kind = Kind::kOther;
  bool is_one = false;  ///< "1": of a unit there is one
  std::string bare{};   ///< a number as a count of something, money without its unit
  std::string unit{};   ///< of money, of many
};

/// A date, time of day, telephone number, version, ordinal, decade, fraction, amount of money or of a unit, or number
/// that `token` begins with; a range of two too. nullopt where it begins with none.
std::optional<Said> sayNumbers(std::string_view token);

struct UnitSaid {
  std::string words;
  std::size_t size = 0;
};
/// The unit that `token` begins with; nullopt for none. `is_apart`: a blank is before it.
std::optional<UnitSaid> sayUnit(std::string_view token, bool is_one, bool is_apart);

/// The unit of money that `token` begins with: "USD".
std::optional<UnitSaid> sayCurrency(std::string_view token, bool is_one);

/// a.m. and p.m. in their spellings.
std::optional<UnitSaid> sayHalfOfDay(std::string_view token);

/// A number whose reading is the year's where it can be one.
std::string sayPlainNumber(std::string_view digits);

bool isDigit(char c);
bool isLetter(char c);
bool isCapital(char c);
/// Whether nothing but punctuation is left.
bool isPunctuation(std::string_view rest);
std::size_t countDigits(std::string_view text);

}  // namespace mouthpiece::english_text
