#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace mouthpiece {

/// The number that all of `text` spells, blanks around it and a leading + allowed; "nan" and "inf" are numbers too.
/// nullopt for anything else. Independent of the locale.
std::optional<double> parseNumber(std::string_view text);

/// `text` without blanks (space, tab, carriage return) at its ends.
std::string_view trimmed(std::string_view text);
/// What is left of `text` without brackets and what stands in them, trimmed. `pairs`: which, opening and closing ones
/// in turn, as "<>{}". A bracket that does not close stays.
std::string withoutBracketed(std::string_view text, std::string_view pairs);

/// Appends `value`, finite, with exactly `decimals` digits behind the point (at most 9), halves away from zero; never
/// "-0". Many times faster than a stream.
void appendFixed(std::string& text, double value, int decimals);

/// Gives the lines of `text` one by one, without their ends (\n, \r\n); counts from 1. A byte order mark is skipped.
class LineReader {
 public:
  explicit LineReader(std::string_view text);
  /// False at the end.
  bool next(std::string_view& line);
  [[nodiscard]] std::size_t lineNumber() const { return line_number_; }

 private:
  std::string_view rest_;
  std::size_t line_number_ = 0;
};

/// The fields between `separator`s; an empty text has one empty field. `fields` is reused.
void splitFields(std::string_view text, char separator, std::vector<std::string_view>& fields);

}  // namespace mouthpiece
