#include "motion/position_limits.h"

#include <fmt/format.h>

#include "base/errors.h"

namespace mouthpiece {

void expectFrameRate(double frame_rate_hz, std::string_view file, std::string_view place) {
  if (frame_rate_hz > 0.0 && frame_rate_hz <= kMaxFrameRateHz) return;
  throw InputError(
      file, place,
      fmt::format("found frame rate {:g} Hz; expected more than 0, at most {:g}", frame_rate_hz, kMaxFrameRateHz));
}

}  // namespace mouthpiece
