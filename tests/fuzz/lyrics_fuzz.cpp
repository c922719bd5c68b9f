#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "base/errors.h"
#include "hearing/alignment/lyrics.h"
#include "phonetics/text/speakable_text.h"

/// What stands in brackets is left out, line ends stay, and nothing else is made up; the rest can be spoken or is
/// refused.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view lyrics(reinterpret_cast<const char*>(data), size);
  const std::string sung = mouthpiece::sungText(lyrics);
  MOUTHPIECE_EXPECT(sung.size() <= lyrics.size());
  MOUTHPIECE_EXPECT(sung.find('[') == std::string::npos);
  MOUTHPIECE_EXPECT(std::count(sung.begin(), sung.end(), '\n') == std::count(lyrics.begin(), lyrics.end(), '\n'));
  MOUTHPIECE_EXPECT(mouthpiece::sungText(sung) == sung);
  if (lyrics.find('[') == std::string_view::npos) MOUTHPIECE_EXPECT(sung == lyrics);
  try {
    mouthpiece::speakableText(sung);
  } catch (const mouthpiece::InputError&) {
  }
  return 0;
}
