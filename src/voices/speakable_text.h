#pragma once

#include <string>
#include <string_view>

namespace mouthpiece {

/// Longer lines are refused: about half an hour of speech.
inline constexpr std::size_t kMaxSpokenCharacters = 20000;

/// `text` (UTF-8, hostile) as an English voice can say it. The result holds only ASCII letters, digits, single blanks
/// and . , ; : ! ? ' - $ " ( ), with at least one letter or digit, and no word longer than 40 characters:
/// - accents and ligatures are spelled plainly, curly quotes, dashes and full-width forms become ASCII;
/// - signs with a name are said (% & + = @, currencies), other signs and control characters are blanks.
/// Throws InputError when there is nothing to say, for letters that are not Latin (the first is named), broken UTF-8,
/// and for more than kMaxSpokenCharacters.
std::string speakableText(std::string_view text);

}  // namespace mouthpiece
