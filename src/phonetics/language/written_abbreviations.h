#pragma once

#include <functional>
#include <string>
#include <string_view>

namespace mouthpiece {

/// `text` with the abbreviations of its language said, which eSpeak NG spells ("z. B.": zum Beispiel, "m.in.": między
/// innymi), blanks within them or none; a language without a table keeps its text. `locale`: an IETF tag ("pt-BR");
/// `is_known` says of a word that it stays as it is, and may be empty. docs/theory/phonetics/text.md#other-languages
std::string abbreviationsInWords(std::string_view text, std::string_view locale,
                                 const std::function<bool(std::string_view)>& is_known);

}  // namespace mouthpiece
