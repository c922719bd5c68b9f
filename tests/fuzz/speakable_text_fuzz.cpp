#include <cstddef>
#include <cstdint>
#include <string_view>

#include "base/errors.h"
#include "phonetics/text/speakable_text.h"
#include "voices/festival_script.h"

/// Nothing but the promised characters leaves the normaliser, whatever comes in; the Scheme program does not depend on
/// it.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr std::string_view kAllowed = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789 .,;:!?'-$\"()";
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  try {
    const std::string text = mouthpiece::speakableText(bytes);
    MOUTHPIECE_EXPECT(text.find_first_not_of(kAllowed) == std::string::npos);
    for (const auto& sentence : mouthpiece::splitSentences(text, 100)) MOUTHPIECE_EXPECT(sentence.size() <= 100);
    MOUTHPIECE_EXPECT(mouthpiece::makeFestivalJob("kal_diphone", text, nullptr).script ==
                      mouthpiece::makeFestivalJob("kal_diphone", "a", nullptr).script);
  } catch (const mouthpiece::InputError&) {
  }
  for (const std::string_view tag : {"de", "fr"}) {  // whose amounts ICU says
    try {
      static_cast<void>(mouthpiece::speakableText(bytes, mouthpiece::languageOf(tag)));
    } catch (const mouthpiece::InputError&) {
    }
  }
  try {
    mouthpiece::parseFestivalLabels(bytes);
  } catch (const mouthpiece::InputError&) {
  }
  return 0;
}
