#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace mouthpiece {

/// Where the IPA chart (2020) puts a consonant, from the lips back. A vowel has none.
enum class Place : std::uint8_t {
  kNone,
  kBilabial,
  kLabialVelar,
  kLabialPalatal,
  kLabiodental,
  kLinguolabial,
  kDental,
  kAlveolar,
  kPostalveolar,
  kRetroflex,
  kAlveoloPalatal,
  kPalatal,
  kVelar,
  kUvular,
  kPharyngeal,
  kEpiglottal,
  kGlottal
};

enum class SoundManner : std::uint8_t {
  kVowel,
  kPlosive,
  kNasal,
  kTrill,
  kTap,
  kFricative,
  kLateralFricative,
  kApproximant,
  kLateral
};

enum class Airstream : std::uint8_t { kPulmonic, kEjective, kImplosive, kClick };

/// What one IPA symbol with its diacritics says of the mouth (docs/theory/phonetics/ipa.md).
struct IpaSound {
  std::string symbol;  ///< the letter with its marks, NFC, without stress and tone
  SoundManner manner = SoundManner::kVowel;
  Place place = Place::kNone;
  Airstream airstream = Airstream::kPulmonic;
  bool voiced = true, nasal = false, syllabic = true, sibilant = false, rhotic = false;
  bool opens_affricate = false;  ///< the next sound releases it
  double height = 0;             ///< of the tongue in a vowel: 0 open, 1 close
  double backness = 0;           ///< of the tongue: 0 front, 1 back
  double rounding = 0;           ///< of the lips: 0 spread or at rest, 1 narrow and round
  double length = 1;             ///< ˘ 0.5, ˑ 1.5, ː 2
  int stress = 0;                ///< marked before it: 0 none, 1 ˈ, 2 ˌ

  [[nodiscard]] bool isVowel() const { return manner == SoundManner::kVowel; }
  /// Both lips shut: stops and nasals made with them, their trill and click too, not β and ɸ.
  [[nodiscard]] bool closesLips() const;
  /// The same place, manner and voice, and the same vowel; whatever else the marks say.
  [[nodiscard]] bool isMadeLike(const IpaSound& other) const;
  /// Lower lip against the upper teeth.
  [[nodiscard]] bool touchesTeeth() const { return place == Place::kLabiodental; }
};

/// A text in IPA: its sounds in order, and the symbols that no row describes, each once. Blanks, slashes, brackets,
/// tones, pitch, breaks and linking marks are no sounds; stress goes to the next sound's `stress`. An affricate is two
/// sounds. Any bytes are taken; broken UTF-8 is an unknown symbol.
struct IpaReading {
  std::vector<IpaSound> sounds;
  std::vector<std::string> unknown;
};
IpaReading readIpa(std::string_view text);

/// Every letter that readIpa() has a row for, for tables and tests.
std::vector<std::string> ipaLetters();
/// Every mark after a letter that changes its row or is known to change nothing that is seen.
std::vector<std::string> ipaMarks();

/// X-SAMPA as IPA, sign for sign; what it has no sign for stays as it is.
std::string ipaFromXSampa(std::string_view text);

/// How unlike two sounds look: lips first (shut, on the teeth, round), then the opening, then what the tongue does.
double visibleDistance(const IpaSound& a, const IpaSound& b);
/// How unlike they sound to a recogniser: place, manner, voice; height and backness of vowels.
double audibleDistance(const IpaSound& a, const IpaSound& b);

}  // namespace mouthpiece
