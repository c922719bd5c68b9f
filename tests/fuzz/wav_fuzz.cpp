#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "audio/audio_clip.h"
#include "base/errors.h"

/// libsndfile 1.2 loses a few kilobytes when a damaged Vorbis stream fails to open (findings/wav): theirs to mend.
extern "C" const char* __lsan_default_suppressions() { return "leak:libvorbis\nleak:libsndfile\n"; }

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr double kLongest = 600;
  try {
    const auto clip = mouthpiece::parseAudio({reinterpret_cast<const char*>(data), size}, "fuzz.wav",
                                             {.most = kLongest, .own_rate_until = size % 2 == 0 ? 0.01 : kLongest});
    MOUTHPIECE_EXPECT(clip.sample_rate_hz > 0 && !clip.samples.empty() && clip.duration() <= kLongest);
    for (const float sample : clip.samples) MOUTHPIECE_EXPECT(std::abs(sample) <= 1);
  } catch (const mouthpiece::InputError&) {
  }
  return 0;
}
