#include <cstddef>
#include <cstdint>
#include <string_view>

#include "base/errors.h"
#include "phonetics/language/ipa.h"
#include "phonetics/language/language.h"
#include "phonetics/text/lexicon.h"

/// IPA and X-SAMPA: every sound has a phone, numbers stay in range, a lexicon is read or refused; its sounds, written
/// again, are the same sounds.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const mouthpiece::IpaReading reading = mouthpiece::readIpa(text);
  std::vector<std::string> unknown;
  const auto phones = mouthpiece::phonesOfIpa(text, unknown);
  MOUTHPIECE_EXPECT(phones.empty() == reading.sounds.empty());
  MOUTHPIECE_EXPECT(unknown == reading.unknown);
  for (const mouthpiece::IpaSound& sound : reading.sounds) {
    MOUTHPIECE_EXPECT(sound.rounding >= 0 && sound.rounding <= 1 && sound.height >= 0 && sound.height <= 1 &&
                      sound.backness >= 0 && sound.backness <= 1);
    const mouthpiece::IpaReading again = mouthpiece::readIpa(sound.symbol);
    MOUTHPIECE_EXPECT(!again.sounds.empty() && again.unknown.empty());
  }
  for (const auto& phone : phones) MOUTHPIECE_EXPECT(phone.phone != mouthpiece::Phone::kSil);
  mouthpiece::readIpa(mouthpiece::ipaFromXSampa(text));
  for (const char* tag : {"en", "ja"}) {
    try {
      const auto lexicon = mouthpiece::Lexicon::parseAnySet(text, "fuzz", mouthpiece::languageOf(tag));
      for (const auto& [word, ways] : lexicon.words()) {
        for (const auto& way : ways) {
          MOUTHPIECE_EXPECT(way.phones.size() == way.stress.size());
          MOUTHPIECE_EXPECT(way.heard.empty() || way.heard.size() == way.phones.size());
          MOUTHPIECE_EXPECT(way.ipa.empty() || way.ipa.size() == way.phones.size());
        }
      }
    } catch (const mouthpiece::InputError&) {
    }
  }
  return 0;
}
