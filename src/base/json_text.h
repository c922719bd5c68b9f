#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

namespace mouthpiece {

// What each source would else make anew out of the library's templates; bytes from outside are read by json_fields.h.

/// JSON of `value`, `indent` spaces a level or (-1) on one line. What is no UTF-8 in its strings becomes U+FFFD.
std::string jsonText(const nlohmann::json& value, int indent = -1);
std::string jsonText(const nlohmann::ordered_json& value, int indent = -1);
std::string cborBytes(const nlohmann::json& value);

/// The value that `text` holds; is_discarded() where that is no JSON.
nlohmann::json looseJson(std::string_view text);
/// The same, keys in the text's order.
nlohmann::ordered_json looseOrderedJson(std::string_view text);

}  // namespace mouthpiece
