#include <cstddef>
#include <cstdint>
#include <string>

#include "corpus_tools/takes/take_report.h"

/// The reports in a corpus' build log: a corpus made elsewhere may hold anything there.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  mouthpiece::reportsToJson(mouthpiece::reportsFromJson(text));
  return 0;
}
