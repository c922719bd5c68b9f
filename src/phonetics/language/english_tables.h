#pragma once

#include <array>
#include <span>
#include <string_view>

namespace mouthpiece::english_text {

struct Unit {
  std::string_view sign, one, many;
  bool stands_apart = true;  ///< may have a blank before it; false where it is a word or a letter of its own
};
std::span<const Unit> units();

struct Currency {
  std::string_view sign, one, many, cent, cents;  ///< no cents: ""
};
std::span<const Currency> currencies();

/// What an abbreviation needs beside it.
enum class AbbreviationPlace {
  kAnywhere,
  kBeforeName,    ///< a capital after it
  kBeforeNumber,  ///< a digit after it
  kNearNumber,    ///< a digit before it or after it
  kAfterName      ///< a capital before it
};

struct Abbreviation {
  std::string_view written;  ///< with its point
  std::string_view said;
  AbbreviationPlace place = AbbreviationPlace::kAnywhere;
};
/// In any place, longer ones before those that they begin with.
std::span<const Abbreviation> abbreviations();

struct Emoji {
  char32_t sign;
  std::string_view name;  ///< the short name of Unicode's CLDR
};
std::span<const Emoji> emojis();

/// Cries and sounds that voices spell letter by letter, by their letters in lower case with every row of one letter
/// made one ("hmmm": "hm"), and a word that sounds so; "" for another.
std::string_view wordOfCry(std::string_view plain);
/// A word that people stretch and whose long form would be said otherwise ("nooo"), by the same letters.
bool isStretched(std::string_view plain);

/// Full name of a month by its first three letters, "" for another; by its number from 1.
std::string_view monthOf(std::string_view name);
std::string_view monthOf(int number);

/// Capitals said as one word: NASA.
bool isAcronym(std::string_view capitals);
/// Capitals with a vowel that are said letter by letter though there are four or more.
bool isInitialism(std::string_view capitals);
/// Two or three capitals that are a word said loud: NOT.
bool isLoudWord(std::string_view capitals);
/// "Henry": a Roman number after it is an ordinal.
bool isRulerName(std::string_view name);
/// "Chapter": a Roman number after it is a number, one letter alone too.
bool isNumberedThing(std::string_view name);
/// Of Internet addresses: "com". Nothing that ends English words before a capital.
bool isTopDomain(std::string_view name);

}  // namespace mouthpiece::english_text
