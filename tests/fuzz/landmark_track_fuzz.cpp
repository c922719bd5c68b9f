#include <cstddef>
#include <cstdint>
#include <string_view>

#include "base/errors.h"
#include "motion/formats/motion_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  try {
    mouthpiece::parseLandmarkTrack(text, "fuzz.json", mouthpiece::defaultLayout());
  } catch (const mouthpiece::InputError&) {
  }
  return 0;
}
