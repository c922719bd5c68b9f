#pragma once

#include <cstdint>
#include <vector>

namespace mouthpiece {

/// Rows from the top, three bytes (sRGB) a pixel.
struct Picture {
  std::size_t width = 0, height = 0;
  std::vector<std::uint8_t> rgb;
};

}  // namespace mouthpiece
