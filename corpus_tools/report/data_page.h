#pragma once

#include <string>
#include <string_view>

namespace mouthpiece {

/// A page by itself: `page` with the style and the tools that our pages of facts share (page_style.css, page_tools.js)
/// and `json` in the places of /*STYLE*/, /*TOOLS*/ and /*REPORT*/null. Whatever strings the JSON holds, they cannot
/// end the script.
std::string dataPage(std::string_view page, std::string_view json);

}  // namespace mouthpiece
