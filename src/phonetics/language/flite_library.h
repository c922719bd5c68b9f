#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "phonetics/text/lexicon.h"

namespace mouthpiece {

/// Flite's own pronunciation of a word of letters, from its dictionary or its letter-to-sound rules, with stress; no
/// phones when it has none. Thread-safe.
Pronunciation flitePronunciation(std::string_view word);

/// The words that Flite says for `token` of a line of text: "25" -> "twenty" "five". Thread-safe.
std::vector<std::string> fliteWords(std::string_view token);

}  // namespace mouthpiece
