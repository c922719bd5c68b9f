// Text in lines and cells that people write: lists of lines, casts, shares of phone pairs, a style over time and the
// user's defaults. Any bytes end in what their reader promises, or an InputError.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "base/errors.h"
#include "corpus_tools/report/prompts.h"
#include "mouthpiece/speaker.h"
#include "open_bytes.h"
#include "programs/config_file.h"
#include "programs/synth/batch_input.h"
#include "vocal/vocal_style.h"

namespace {

using namespace mouthpiece;

template <typename Read>
void orRefused(const Read& read) {
  try {
    read();
  } catch (const InputError&) {
  }
}

void expectSoundList(const BatchList& list) {
  MOUTHPIECE_EXPECT(!list.lines.empty() || !list.faults.empty());
  for (const BatchLine& line : list.lines) {
    MOUTHPIECE_EXPECT(!line.id.empty() && line.id.find('/') == std::string::npos && line.id.front() != '.');
    MOUTHPIECE_EXPECT(line.others.size() == list.other_columns.size());
  }
}

void expectSoundStyle(const StyleSignal& style, double largest) {
  Seconds last = -1e300;
  for (const StyleSignal::Point& point : style.points) {
    MOUTHPIECE_EXPECT(std::isfinite(point.time) && point.time > last && point.value >= 0 && point.value <= largest);
    last = point.time;
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const OpenBytes file(data, size);
  orRefused([&] { expectSoundList(readBatchList(file.path())); });
  orRefused([&] { readCast(file.path(), {}); });
  orRefused([&] { expectSoundStyle(parseStyleSignal(text, "fuzz.csv", 2), 2); });
  orRefused([&] {
    for (const ConfigEntry& entry : readConfig(file.path())) MOUTHPIECE_EXPECT(!entry.key.empty() && entry.line > 0);
  });
  orRefused([&] {
    const std::string csv = pairSharesToCsv(parsePairShares(text, "fuzz.csv"));
    MOUTHPIECE_EXPECT(pairSharesToCsv(parsePairShares(csv, "again.csv")) == csv);
  });
  return 0;
}
