#include <cstddef>
#include <cstdint>
#include <string_view>

#include "base/errors.h"
#include "synthesis/line_edits.h"
#include "vocal/animation_curve.h"

/// Curves that can be read come back to the bit; edits that can be read can be made.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  try {
    const mouthpiece::CurveSet curves = mouthpiece::parseCurves(bytes, "fuzz.json");
    MOUTHPIECE_EXPECT(mouthpiece::parseCurves(mouthpiece::curvesToJson(curves), "again.json") == curves);
  } catch (const mouthpiece::InputError&) {
  }
  try {
    const mouthpiece::CurveSet curves{{"Ah", {{0, 0, 0, 0}, {1, 1, 0, 0}}}};
    mouthpiece::withEdits(curves, mouthpiece::parseLineEdits(bytes, "fuzz.json").curves);
  } catch (const mouthpiece::InputError&) {
  }
  return 0;
}
