#pragma once

#include <string>
#include <string_view>

namespace mouthpiece {

/// Appends `bytes` in base64 (RFC 4648, padded) to `text`; about a nanosecond a byte.
void appendBase64(std::string& text, std::string_view bytes);

/// `json` for the inside of a script element: what is no letter of markup stays, and a string in it cannot end the
/// script.
std::string scriptSafe(std::string_view json);

}  // namespace mouthpiece
