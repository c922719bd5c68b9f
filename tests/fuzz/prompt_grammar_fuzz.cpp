#include <cstddef>
#include <cstdint>
#include <string_view>

#include "base/errors.h"
#include "corpus_tools/report/prompts.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  try {
    mouthpiece::sentencesOfGrammar(text, "fuzz.grammar");
  } catch (const mouthpiece::InputError&) {
  }
  return 0;
}
