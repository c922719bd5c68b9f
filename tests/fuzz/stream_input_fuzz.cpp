// What comes over standard input while a line is being said: lines of labels, text sentence by sentence, and chunks of
// sound with their places. Any bytes end, within their bounds, in all of the text or an InputError.
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "base/errors.h"
#include "open_bytes.h"
#include "programs/synth/stream_ends.h"
#include "speaker/live_parts.h"

namespace {

/// 400 bytes, and what follows of bytes that would go on a letter of UTF-8, at most what is read at once.
constexpr std::size_t kLongestSentence = 400 + 64 * 1024;
constexpr std::size_t kLongestLine = 64 * 1024;

void readLines(const std::string& file) {
  const std::atomic<bool> is_stopped = false;
  try {
    mouthpiece::InputLines lines(file, is_stopped);
    std::vector<std::string> fields;
    while (const auto line = lines.next()) {
      MOUTHPIECE_EXPECT(line->size() <= kLongestLine && line->find('\n') == std::string::npos);
      if (mouthpiece::splitLabel(*line, fields)) MOUTHPIECE_EXPECT(!fields.empty() && !fields.front().empty());
    }
  } catch (const mouthpiece::InputError&) {
  }
}

void readSentences(const std::string& file) {
  const std::atomic<bool> is_stopped = false;
  try {
    mouthpiece::SentenceReader sentences(file, is_stopped);
    while (const auto sentence = sentences.next()) MOUTHPIECE_EXPECT(sentence->size() <= kLongestSentence);
  } catch (const mouthpiece::InputError&) {
  }
}

/// Twelve bytes a chunk: its place and its length.
void orderChunks(const std::uint8_t* data, std::size_t size) {
  constexpr std::size_t kChunk = 12;
  constexpr int kRateHz = 16000;
  constexpr std::size_t kMostSilence = 10 * kRateHz;
  mouthpiece::ChunkOrder order(kRateHz);
  mouthpiece::LiveCounts counts;
  for (std::size_t first = 0; first + kChunk <= size; first += kChunk) {
    const auto number = [&](std::size_t from, std::size_t count) {
      std::uint64_t value = 0;
      for (std::size_t i = count; i-- > 0;) value = value << 8U | data[first + from + i];
      return value;
    };
    const std::size_t count = number(8, 3);
    try {
      const auto place = order.place(number(0, 8), count, counts);
      MOUTHPIECE_EXPECT(place.skipped <= count && place.silence <= kMostSilence);
    } catch (const mouthpiece::InputError&) {
    }
    if (data[first + kChunk - 1] % 4 == 0) order.passOver(count);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const mouthpiece::OpenBytes bytes(data, size);
  readLines(bytes.path());
  readSentences(bytes.path());
  orderChunks(data, size);
  return 0;
}
