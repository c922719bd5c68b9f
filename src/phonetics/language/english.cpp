#include <algorithm>

#include "base/errors.h"
#include "base/text_encoding.h"
#include "phonetics/language/english_text.h"
#include "phonetics/language/flite_library.h"
#include "phonetics/language/language.h"

namespace mouthpiece {
namespace {

using enum Phone;

// clang-format off
/// Southern British and General American; r-coloured centring vowels take the vowel that the lips show. The acoustic
/// model's phones have the names of the rows.
constexpr LanguagePhone kInventory[] = {
    {kAA, "ɑ a", "A a"}, {kAE, "æ", "{"}, {kAH, "ʌ ə ɐ", "V @ 6"}, {kAO, "ɔ ɒ", "O Q"}, {kAW, "aʊ aw", "aU"},
    {kAY, "aɪ aj", "aI"}, {kEH, "ɛ e eə ɛə", "E e e@ E@"}, {kER, "ɜ ɝ ɚ", "3 3` @`"}, {kEY, "eɪ ej", "eI"},
    {kIH, "ɪ ɪə ɨ", "I I@ 1"}, {kIY, "i", "i"}, {kOW, "oʊ ow əʊ əw o", "oU @U"}, {kOY, "ɔɪ ɔj", "OI"},
    {kUH, "ʊ ʊə", "U U@"}, {kUW, "u ʉ", "u"}, {kB, "b bʲ", "b"}, {kCH, "tʃ", "tS"}, {kD, "d ɾ dʲ", "d 4"},
    {kDH, "ð d̪", "D"}, {kF, "f fʲ", "f"}, {kG, "ɡ g ɟ", "g"}, {kHH, "h ç", "h"}, {kJH, "dʒ", "dZ"},
    {kK, "k c", "k"}, {kL, "l ɫ ʎ", "l 5"}, {kM, "m mʲ ɱ", "m"}, {kN, "n ɲ", "n"}, {kNG, "ŋ", "N"},
    {kP, "p pʲ", "p"}, {kR, "ɹ r ɻ", "r r\\"}, {kS, "s", "s"}, {kSH, "ʃ", "S"}, {kT, "t tʲ tw", "t"},
    {kTH, "θ t̪", "T"}, {kV, "v vʲ", "v"}, {kW, "w ʍ", "w W"}, {kY, "j", "j"}, {kZ, "z", "z"}, {kZH, "ʒ", "Z"}};

/// eSpeak's: button, wanted, loch, jalapeño, media, science, fire.
constexpr VoiceSymbol kVoiceSymbols[] = {
    {"ʔ", "T"}, {"ᵻ", "IH"}, {"x", "K"}, {"ʲ", "Y"}, {"iə", "IY AH"}, {"aɪə", "AY AH"}, {"aɪɚ", "AY ER"}};
// clang-format on

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

// clang-format off
constexpr SpelledSign kSigns[] = {
    {'%', " percent "}, {'&', " and "}, {'+', " plus "}, {'=', " equals "}, {'@', " at "}, {0xA7, " section "},
    {0xB0, " degrees "}, {0xB1, " plus or minus "}, {0xB2, " squared "}, {0xB3, " cubed "}, {0xB5, " micro "},
    {0xBC, " one quarter "}, {0xBD, " one half "}, {0xBE, " three quarters "}, {0xD7, " times "},
    {0xF7, " divided by "}, {0xA2, " cents "}, {0xA3, " pounds "}, {0xA5, " yen "}, {0x20AC, " euros "},
    {0x3A9, " ohms "}, {0x3BC, " micro "}, {0x3C0, " pi "}, {0xE3F, " baht "}, {0x20B9, " rupees "}, {0x20BD, " roubles "}, {0x2116, " number "}};
// clang-format on

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
               .currencies = U"£¥€₹₽฿",
               .signs = kSigns,
               .in_words = english_text::inWords},
      .is_legal_onset = isLegalEnglishOnset,
      .read_out = fliteWords,
      .pronounce = pronounceEnglish,
      .acoustic_model = "en-us/en-us",
      .dictionary = "en-us/cmudict-en-us.dict",
  };
  return kEnglish;
}

}  // namespace mouthpiece
