// Any bytes as a page's packed line: what is read is made again and gives finite weights and markers, or an InputError.
// The seed is what unit_page_engine packs.
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "base/errors.h"
#include "page_engine/line_package.h"
#include "page_engine/page_engine.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace mouthpiece;
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  try {
    const LinePackage line = parseLinePackage(bytes, "fuzz");
    MOUTHPIECE_EXPECT(faultOf(line.request.labels).empty());
    constexpr double kMostFrames = 1000;
    const Seconds lasts = std::max(line.request.labels.duration(), line.request.sound_lasts);
    if (lasts * line.request.options.frame_rate_hz > kMostFrames) return 0;
    PageEngine engine(bytes);
    engine.render("[]");
    MOUTHPIECE_EXPECT(engine.weights().allFinite() && engine.markers().allFinite());
    (void)engine.vertices(engine.frameCount() - 1);
  } catch (const InputError&) {
  }
  return 0;
}
