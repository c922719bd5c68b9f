#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace mouthpiece {

/// Marks joined to their letters where Unicode has such a letter ("u" + U+0308 -> "ü"), and apart; by ICU. Broken UTF-8
/// becomes U+FFFD.
std::string toNfc(std::string_view text);
std::string toNfd(std::string_view text);

/// Letters of any script in lower case ("Über" is "über").
std::string toLower(std::string_view text);

/// A letter, a mark on one, or a digit, of any script.
bool isWordSign(char32_t code_point);
/// A mark that joins the letter before it: an accent, a vowel sign, points.
bool isJoiningMark(char32_t code_point);

/// The letters and digits of a text alone, their case and marks taken off: "Élan's" is "elans". Empty: it has none.
std::string bareLetters(std::string_view text);

/// Text as a file's name: its ASCII letters (in small, without their accents) and digits, a hyphen for all that stands
/// between, at most `longest` characters. Empty when it has none of them.
std::string slugOf(std::string_view text, std::size_t longest);

/// Letters of the Latin script as ASCII has them (ICU's Latin-ASCII: "Für" is "Fur", "ß" is "ss", typographic
/// apostrophes are plain ones); other text as it is.
std::string toAscii(std::string_view text);

/// Chinese characters as Pinyin with tone marks, a word a character (ICU's Han-Latin); other text as it is.
std::string toPinyin(std::string_view text);

}  // namespace mouthpiece
