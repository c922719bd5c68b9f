// Any bytes end in a track of bounded size or an InputError.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "base/errors.h"
#include "exports/arkit.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  try {
    const mouthpiece::ArkitTrack track = mouthpiece::parseLiveLinkCsv(text, "fuzz.csv");
    // A row has at least the 11 letters of its time code.
    if (static_cast<std::size_t>(track.weights.rows()) > 2 * (size / 11) + 600) std::abort();
    if (!(track.weights.array().isNaN() || (track.weights.array() >= 0)).all()) std::abort();
  } catch (const mouthpiece::InputError&) {
  }
  return 0;
}
