#pragma once

#include <string>
#include <string_view>

namespace mouthpiece {

/// `text` with what voices stumble over beside its digits said in words: units ("5 kg", "80 km/h"), dates of digits,
/// fractions, and ranges of these; of German and Dutch years, of German ordinals and times of day, too. Numbers stay
/// digits, which the voices read. `locale`: an IETF tag ("pt-BR"); the words are ICU's (Unicode CLDR), of a language
/// that it does not know English. Broken UTF-8 becomes U+FFFD. docs/theory/phonetics/text.md#other-languages
std::string amountsInWords(std::string_view text, std::string_view locale);

}  // namespace mouthpiece
