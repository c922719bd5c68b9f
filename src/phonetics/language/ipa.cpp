#include "phonetics/language/ipa.h"

#include <algorithm>
#include <cstddef>
#include <optional>
#include <utility>

#include "base/text_encoding.h"
#include "base/unicode.h"

namespace mouthpiece {
namespace {

/// A letter of the chart. `voiced` and `rounding` are what it has without a mark.
struct ConsonantLetter {
  char32_t letter;
  SoundManner manner;
  Place place;
  bool voiced;
  double rounding = 0;
  bool sibilant = false;
  Airstream airstream = Airstream::kPulmonic;
};

struct VowelLetter {
  char32_t letter;
  double height, backness, rounding;
  bool rhotic = false;
};

constexpr SoundManner kStop = SoundManner::kPlosive, kNose = SoundManner::kNasal, kTrilled = SoundManner::kTrill,
                      kFlap = SoundManner::kTap, kHissing = SoundManner::kFricative,
                      kSideHiss = SoundManner::kLateralFricative, kGlide = SoundManner::kApproximant,
                      kSide = SoundManner::kLateral;
constexpr Airstream kIn = Airstream::kImplosive, kSuck = Airstream::kClick;
/// Lips of the hushing sounds: much with ʃ, less with the retroflex ones, none with ɕ.
constexpr double kHushRound = 0.7, kRetroflexRound = 0.4, kLaxRound = 0.3;

constexpr ConsonantLetter kConsonants[] = {{U'p', kStop, Place::kBilabial, false},
                                           {U'b', kStop, Place::kBilabial, true},
                                           {U't', kStop, Place::kAlveolar, false},
                                           {U'd', kStop, Place::kAlveolar, true},
                                           {U'ʈ', kStop, Place::kRetroflex, false},
                                           {U'ɖ', kStop, Place::kRetroflex, true},
                                           {U'c', kStop, Place::kPalatal, false},
                                           {U'ɟ', kStop, Place::kPalatal, true},
                                           {U'k', kStop, Place::kVelar, false},
                                           {U'ɡ', kStop, Place::kVelar, true},
                                           {U'g', kStop, Place::kVelar, true},
                                           {U'q', kStop, Place::kUvular, false},
                                           {U'ɢ', kStop, Place::kUvular, true},
                                           {U'ʡ', kStop, Place::kEpiglottal, false},
                                           {U'ʔ', kStop, Place::kGlottal, false},
                                           {U'm', kNose, Place::kBilabial, true},
                                           {U'ɱ', kNose, Place::kLabiodental, true},
                                           {U'n', kNose, Place::kAlveolar, true},
                                           {U'ɳ', kNose, Place::kRetroflex, true},
                                           {U'ɲ', kNose, Place::kPalatal, true},
                                           {U'ŋ', kNose, Place::kVelar, true},
                                           {U'ɴ', kNose, Place::kUvular, true},
                                           {U'ʙ', kTrilled, Place::kBilabial, true},
                                           {U'r', kTrilled, Place::kAlveolar, true},
                                           {U'ʀ', kTrilled, Place::kUvular, true},
                                           {U'ⱱ', kFlap, Place::kLabiodental, true},
                                           {U'ɾ', kFlap, Place::kAlveolar, true},
                                           {U'ɽ', kFlap, Place::kRetroflex, true},
                                           {U'ɺ', kFlap, Place::kAlveolar, true},
                                           {U'ɸ', kHissing, Place::kBilabial, false},
                                           {U'β', kHissing, Place::kBilabial, true},
                                           {U'f', kHissing, Place::kLabiodental, false},
                                           {U'v', kHissing, Place::kLabiodental, true},
                                           {U'θ', kHissing, Place::kDental, false},
                                           {U'ð', kHissing, Place::kDental, true},
                                           {U's', kHissing, Place::kAlveolar, false, 0, true},
                                           {U'z', kHissing, Place::kAlveolar, true, 0, true},
                                           {U'ʃ', kHissing, Place::kPostalveolar, false, kHushRound, true},
                                           {U'ʒ', kHissing, Place::kPostalveolar, true, kHushRound, true},
                                           {U'ʂ', kHissing, Place::kRetroflex, false, kRetroflexRound, true},
                                           {U'ʐ', kHissing, Place::kRetroflex, true, kRetroflexRound, true},
                                           {U'ɕ', kHissing, Place::kAlveoloPalatal, false, 0, true},
                                           {U'ʑ', kHissing, Place::kAlveoloPalatal, true, 0, true},
                                           {U'ɧ', kHissing, Place::kPostalveolar, false, kHushRound, true},
                                           {U'ç', kHissing, Place::kPalatal, false},
                                           {U'ʝ', kHissing, Place::kPalatal, true},
                                           {U'x', kHissing, Place::kVelar, false},
                                           {U'ɣ', kHissing, Place::kVelar, true},
                                           {U'χ', kHissing, Place::kUvular, false},
                                           {U'ʁ', kHissing, Place::kUvular, true},
                                           {U'ħ', kHissing, Place::kPharyngeal, false},
                                           {U'ʕ', kHissing, Place::kPharyngeal, true},
                                           {U'ʜ', kHissing, Place::kEpiglottal, false},
                                           {U'ʢ', kHissing, Place::kEpiglottal, true},
                                           {U'h', kHissing, Place::kGlottal, false},
                                           {U'ɦ', kHissing, Place::kGlottal, true},
                                           {U'ɬ', kSideHiss, Place::kAlveolar, false},
                                           {U'ɮ', kSideHiss, Place::kAlveolar, true},
                                           {U'ʋ', kGlide, Place::kLabiodental, true},
                                           {U'ɹ', kGlide, Place::kAlveolar, true, kLaxRound},
                                           {U'ɻ', kGlide, Place::kRetroflex, true, kLaxRound},
                                           {U'j', kGlide, Place::kPalatal, true},
                                           {U'ɰ', kGlide, Place::kVelar, true},
                                           {U'w', kGlide, Place::kLabialVelar, true, 1},
                                           {U'ʍ', kGlide, Place::kLabialVelar, false, 1},
                                           {U'ɥ', kGlide, Place::kLabialPalatal, true, 1},
                                           {U'l', kSide, Place::kAlveolar, true},
                                           {U'ɫ', kSide, Place::kAlveolar, true},
                                           {U'ɭ', kSide, Place::kRetroflex, true},
                                           {U'ʎ', kSide, Place::kPalatal, true},
                                           {U'ʟ', kSide, Place::kVelar, true},
                                           {U'ʘ', kStop, Place::kBilabial, false, 0, false, kSuck},
                                           {U'ǀ', kStop, Place::kDental, false, 0, false, kSuck},
                                           {U'ǃ', kStop, Place::kAlveolar, false, 0, false, kSuck},
                                           {U'ǂ', kStop, Place::kPalatal, false, 0, false, kSuck},
                                           {U'ǁ', kStop, Place::kAlveolar, false, 0, false, kSuck},
                                           {U'ɓ', kStop, Place::kBilabial, true, 0, false, kIn},
                                           {U'ɗ', kStop, Place::kAlveolar, true, 0, false, kIn},
                                           {U'ᶑ', kStop, Place::kRetroflex, true, 0, false, kIn},
                                           {U'ʄ', kStop, Place::kPalatal, true, 0, false, kIn},
                                           {U'ɠ', kStop, Place::kVelar, true, 0, false, kIn},
                                           {U'ʛ', kStop, Place::kUvular, true, 0, false, kIn}};

constexpr VowelLetter kVowelLetters[] = {{U'i', 1, 0, 0},
                                         {U'y', 1, 0, 1},
                                         {U'ɨ', 1, 0.5, 0},
                                         {U'ʉ', 1, 0.5, 1},
                                         {U'ɯ', 1, 1, 0},
                                         {U'u', 1, 1, 1},
                                         {U'ɪ', 0.88, 0.15, 0},
                                         {U'ʏ', 0.88, 0.15, 0.9},
                                         {U'ʊ', 0.88, 0.85, 0.9},
                                         {U'ᵻ', 0.88, 0.5, 0},
                                         {U'ᵿ', 0.88, 0.5, 0.9},
                                         {U'e', 0.67, 0, 0},
                                         {U'ø', 0.67, 0, 0.9},
                                         {U'ɘ', 0.67, 0.5, 0},
                                         {U'ɵ', 0.67, 0.5, 0.8},
                                         {U'ɤ', 0.67, 1, 0},
                                         {U'o', 0.67, 1, 0.9},
                                         {U'ə', 0.5, 0.5, 0},
                                         {U'ɚ', 0.5, 0.5, 0.3, true},
                                         {U'ɛ', 0.33, 0, 0},
                                         {U'œ', 0.33, 0, 0.7},
                                         {U'ɜ', 0.33, 0.5, 0},
                                         {U'ɝ', 0.5, 0.5, 0.4, true},
                                         {U'ɞ', 0.33, 0.5, 0.7},
                                         {U'ʌ', 0.33, 1, 0},
                                         {U'ɔ', 0.33, 1, 0.7},
                                         {U'æ', 0.15, 0, 0},
                                         {U'ɐ', 0.3, 0.5, 0},
                                         {U'a', 0, 0.4, 0},
                                         {U'ɶ', 0, 0, 0.5},
                                         {U'ɑ', 0, 1, 0},
                                         {U'ɒ', 0.1, 1, 0.5}};

/// Signs of others that stand for two letters.
struct Ligature {
  char32_t sign;
  char32_t first, second;
};
constexpr Ligature kTogether[] = {{U'ʦ', U't', U's'}, {U'ʣ', U'd', U'z'}, {U'ʧ', U't', U'ʃ'},   {U'ʤ', U'd', U'ʒ'},
                                  {U'ʨ', U't', U'ɕ'}, {U'ʥ', U'd', U'ʑ'}, {U'ꭧ', U't', U'ʂ'}, {U'ꭦ', U'd', U'ʐ'}};

/// A mark after a letter and what it changes; nullptr: nothing that the table holds.
struct Mark {
  char32_t mark;
  void (*change)(IpaSound& sound);
};
double moved(double value, double by) { return std::clamp(value + by, 0.0, 1.0); }
constexpr auto kPass = nullptr;

constexpr Mark kMarks[] = {
    {0x0325, [](IpaSound& s) { s.voiced = false; }},  // ring below
    {0x030A, [](IpaSound& s) { s.voiced = false; }},  // ring above
    {0x032C, [](IpaSound& s) { s.voiced = true; }},
    {U'ʰ', [](IpaSound& s) { s.voiced = s.voiced && s.isVowel(); }},
    {U'ʱ', kPass},
    {0x0339, [](IpaSound& s) { s.rounding = moved(s.rounding, 0.3); }},
    {0x0357, [](IpaSound& s) { s.rounding = moved(s.rounding, 0.3); }},
    {0x031C, [](IpaSound& s) { s.rounding = moved(s.rounding, -0.3); }},
    {0x0351, [](IpaSound& s) { s.rounding = moved(s.rounding, -0.3); }},
    {0x031F, [](IpaSound& s) { s.backness = moved(s.backness, -0.15); }},
    {0x02D6, [](IpaSound& s) { s.backness = moved(s.backness, -0.15); }},
    {0x0320,
     [](IpaSound& s) {
       s.backness = moved(s.backness, 0.15);
       if (s.place == Place::kDental || (s.place == Place::kAlveolar && s.sibilant)) s.place = Place::kPostalveolar;
     }},
    {0x02D7, [](IpaSound& s) { s.backness = moved(s.backness, 0.15); }},
    {0x0308, [](IpaSound& s) { s.backness += 0.5 * (0.5 - s.backness); }},
    {0x033D,
     [](IpaSound& s) {
       s.backness += 0.5 * (0.5 - s.backness);
       s.height += 0.5 * (0.5 - s.height);
     }},
    {0x0329, [](IpaSound& s) { s.syllabic = true; }},
    {0x030D, [](IpaSound& s) { s.syllabic = true; }},
    {0x032F, [](IpaSound& s) { s.syllabic = false; }},
    {0x0311, [](IpaSound& s) { s.syllabic = false; }},
    {U'˞', [](IpaSound& s) { s.rhotic = true; }},
    {0x0324, kPass},  // breathy
    {0x0330, kPass},  // creaky
    {0x033C, [](IpaSound& s) { s.place = s.place == Place::kBilabial ? Place::kBilabial : Place::kLinguolabial; }},
    {U'ʷ', [](IpaSound& s) { s.rounding = std::max(s.rounding, 0.8); }},
    {0x1DA3, [](IpaSound& s) { s.rounding = std::max(s.rounding, 0.8); }},  // ᶣ
    {U'ʲ', kPass},
    {U'ˠ', kPass},
    {U'ˤ', kPass},
    {U'ˀ', kPass},
    {U'ˁ', kPass},
    {0x0334, kPass},
    {0x031D, [](IpaSound& s) { s.height = moved(s.height, 0.1); }},
    {U'˔', [](IpaSound& s) { s.height = moved(s.height, 0.1); }},
    {0x031E,
     [](IpaSound& s) {
       s.height = moved(s.height, -0.1);
       if (s.manner == SoundManner::kFricative && !s.sibilant) s.manner = SoundManner::kApproximant;
     }},
    {U'˕', [](IpaSound& s) { s.height = moved(s.height, -0.1); }},
    {0x0318, kPass},  // advanced tongue root
    {0x0319, kPass},
    {0x032A,
     [](IpaSound& s) {
       if (s.place == Place::kAlveolar) s.place = Place::kDental;
       if (s.place == Place::kBilabial) s.place = Place::kLabiodental;
     }},
    {0x0346, kPass},
    {0x033A, kPass},
    {0x033B, kPass},
    {0x0303, [](IpaSound& s) { s.nasal = true; }},
    {U'ⁿ', kPass},
    {U'ᵐ', kPass},
    {U'ᵑ', kPass},
    {U'ˡ', kPass},
    {0x1DBF, kPass},  // ᶿ
    {U'ˣ', kPass},
    {U'ᵊ', kPass},
    {0x031A, kPass},
    {U'ʼ', [](IpaSound& s) { s.airstream = s.voiced ? s.airstream : Airstream::kEjective; }},
    {U'\'', [](IpaSound& s) { s.airstream = s.voiced ? s.airstream : Airstream::kEjective; }},
    {0x02BB, kPass},
    {U'ː', [](IpaSound& s) { s.length = 2; }},
    {U':', [](IpaSound& s) { s.length = 2; }},
    {U'ˑ', [](IpaSound& s) { s.length = 1.5; }},
    {0x0306, [](IpaSound& s) { s.length = 0.5; }},
    // Tones and pitch.
    {0x030B, kPass},
    {0x0301, kPass},
    {0x0304, kPass},
    {0x0300, kPass},
    {0x030F, kPass},
    {0x030C, kPass},
    {0x0302, kPass},
    {0x1DC4, kPass},
    {0x1DC5, kPass},
    {0x1DC8, kPass},
    {0x1DC6, kPass},
    {0x1DC7, kPass},
    {0x1DC9, kPass}};

/// Signs that stand for no sound: breaks, links, tone letters, steps and contours, brackets.
constexpr std::u32string_view kNoSounds =
    U" \t\r\n.|‖‿/"
    U"[](){}⟨⟩,;-"
    U"–—˥˦˧˨˩ꜛꜜ↗↘↑↓‧·¹²³⁴⁵⁰‍‌꜀꜁꜂꜃꜄꜅꜆꜇꜈꜉꜊꜋꜌꜍꜎꜏꜐"
    U"꜑";

IpaSound soundOf(const ConsonantLetter& row) {
  IpaSound sound;
  sound.manner = row.manner;
  sound.place = row.place;
  sound.airstream = row.airstream;
  sound.voiced = row.voiced;
  sound.nasal = row.manner == SoundManner::kNasal;
  sound.syllabic = false;
  sound.sibilant = row.sibilant;
  sound.rhotic = row.letter == U'ɹ' || row.letter == U'ɻ';
  sound.rounding = row.rounding;
  return sound;
}

IpaSound soundOf(const VowelLetter& row) {
  IpaSound sound;
  sound.height = row.height;
  sound.backness = row.backness;
  sound.rounding = row.rounding;
  sound.rhotic = row.rhotic;
  return sound;
}

std::optional<IpaSound> soundOf(char32_t letter) {
  for (const ConsonantLetter& row : kConsonants) {
    if (row.letter == letter) return soundOf(row);
  }
  for (const VowelLetter& row : kVowelLetters) {
    if (row.letter == letter) return soundOf(row);
  }
  return std::nullopt;
}

const Mark* markOf(char32_t sign) {
  const auto found =
      std::find_if(std::begin(kMarks), std::end(kMarks), [&](const Mark& row) { return row.mark == sign; });
  return found == std::end(kMarks) ? nullptr : found;
}

/// A raised letter that stands alone or first, as in ⁿd and in eSpeak's ʲ, is that sound.
char32_t letterOf(char32_t raised) {
  constexpr std::pair<char32_t, char32_t> kRaised[] = {{U'ʲ', U'j'}, {U'ʷ', U'w'}, {U'ʰ', U'h'}, {U'ʱ', U'ɦ'},
                                                       {U'ⁿ', U'n'}, {U'ᵐ', U'm'}, {U'ᵑ', U'ŋ'}, {U'ˡ', U'l'},
                                                       {U'ᵊ', U'ə'}, {U'ˠ', U'ɣ'}, {U'ˤ', U'ʕ'}, {U'ˀ', U'ʔ'}};
  for (const auto& [sign, letter] : kRaised) {
    if (sign == raised) return letter;
  }
  return 0;
}

constexpr char32_t kTieAbove = 0x0361, kTieBelow = 0x035C, kCedilla = 0x0327;

bool isSamePlace(Place a, Place b) {
  const auto region = [](Place place) {
    switch (place) {
      case Place::kBilabial:
      case Place::kLabiodental:
        return 0;
      case Place::kDental:
      case Place::kAlveolar:
      case Place::kPostalveolar:
      case Place::kRetroflex:
      case Place::kAlveoloPalatal:
        return 1;
      case Place::kPalatal:
        return 2;
      case Place::kVelar:
      case Place::kUvular:
        return 3;
      default:
        return 4 + static_cast<int>(place);
    }
  };
  return region(a) == region(b);
}

/// A stop and the fricative that it goes into.
bool isAffricate(const IpaSound& first, const IpaSound& second) {
  const bool is_release = second.manner == SoundManner::kFricative || second.manner == SoundManner::kLateralFricative;
  return first.manner == SoundManner::kPlosive && is_release && first.voiced == second.voiced &&
         isSamePlace(first.place, second.place);
}

class Reader {
 public:
  explicit Reader(std::string_view text) {
    const std::string apart = toNfd(text);
    for (std::size_t at = 0; at < apart.size();) {
      if (const auto c = decodeUtf8(apart, at)) {
        if (*c != kCedilla || !joinCedilla()) signs_.push_back(*c);
      } else {
        signs_.push_back(0xFFFD);
        ++at;
      }
    }
  }

  IpaReading read() {
    for (; at_ < signs_.size(); ++at_) readSign(signs_[at_]);
    for (IpaSound& sound : reading_.sounds) sound.symbol = toNfc(sound.symbol);
    return std::move(reading_);
  }

 private:
  /// ç is a letter of its own; apart, its cedilla may stand behind other marks.
  bool joinCedilla() {
    for (std::size_t back = signs_.size(); back-- > 0;) {
      if (signs_[back] == U'c') signs_[back] = U'ç';
      if (signs_[back] == U'ç') return true;
      if (markOf(signs_[back]) == nullptr) return false;
    }
    return false;
  }

  void readSign(char32_t sign) {
    if (sign == U'ˈ' || sign == U'ˌ') {
      stress_ = sign == U'ˈ' ? 1 : 2;
    } else if (sign == kTieAbove || sign == kTieBelow) {
      tied_ = !reading_.sounds.empty();
    } else if (const char32_t letter = letterOf(sign); letter != 0 && !has_letter_) {
      addLetter(*soundOf(letter), std::u32string_view(&letter, 1));
    } else if (const Mark* mark = markOf(sign); mark != nullptr && has_letter_) {
      applyMark(*mark);
    } else if (const auto sound = soundOf(sign)) {
      addLetter(*sound, std::u32string_view(&sign, 1));
    } else if (!addLigature(sign) && kNoSounds.find(sign) == std::u32string_view::npos && mark == nullptr) {
      addUnknown(sign);
    } else if (kNoSounds.find(sign) != std::u32string_view::npos) {
      has_letter_ = tied_ = false;
    }
  }

  void applyMark(const Mark& mark) {
    IpaSound& sound = reading_.sounds.back();
    if (mark.change != nullptr) mark.change(sound);
    const bool is_tone = mark.mark == 0x030B || mark.mark == 0x0301 || mark.mark == 0x0304 || mark.mark == 0x0300 ||
                         mark.mark == 0x030F || mark.mark == 0x030C || mark.mark == 0x0302 || mark.mark >= 0x1DC4;
    if (!is_tone || (mark.mark >= 0x2000)) appendUtf8(sound.symbol, mark.mark == U':' ? U'ː' : mark.mark);
  }

  void addLetter(IpaSound sound, std::u32string_view letters) {
    for (const char32_t letter : letters) appendUtf8(sound.symbol, letter == U'g' ? U'ɡ' : letter);
    sound.stress = std::exchange(stress_, 0);
    if (!reading_.sounds.empty() && has_letter_) {
      IpaSound& before = reading_.sounds.back();
      before.opens_affricate = isAffricate(before, sound);
      // Doubly made: k͡p and ŋ͡m shut the lips whatever the tongue does.
      if (tied_ && before.manner == sound.manner && before.closesLips() != sound.closesLips()) {
        before.place = Place::kBilabial;
        before.symbol += "\u0361" + sound.symbol;
        tied_ = false;
        return;
      }
    }
    tied_ = false;
    has_letter_ = true;
    reading_.sounds.push_back(std::move(sound));
  }

  bool addLigature(char32_t sign) {
    for (const Ligature& ligature : kTogether) {
      if (ligature.sign != sign) continue;
      addLetter(*soundOf(ligature.first), std::u32string_view(&ligature.first, 1));
      addLetter(*soundOf(ligature.second), std::u32string_view(&ligature.second, 1));
      return true;
    }
    return false;
  }

  void addUnknown(char32_t sign) {
    std::string text;
    appendUtf8(text, sign);
    if (std::find(reading_.unknown.begin(), reading_.unknown.end(), text) == reading_.unknown.end())
      reading_.unknown.push_back(text);
  }

  std::vector<char32_t> signs_;
  std::size_t at_ = 0;
  IpaReading reading_;
  int stress_ = 0;
  bool tied_ = false, has_letter_ = false;
};

}  // namespace

bool IpaSound::closesLips() const {
  return place == Place::kBilabial && (manner == SoundManner::kPlosive || manner == SoundManner::kNasal ||
                                       manner == SoundManner::kTrill || manner == SoundManner::kTap);
}

bool IpaSound::isMadeLike(const IpaSound& other) const {
  return manner == other.manner && place == other.place && voiced == other.voiced && airstream == other.airstream &&
         sibilant == other.sibilant && height == other.height && backness == other.backness &&
         (!isVowel() || rounding == other.rounding);
}

IpaReading readIpa(std::string_view text) { return Reader(text).read(); }

std::vector<std::string> ipaLetters() {
  std::vector<std::string> letters;
  const auto add = [&](char32_t letter) { appendUtf8(letters.emplace_back(), letter); };
  for (const ConsonantLetter& row : kConsonants) add(row.letter);
  for (const VowelLetter& row : kVowelLetters) add(row.letter);
  for (const Ligature& row : kTogether) add(row.sign);
  return letters;
}

std::vector<std::string> ipaMarks() {
  std::vector<std::string> marks;
  for (const Mark& row : kMarks) appendUtf8(marks.emplace_back(), row.mark);
  return marks;
}

}  // namespace mouthpiece
