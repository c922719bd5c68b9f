#pragma once

#include <string_view>

#include "phonetics/language/language.h"

namespace mouthpiece {

/// How kana of either kind is said, as it is written: は is "ha". No phones where it has other signs.
Pronunciation pronounceKana(std::string_view kana);

}  // namespace mouthpiece
