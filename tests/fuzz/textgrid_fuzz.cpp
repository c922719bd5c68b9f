#include <cstddef>
#include <cstdint>
#include <string_view>

#include "base/errors.h"
#include "phonetics/labels/textgrid.h"

/// What can be read must be consistent, and must read back the same after it was written.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  mouthpiece::SpeechLabels labels;
  try {
    labels = mouthpiece::parseTextGrid({reinterpret_cast<const char*>(data), size}, "fuzz.TextGrid");
  } catch (const mouthpiece::InputError&) {
    return 0;
  }
  mouthpiece::expectConsistent(labels);
  const auto again = mouthpiece::parseTextGrid(mouthpiece::formatTextGrid(labels), "again.TextGrid");
  MOUTHPIECE_EXPECT(again.phones.size() == labels.phones.size());
  return 0;
}
