#include <cstddef>
#include <cstdint>
#include <string_view>

#include "base/errors.h"
#include "motion/marker_layout.h"
#include "retarget/placing/anchors.h"

/// Marker layouts and anchors, both JSON that people write. What is accepted says the same again when written and read.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  try {
    const mouthpiece::MarkerLayout layout = mouthpiece::parseLayout(text, "fuzz.json");
    for (const mouthpiece::LayoutMarker& marker : layout.markers)
      MOUTHPIECE_EXPECT(layout.markers.at(layout.markers.at(marker.mirror.value).mirror.value).name == marker.name);
    const std::string json = mouthpiece::layoutToJson(layout);
    MOUTHPIECE_EXPECT(mouthpiece::layoutToJson(mouthpiece::parseLayout(json, "again.json")) == json);
  } catch (const mouthpiece::InputError&) {
  }
  try {
    mouthpiece::parseAnchors(text, "fuzz.json");
  } catch (const mouthpiece::InputError&) {
  }
  return 0;
}
