#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "phonetics/language/language.h"

namespace mouthpiece {

/// Longer lines are refused: about half an hour of speech.
inline constexpr std::size_t kMaxSpokenCharacters = 20'000;
/// What a recording says may be longer: an hour and a half of quick speech.
inline constexpr std::size_t kMaxTranscriptCharacters = 100'000;

/// `text` (UTF-8, hostile) as a voice of the language can say it. The result holds only ASCII letters, the language's
/// own, digits, single blanks and . , ; : ! ? ' - $ " ( ), every word has a letter or a digit, and at most 40
/// bytes (besides a last character's rest and a pause):
/// - mark-up (<i>, <color=red>) and stage directions in square brackets before which a word has ended are left out;
/// - other accents and ligatures are spelled plainly, curly quotes, dashes and full-width forms become ASCII;
/// - numbers, dates, times, amounts, abbreviations, acronyms, addresses and emoji are words where the language has
///   rules for them (docs/theory/phonetics/text.md), but for words of which `is_known` (may be empty) is true;
/// - signs with a name are said (% & + = @, currencies) or kept where the voices read them; other signs and control
///   characters are blanks.
/// Throws InputError when there is nothing to say, for letters of another script (the first is named), broken UTF-8,
/// and for more than `most` characters.
std::string speakableText(std::string_view text, const Language& language = english(),
                          const std::function<bool(std::string_view)>& is_known = {},
                          std::size_t most = kMaxSpokenCharacters);

/// `text` with a blank in place of each character that speakableText() refuses and that stands alone among others which
/// it does not; these go to `left_out`. As it was where nothing to say would be left, or for broken UTF-8.
std::string withoutLoneCharacters(std::string_view text, const Language& language, std::vector<std::string>& left_out);

/// Cuts the result of speakableText after . ! ? ; : before a blank, and longer stretches at a blank, so that no piece
/// is longer than `max_length` (at least 80). Pieces without a letter or digit are left out.
/// Blanks in place of what is written for others than the speaker: tags ("<b>", "</b>", "<color=red>") and stage
/// directions ("[laughs]"). Text that is no UTF-8 stays as it is.
std::string withoutMarkup(std::string_view text);

std::vector<std::string> splitSentences(std::string_view speakable, std::size_t max_length);

}  // namespace mouthpiece
