#include <cstddef>
#include <cstdint>
#include <string_view>

#include "base/errors.h"
#include "singing/song.h"

/// Songs as JSON and as subtitles.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  for (const auto parse : {mouthpiece::parseSongJson, mouthpiece::parseSubtitleSong}) {
    try {
      MOUTHPIECE_EXPECT(!parse(bytes, "fuzz").words.empty());
    } catch (const mouthpiece::InputError&) {
    }
  }
  return 0;
}
