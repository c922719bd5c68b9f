#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

namespace mouthpiece {

// clang-format off
/// ARPAbet without stress, one symbol per phone (diphthongs and affricates stay one), and silence. The schwa has one
/// normal form, kAH (docs/theory/phonetics/phones_and_visemes.md).
enum class Phone : std::uint8_t {
  kSil, kAA, kAE, kAH, kAO, kAW, kAY, kEH, kER, kEY, kIH, kIY, kOW, kOY, kUH, kUW, kB, kCH, kD, kDH, kF, kG, kHH,
  kJH, kK, kL, kM, kN, kNG, kP, kR, kS, kSH, kT, kTH, kV, kW, kY, kZ, kZH
};
inline constexpr std::size_t kPhoneCount = 40;

/// The viseme classes of design page, section 8.
enum class Viseme : std::uint8_t {
  kSil, kAh, kEh, kEe, kIh, kOh, kOo, kUh, kEr, kR, kW, kY, kMBP, kFV, kTh, kLNTD, kS, kShChJ, kGK, kH
};
inline constexpr std::size_t kVisemeCount = 20;

/// How the mouth makes the sound. A diphthong is a vowel whose visemes differ.
enum class Articulation : std::uint8_t {
  kSilence, kVowel, kPlosive, kAffricate, kFricative, kNasal, kLateral, kApproximant, kAspirate
};
// clang-format on

enum class LipClosure : std::uint8_t { kNone, kLipToLip, kLipToTeeth };

/// Italian vowels as the network's merged answers tell them apart (VOCAL 4.3).
enum class VowelGroup : std::uint8_t { kA, kEI, kOU };

/// What is known of a viseme: the one place to write it.
struct VisemeRow {
  Viseme viseme;
  std::string_view name;
  double open;   ///< jaw and lips: 0 closed, 1 as wide as Ah
  double round;  ///< -1 spread, 1 narrow and round
  LipClosure closure = LipClosure::kNone;
  bool sibilant = false;               ///< teeth together
  bool tongue_only = false;            ///< lips and jaw are free for the neighbours
  std::optional<VowelGroup> vowels{};  ///< of a vowel that the network tells apart
  std::array<Viseme, 2> kin{};         ///< whose mean it looks like where nobody has shown it; two kSil: none
};
const VisemeRow& rowOf(Viseme viseme);

/// Each in [0, 1]; all zero is rest.
struct TongueTarget {
  float tip_up = 0;       ///< tip to the ridge behind the upper teeth
  float tip_forward = 0;  ///< tip between the teeth
  float back_up = 0;      ///< back to the palate
};

/// What is known of a phone, in any language: the one place to write it. How a language spells it and how its
/// recogniser hears it stands in the language (language.h).
struct PhoneRow {
  Phone phone;
  std::string_view name;         ///< "sil", "AA", ..., "ZH"
  std::string_view other_names;  ///< of other ARPAbets, in capitals, with blanks between them
  Articulation manner;
  bool voiced;
  Viseme first;  ///< the class that it starts in (EY: Eh, AW: Ah)
  Viseme last;   ///< the one it ends in (EY: Ee, AW: Oo); the same for most
  TongueTarget tongue{};
  float lips_parting = 0.4F;  ///< how far the lips are kept from touching, 0 to 1
  bool lip_heavy = false;     ///< its lips reach over its neighbours (JALI)
  bool turbulent = false;     ///< one of the fricatives and plosives whose energy VOCAL 4.2 looks at
  bool fleeting = false;      ///< a movement that nobody holds, in singing too
};
const PhoneRow& rowOf(Phone phone);

inline std::string_view phoneName(Phone phone) { return rowOf(phone).name; }
/// Accepts any case, a stress digit after a vowel ("AH0"), and the names of Festival, TIMIT and HTK ("ax" is kAH, "pau"
/// kSil). nullopt for an unknown symbol.
std::optional<Phone> phoneFromName(std::string_view name);
/// The stress digit at the end of a vowel's name ("AH0"), if there is one.
std::optional<int> stressOfName(std::string_view name);
/// Whether a label file means silence by this: "", sil, sp, pau, <eps>, h#, ... in any case.
bool isSilenceName(std::string_view name);
/// The stop whose closure TIMIT writes apart from its burst by this name: "bcl" is kB.
std::optional<Phone> closedStop(std::string_view name);
/// TIMIT's q, X-SAMPA's ? and IPA's ʔ: no phone of its own.
bool isGlottalStop(std::string_view name);
/// Whether `word` is one of the words of `list`, which have blanks between them.
bool isWordOf(std::string_view list, std::string_view word);

inline Viseme firstViseme(Phone phone) { return rowOf(phone).first; }
inline Viseme lastViseme(Phone phone) { return rowOf(phone).last; }
inline std::string_view visemeName(Viseme viseme) { return rowOf(viseme).name; }

inline bool isVowel(Phone phone) { return rowOf(phone).manner == Articulation::kVowel; }
inline bool isDiphthong(Phone phone) { return firstViseme(phone) != lastViseme(phone); }
inline bool isNasal(Phone phone) { return rowOf(phone).manner == Articulation::kNasal; }
inline LipClosure lipClosure(Phone phone) { return rowOf(firstViseme(phone)).closure; }
inline bool isBilabial(Phone phone) { return lipClosure(phone) == LipClosure::kLipToLip; }
inline bool isLabiodental(Phone phone) { return lipClosure(phone) == LipClosure::kLipToTeeth; }
/// Plosives, and affricates, which open with one.
inline bool isStop(Phone phone) {
  return rowOf(phone).manner == Articulation::kPlosive || rowOf(phone).manner == Articulation::kAffricate;
}

}  // namespace mouthpiece
