#include <algorithm>
#include <array>

#include "base/errors.h"
#include "base/text_encoding.h"
#include "phonetics/language/flite_library.h"
#include "phonetics/language/language.h"

namespace mouthpiece {
namespace {

using enum Phone;

/// Southern British and General American; r-coloured centring vowels take the vowel that the lips show. The acoustic
/// model's phones have the names of the rows.
constexpr std::array kInventory = {
    LanguagePhone{kAA, "ɑ a", "A a"},
    LanguagePhone{kAE, "æ", "{"},
    LanguagePhone{kAH, "ʌ ə ɐ", "V @ 6"},
    LanguagePhone{kAO, "ɔ ɒ", "O Q"},
    LanguagePhone{kAW, "aʊ aw", "aU"},
    LanguagePhone{kAY, "aɪ aj", "aI"},
    LanguagePhone{kEH, "ɛ e eə ɛə", "E e e@ E@"},
    LanguagePhone{kER, "ɜ ɝ ɚ", "3 3` @`"},
    LanguagePhone{kEY, "eɪ ej", "eI"},
    LanguagePhone{kIH, "ɪ ɪə ɨ", "I I@ 1"},
    LanguagePhone{kIY, "i", "i"},
    LanguagePhone{kOW, "oʊ ow əʊ əw o", "oU @U"},
    LanguagePhone{kOY, "ɔɪ ɔj", "OI"},
    LanguagePhone{kUH, "ʊ ʊə", "U U@"},
    LanguagePhone{kUW, "u ʉ", "u"},
    LanguagePhone{kB, "b bʲ", "b"},
    LanguagePhone{kCH, "tʃ", "tS"},
    LanguagePhone{kD, "d ɾ dʲ", "d 4"},
    LanguagePhone{kDH, "ð d̪", "D"},
    LanguagePhone{kF, "f fʲ", "f"},
    LanguagePhone{kG, "ɡ g ɟ", "g"},
    LanguagePhone{kHH, "h ç", "h"},
    LanguagePhone{kJH, "dʒ", "dZ"},
    LanguagePhone{kK, "k c", "k"},
    LanguagePhone{kL, "l ɫ ʎ", "l 5"},
    LanguagePhone{kM, "m mʲ ɱ", "m"},
    LanguagePhone{kN, "n ɲ", "n"},
    LanguagePhone{kNG, "ŋ", "N"},
    LanguagePhone{kP, "p pʲ", "p"},
    LanguagePhone{kR, "ɹ r ɻ", "r r\\"},
    LanguagePhone{kS, "s", "s"},
    LanguagePhone{kSH, "ʃ", "S"},
    LanguagePhone{kT, "t tʲ tw", "t"},
    LanguagePhone{kTH, "θ t̪", "T"},
    LanguagePhone{kV, "v vʲ", "v"},
    LanguagePhone{kW, "w ʍ", "w W"},
    LanguagePhone{kY, "j", "j"},
    LanguagePhone{kZ, "z", "z"},
    LanguagePhone{kZH, "ʒ", "Z"},
};

/// eSpeak's: button, wanted, loch, jalapeño, media, science, fire.
constexpr std::array kVoiceSymbols = {VoiceSymbol{"ʔ", "T"},       VoiceSymbol{"ᵻ", "IH"},      VoiceSymbol{"x", "K"},
                                      VoiceSymbol{"ʲ", "Y"},       VoiceSymbol{"iə", "IY AH"}, VoiceSymbol{"aɪə", "AY AH"},
                                      VoiceSymbol{"aɪɚ", "AY ER"}};

constexpr bool isOneOf(Phone phone, std::initializer_list<Phone> set) {
  return std::find(set.begin(), set.end(), phone) != set.end();
}

/// Two-phone onsets: stop or fricative with an approximant, s with a voiceless stop, nasal or approximant,
/// and a consonant with Y before UW ("cute", "music").
bool isLegalPair(Phone first, Phone second) {
  switch (second) {
    case kL:
      return isOneOf(first, {kP, kB, kK, kG, kF, kS});
    case kR:
      return isOneOf(first, {kP, kB, kT, kD, kK, kG, kF, kTH, kSH});
    case kW:
      return isOneOf(first, {kT, kD, kK, kG, kS, kTH, kHH});
    case kY:
      return isOneOf(first, {kP, kB, kT, kD, kK, kG, kF, kV, kM, kN, kHH, kL, kS, kTH});
    default:
      return first == kS && isOneOf(second, {kP, kT, kK, kM, kN, kF});
  }
}

bool isLegalEnglishOnset(std::span<const Phone> consonants) {
  switch (consonants.size()) {
    case 1:
      return consonants[0] != kNG;
    case 2:
      return isLegalPair(consonants[0], consonants[1]);
    case 3:  // s + voiceless stop + approximant: "spring", "splash", "street", "square", "skew"
      return consonants[0] == kS && isOneOf(consonants[1], {kP, kT, kK}) && isOneOf(consonants[2], {kL, kR, kW, kY}) &&
             isLegalPair(consonants[1], consonants[2]);
    default:
      return false;
  }
}

constexpr std::array kSigns = {
    SpelledSign{'%', " percent "},   SpelledSign{'&', " and "},
    SpelledSign{'+', " plus "},      SpelledSign{'=', " equals "},
    SpelledSign{'@', " at "},        SpelledSign{0xA7, " section "},
    SpelledSign{0xB0, " degrees "},  SpelledSign{0xB1, " plus or minus "},
    SpelledSign{0xB2, " squared "},  SpelledSign{0xB3, " cubed "},
    SpelledSign{0xB5, " micro "},    SpelledSign{0xBC, " one quarter "},
    SpelledSign{0xBD, " one half "}, SpelledSign{0xBE, " three quarters "},
    SpelledSign{0xD7, " times "},    SpelledSign{0xF7, " divided by "},
    SpelledSign{0xA2, " cents "},    SpelledSign{0xA3, " pounds "},
    SpelledSign{0xA5, " yen "},      SpelledSign{0x20AC, " euros "},
    SpelledSign{0x20B9, " rupees "}, SpelledSign{0x20BD, " roubles "},
    SpelledSign{0x2116, " number "},
};

/// From Flite's dictionary, or its letter-to-sound rules.
Pronunciation pronounceEnglish(std::string_view word) {
  Pronunciation pronunciation;
  for (const std::string& name : flitePhones(lowerCase(word))) {
    const auto phone = phoneFromName(name);
    MOUTHPIECE_EXPECT(phone.has_value());
    pronunciation.phones.push_back(*phone);
    pronunciation.stress.push_back(stressOfName(name).value_or(-1));
  }
  return pronunciation;
}

}  // namespace

const Language& english() {
  static constexpr Language kEnglish{
      .tag = "en",
      .name = "English",
      .inventory = kInventory,
      .voice_symbols = kVoiceSymbols,
      .text = {.expected = "letters that an English voice reads (Latin script)",
               .own_letters = {},
               .currencies = U"£¥€₹₽",
               .signs = kSigns},
      .is_legal_onset = isLegalEnglishOnset,
      .read_out = fliteWords,
      .pronounce = pronounceEnglish,
      .acoustic_model = "en-us/en-us",
      .dictionary = "en-us/cmudict-en-us.dict",
  };
  return kEnglish;
}

}  // namespace mouthpiece
