#include <cstddef>
#include <cstdint>
#include <string_view>

#include "base/errors.h"
#include "singing/song.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    mouthpiece::parseUst({reinterpret_cast<const char*>(data), size}, "fuzz.ust");
  } catch (const mouthpiece::InputError&) {
  }
  return 0;
}
