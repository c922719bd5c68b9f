#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "phonetics/language/english_text.h"

namespace mouthpiece::english_text {

/// What stands between blanks: opening punctuation and the rest.
struct TextToken {
  std::string_view lead, body;

  /// Without the punctuation after it.
  [[nodiscard]] std::string_view core() const {
    const std::size_t last = body.find_last_not_of(".,;:!?)]}\"'*_~>");
    return last == std::string_view::npos ? std::string_view() : body.substr(0, last + 1);
  }
  [[nodiscard]] bool startsWithDigit() const { return !body.empty() && isDigit(body[0]); }
  [[nodiscard]] bool startsWithCapital() const { return !body.empty() && isCapital(body[0]); }
};

/// What stands between the blanks of `text`, which outlives it.
std::vector<TextToken> tokensOf(std::string_view text);

/// Emoji are named, rows of one once, those that are joined as the first of them, flags by their letters; blanks of
/// every kind are blanks, and signs of one meaning one sign.
std::string named(std::string_view text);

/// I to 3999; 0 for what is no Roman number.
int romanValue(std::string_view word);

}  // namespace mouthpiece::english_text
