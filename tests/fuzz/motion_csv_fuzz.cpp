// Any text, read as CSV and as TRC, ends in a clip or an InputError; a clip that was read can be written and read
// again.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "base/errors.h"
#include "motion/formats/motion_csv.h"

namespace {

using namespace mouthpiece;

template <typename Read, typename Write>
void readAndWrite(std::string_view text, Read read, Write write) {
  MotionClip clip;
  try {
    clip = read(text);
  } catch (const InputError&) {
    return;
  }
  try {
    const MotionClip again = read(write(clip));
    if (again.frameCount() != clip.frameCount() || again.marker_names != clip.marker_names) std::abort();
  } catch (const InputError&) {
    // Frame times closer than the microsecond that we write.
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  readAndWrite(
      text, [](std::string_view t) { return readMotionCsvText(t, "fuzz.csv"); }, writeMotionCsvText);
  readAndWrite(
      text, [](std::string_view t) { return readTrcText(t, "fuzz.trc"); },
      [](const MotionClip& clip) { return writeTrcText(clip, "fuzz.trc"); });
  return 0;
}
