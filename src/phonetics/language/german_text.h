#pragma once

#include <functional>
#include <string>
#include <string_view>

namespace mouthpiece {

/// `text` with the abbreviations that eSpeak NG would spell as the words that are said for them: "z. B.", "z.B." ->
/// "zum Beispiel". `is_known`: which stay as they are; may be empty. Any bytes are taken.
std::string germanInWords(std::string_view text, const std::function<bool(std::string_view)>& is_known);

}  // namespace mouthpiece
