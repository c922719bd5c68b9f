// Any bytes end in a clip or an InputError; a clip that was read can be written and read again, and stays the same.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "base/errors.h"
#include "motion/c3d_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace mouthpiece;
  MotionClip clip;
  try {
    clip = readC3dBytes({reinterpret_cast<const char*>(data), size}, "fuzz.c3d");
  } catch (const InputError&) {
    return 0;
  }
  try {
    const std::string once = writeC3dBytes(clip);
    if (writeC3dBytes(readC3dBytes(once, "once.c3d")) != once) std::abort();
  } catch (const InputError&) {
    // Names longer than we write.
  }
  return 0;
}
