#pragma once

#include <functional>
#include <string>
#include <string_view>

namespace mouthpiece::english_text {

/// `text` with its numbers, dates, times, amounts, units, abbreviations, acronyms, addresses and emoji as the words
/// that are said for them, American usage (docs/theory/phonetics/text.md); other words stay as they are. `is_known`:
/// what not to touch; may be empty. No digit is left but in what is known. Any bytes are taken.
std::string inWords(std::string_view text, const std::function<bool(std::string_view)>& is_known);

}  // namespace mouthpiece::english_text
