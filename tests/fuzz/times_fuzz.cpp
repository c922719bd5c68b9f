#include <cstddef>
#include <cstdint>
#include <string_view>

#include "base/errors.h"
#include "hearing/times/times_file.h"

/// What can be read has times that rise.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  mouthpiece::TimesFile times;
  try {
    times = mouthpiece::parseTimes({reinterpret_cast<const char*>(data), size}, "fuzz");
  } catch (const mouthpiece::InputError&) {
    return 0;
  }
  double last = 0;
  for (const auto& word : times.words) {
    MOUTHPIECE_EXPECT(word.span.start >= last && word.span.end > word.span.start);
    last = word.span.end;
  }
  last = 0;
  for (const auto& phone : times.phones) {
    MOUTHPIECE_EXPECT(phone.span.start >= last && phone.span.end > phone.span.start);
    MOUTHPIECE_EXPECT(!phone.word || *phone.word < times.words.size());
    last = phone.span.end;
  }
  return 0;
}
