#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

namespace mouthpiece {

/// Appends `bytes` in base64 (RFC 4648, padded) to `text`; about a nanosecond a byte.
void appendBase64(std::string& text, std::string_view bytes);

/// `json` for the inside of a script element: what is no letter of markup stays, and a string in it cannot end the
/// script.
std::string scriptSafe(std::string_view json);
/// The text of `value` for there, in ASCII; what is no UTF-8 in its strings becomes U+FFFD.
std::string scriptJson(const nlohmann::json& value);
std::string scriptJson(const nlohmann::ordered_json& value);

/// A finished page that only its own scripts may run in and that may load nothing from outside: a
/// Content-Security-Policy with the hash of each `<script>`, after the page's `<meta charset="utf-8">`.
std::string closedPage(std::string_view page);

}  // namespace mouthpiece
