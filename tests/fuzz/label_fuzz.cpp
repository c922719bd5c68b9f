#include <cstddef>
#include <cstdint>
#include <string_view>

#include "base/errors.h"
#include "phonetics/labels/label_files.h"
#include "phonetics/text/lexicon.h"

/// Label files and pronunciation lexicons share their alphabet: one input serves both readers.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  try {
    mouthpiece::expectConsistent(mouthpiece::parseLabFile(bytes, "fuzz.lab"));
  } catch (const mouthpiece::InputError&) {
  }
  try {
    mouthpiece::Lexicon::parse(bytes, "fuzz.txt");
  } catch (const mouthpiece::InputError&) {
  }
  return 0;
}
