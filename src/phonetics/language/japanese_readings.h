#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace mouthpiece {

/// The reading in katakana of a whole number, as it is counted: 634 is ロッピャクサンジューヨン. `digits`: 1 to 12
/// ASCII digits. A number that begins with 0 has none but 0 itself: "".
std::string japaneseNumber(std::string_view digits);

/// A word and its reading in katakana.
struct JapaneseReading {
  std::string word, kana;
  friend bool operator==(const JapaneseReading&, const JapaneseReading&) = default;
};

/// `words` in which full-width digits that follow each other as words of their own are one: a whole number, read as it
/// is counted. Digits beside a point, a comma, a slash, a colon or a hyphen between digits stay what they are, and so
/// do longer numbers.
std::vector<JapaneseReading> withCountedNumbers(const std::vector<JapaneseReading>& words);

/// Hiragana as katakana; other signs as they are.
std::string katakanaOf(std::string_view text);

/// A word of full-width Latin letters in ASCII and lower case, "" for another.
std::string latinWord(std::string_view word);

}  // namespace mouthpiece
