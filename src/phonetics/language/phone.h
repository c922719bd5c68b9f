#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

namespace mouthpiece {

/// ARPAbet without stress, one symbol per phone (diphthongs and affricates stay one), and silence. The schwa has one
/// normal form: labels hold kAH, never kAX, which is only a name that is understood
/// (docs/theory/phones_and_visemes.md).
enum class Phone : std::uint8_t {
  kSil,
  kAA,
  kAE,
  kAH,
  kAO,
  kAW,
  kAX,
  kAY,
  kEH,
  kER,
  kEY,
  kIH,
  kIY,
  kOW,
  kOY,
  kUH,
  kUW,
  kB,
  kCH,
  kD,
  kDH,
  kF,
  kG,
  kHH,
  kJH,
  kK,
  kL,
  kM,
  kN,
  kNG,
  kP,
  kR,
  kS,
  kSH,
  kT,
  kTH,
  kV,
  kW,
  kY,
  kZ,
  kZH,
};
inline constexpr std::size_t kPhoneCount = 41;

/// "sil", "AA", ..., "ZH".
std::string_view phoneName(Phone phone);
/// Accepts any case, a stress digit after a vowel ("AH0"), and the names of Festival, TIMIT and HTK ("ax" is kAH, "pau"
/// kSil). nullopt for an unknown symbol.
std::optional<Phone> phoneFromName(std::string_view name);

bool isVowel(Phone phone);
bool isBilabial(Phone phone);     ///< P B M
bool isLabiodental(Phone phone);  ///< F V
bool isStop(Phone phone);         ///< P B T D K G, and CH JH, which open with one

/// The viseme classes of design page, section 8.
enum class Viseme : std::uint8_t {
  kSil,
  kAh,
  kEh,
  kEe,
  kIh,
  kOh,
  kOo,
  kUh,
  kEr,
  kR,
  kW,
  kY,
  kMBP,
  kFV,
  kTh,
  kLNTD,
  kS,
  kShChJ,
  kGK,
  kH,
};
inline constexpr std::size_t kVisemeCount = 20;
std::string_view visemeName(Viseme viseme);
/// The class that a phone starts in (EY: Eh, AW: Ah) and the one it ends in (EY: Ee, AW: Oo); the same for most.
Viseme firstViseme(Phone phone);
Viseme lastViseme(Phone phone);

}  // namespace mouthpiece
