// Any bytes end in a clip or an InputError; a clip that was read can be written and read again, and stays the same.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>
#include <vector>

#include "base/errors.h"
#include "motion/formats/c3d_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace mouthpiece;
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  MotionClip clip;
  std::vector<MotionEvent> events;
  try {
    clip = readC3dBytes(bytes, "fuzz.c3d");
    events = readC3dEventsBytes(bytes, "fuzz.c3d");
  } catch (const InputError&) {
    return 0;
  }
  try {
    const std::string once = writeC3dBytes(clip, events);
    if (writeC3dBytes(readC3dBytes(once, "once.c3d"), readC3dEventsBytes(once, "once.c3d")) != once) std::abort();
  } catch (const InputError&) {
    // Names longer than we write, events too far away.
  }
  return 0;
}
