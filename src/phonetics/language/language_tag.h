#pragma once

#include <string>
#include <string_view>

namespace mouthpiece {

/// A BCP 47 tag in lower case: of one in any case, and of a locale's name ("de_DE.UTF-8" is "de-de").
std::string plainTag(std::string_view tag);

}  // namespace mouthpiece
