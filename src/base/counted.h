#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace mouthpiece {

/// "1 line", "2 lines": of a noun whose plural has an s.
inline std::string counted(std::size_t count, std::string_view noun) {
  return (std::to_string(count) + " ").append(noun) + (count == 1 ? "" : "s");
}

}  // namespace mouthpiece
