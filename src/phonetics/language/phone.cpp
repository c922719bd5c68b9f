#include "phonetics/language/phone.h"

#include <algorithm>
#include <string>

#include "base/errors.h"

namespace mouthpiece {
namespace {

using V = Viseme;
using enum Phone;
using enum Articulation;

constexpr std::array<VisemeRow, kVisemeCount> kVisemes = {{
    {.viseme = V::kSil, .name = "sil", .open = 0, .round = 0},
    {.viseme = V::kAh, .name = "Ah", .open = 1, .round = 0, .vowels = VowelGroup::kA},
    {.viseme = V::kEh, .name = "Eh", .open = 0.7, .round = -0.5, .vowels = VowelGroup::kEI},
    {.viseme = V::kEe, .name = "Ee", .open = 0.35, .round = -1, .vowels = VowelGroup::kEI},
    {.viseme = V::kIh, .name = "Ih", .open = 0.45, .round = -0.4, .vowels = VowelGroup::kEI},
    {.viseme = V::kOh, .name = "Oh", .open = 0.7, .round = 0.7, .vowels = VowelGroup::kOU},
    {.viseme = V::kOo, .name = "Oo", .open = 0.3, .round = 1, .vowels = VowelGroup::kOU},
    {.viseme = V::kUh, .name = "Uh", .open = 0.5, .round = 0},
    {.viseme = V::kEr, .name = "Er", .open = 0.4, .round = 0.4, .kin = {V::kR, V::kUh}},
    {.viseme = V::kR, .name = "R", .open = 0.3, .round = 0.5},
    {.viseme = V::kW, .name = "W", .open = 0.2, .round = 1},
    {.viseme = V::kY, .name = "Y", .open = 0.3, .round = -0.7, .kin = {V::kEe, V::kEe}},
    {.viseme = V::kMBP, .name = "MBP", .open = 0, .round = 0, .closure = LipClosure::kLipToLip},
    {.viseme = V::kFV, .name = "FV", .open = 0.1, .round = 0, .closure = LipClosure::kLipToTeeth},
    {.viseme = V::kTh, .name = "Th", .open = 0.3, .round = -0.1},
    {.viseme = V::kLNTD, .name = "LNTD", .open = 0.3, .round = -0.2, .tongue_only = true},
    {.viseme = V::kS, .name = "S", .open = 0.15, .round = -0.3, .sibilant = true},
    {.viseme = V::kShChJ, .name = "ShChJ", .open = 0.2, .round = 0.7, .sibilant = true},
    {.viseme = V::kGK, .name = "GK", .open = 0.35, .round = -0.1, .tongue_only = true},
    {.viseme = V::kH, .name = "H", .open = 0.5, .round = -0.1},
}};

constexpr bool kVoiced = true, kVoiceless = false;
constexpr bool kHeavy = true, kLight = false;
constexpr bool kTurbulent = true, kQuiet = false;
constexpr bool kFleeting = true;
constexpr TongueTarget kRest, kRidge{1, 0, 0}, kBetweenTeeth{0.2F, 1, 0}, kVelar{0, 0, 1}, kHiss{0.7F, 0.1F, 0},
    kHush{0.6F, 0, 0.2F}, kBunched{0.4F, 0, 0.3F}, kHighFront{0.1F, 0.1F, 0.4F}, kMidFront{0.1F, 0.1F, 0.2F};
constexpr float kSealed = 0, kApart = 0.4F, kParted = 1;
constexpr std::string_view kSilenceNames = "SIL PAU SP SILENCE H# #H # EPI <SIL> <EPS> <P:> BRTH";

/// In the order of Phone; the classes are those of docs/theory/phonetics/phones_and_visemes.md. Names in other
/// ARPAbets: of Festival's `radio`, TIMIT, CMU with schwas, HTK. Schwas have one normal form, so that every corpus and
/// every voice spell a word alike.
constexpr std::array<PhoneRow, kPhoneCount> kPhones = {{
    {kSil, "sil", kSilenceNames, kSilence, kVoiceless, V::kSil, V::kSil, kRest, kSealed},
    {kAA, "AA", "", kVowel, kVoiced, V::kAh, V::kAh},
    {kAE, "AE", "", kVowel, kVoiced, V::kEh, V::kEh},
    {kAH, "AH", "AX AXH AX-H", kVowel, kVoiced, V::kUh, V::kUh},
    {kAO, "AO", "OH", kVowel, kVoiced, V::kOh, V::kOh},
    {kAW, "AW", "", kVowel, kVoiced, V::kAh, V::kOo},
    {kAY, "AY", "", kVowel, kVoiced, V::kAh, V::kEe},
    {kEH, "EH", "", kVowel, kVoiced, V::kEh, V::kEh},
    {kER, "ER", "AXR", kVowel, kVoiced, V::kEr, V::kEr, kBunched},
    {kEY, "EY", "", kVowel, kVoiced, V::kEh, V::kEe, kMidFront},
    {kIH, "IH", "IX", kVowel, kVoiced, V::kIh, V::kIh, kMidFront},
    {kIY, "IY", "", kVowel, kVoiced, V::kEe, V::kEe, kHighFront},
    {kOW, "OW", "", kVowel, kVoiced, V::kOh, V::kOo, kRest, kApart, kHeavy},
    {kOY, "OY", "", kVowel, kVoiced, V::kOh, V::kEe, kRest, kApart, kHeavy},
    {kUH, "UH", "", kVowel, kVoiced, V::kUh, V::kUh},
    {kUW, "UW", "UX", kVowel, kVoiced, V::kOo, V::kOo, kRest, kApart, kHeavy},
    {kB, "B", "", kPlosive, kVoiced, V::kMBP, V::kMBP, kRest, kSealed, kLight, kTurbulent},
    {kCH, "CH", "", kAffricate, kVoiceless, V::kShChJ, V::kShChJ, kHush, kApart, kHeavy, kTurbulent},
    {kD, "D", "DX", kPlosive, kVoiced, V::kLNTD, V::kLNTD, kRidge, kApart, kLight, kTurbulent},
    {kDH, "DH", "", kFricative, kVoiced, V::kTh, V::kTh, kBetweenTeeth, kParted},
    {kF, "F", "", kFricative, kVoiceless, V::kFV, V::kFV, kRest, kApart, kLight, kTurbulent},
    {kG, "G", "", kPlosive, kVoiced, V::kGK, V::kGK, kVelar, kApart, kLight, kTurbulent},
    {kHH, "HH", "HV H", kAspirate, kVoiceless, V::kH, V::kH, kRest, kApart, kLight, kQuiet, kFleeting},
    {kJH, "JH", "J", kAffricate, kVoiced, V::kShChJ, V::kShChJ, kHush, kApart, kHeavy, kTurbulent},
    {kK, "K", "", kPlosive, kVoiceless, V::kGK, V::kGK, kVelar, kApart, kLight, kTurbulent},
    {kL, "L", "EL", kLateral, kVoiced, V::kLNTD, V::kLNTD, kRidge, kApart, kLight, kQuiet, kFleeting},
    {kM, "M", "EM", kNasal, kVoiced, V::kMBP, V::kMBP, kRest, kSealed},
    {kN, "N", "EN NX", kNasal, kVoiced, V::kLNTD, V::kLNTD, kRidge},
    {kNG, "NG", "ENG", kNasal, kVoiced, V::kGK, V::kGK, kVelar},
    {kP, "P", "", kPlosive, kVoiceless, V::kMBP, V::kMBP, kRest, kSealed, kLight, kTurbulent},
    {kR, "R", "", kApproximant, kVoiced, V::kR, V::kR, kBunched, kApart, kLight, kQuiet, kFleeting},
    {kS, "S", "", kFricative, kVoiceless, V::kS, V::kS, kHiss, kApart, kLight, kTurbulent},
    {kSH, "SH", "", kFricative, kVoiceless, V::kShChJ, V::kShChJ, kHush, kApart, kHeavy, kTurbulent},
    {kT, "T", "", kPlosive, kVoiceless, V::kLNTD, V::kLNTD, kRidge, kApart, kLight, kTurbulent},
    {kTH, "TH", "", kFricative, kVoiceless, V::kTh, V::kTh, kBetweenTeeth, kParted},
    {kV, "V", "", kFricative, kVoiced, V::kFV, V::kFV, kRest, kApart, kLight, kTurbulent},
    {kW, "W", "", kApproximant, kVoiced, V::kW, V::kW, kRest, kApart, kHeavy, kQuiet, kFleeting},
    {kY, "Y", "", kApproximant, kVoiced, V::kY, V::kY, kHighFront, kApart, kLight, kQuiet, kFleeting},
    {kZ, "Z", "", kFricative, kVoiced, V::kS, V::kS, kHiss, kApart, kLight, kTurbulent},
    {kZH, "ZH", "", kFricative, kVoiced, V::kShChJ, V::kShChJ, kHush, kApart, kHeavy, kTurbulent},
}};

template <typename Rows, typename IdOf>
constexpr bool areInOrder(const Rows& rows, IdOf id_of) {
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (static_cast<std::size_t>(id_of(rows[i])) != i) return false;
  }
  return true;
}
static_assert(areInOrder(kPhones, [](const PhoneRow& row) { return row.phone; }));
static_assert(areInOrder(kVisemes, [](const VisemeRow& row) { return row.viseme; }));

std::optional<Phone> phoneFromUpperCase(std::string_view name) {
  const auto find = [](const auto& is_it) { return std::find_if(kPhones.begin(), kPhones.end(), is_it); };
  auto found = find([&](const PhoneRow& row) { return row.name == name; });
  if (found == kPhones.end()) found = find([&](const PhoneRow& row) { return isWordOf(row.other_names, name); });
  return found == kPhones.end() ? std::nullopt : std::optional(found->phone);
}

}  // namespace

const PhoneRow& rowOf(Phone phone) {
  const auto index = static_cast<std::size_t>(phone);
  MOUTHPIECE_EXPECT(index < kPhoneCount);
  return kPhones[index];
}

const VisemeRow& rowOf(Viseme viseme) {
  const auto index = static_cast<std::size_t>(viseme);
  MOUTHPIECE_EXPECT(index < kVisemeCount);
  return kVisemes[index];
}

bool isWordOf(std::string_view list, std::string_view word) {
  while (!list.empty()) {
    const std::size_t end = std::min(list.find(' '), list.size());
    if (list.substr(0, end) == word) return !word.empty();
    list.remove_prefix(std::min(end + 1, list.size()));
  }
  return false;
}

std::optional<Phone> phoneFromName(std::string_view name) {
  constexpr std::size_t kLongestName = 8;
  if (name.empty() || name.size() > kLongestName) return std::nullopt;
  std::string upper(name);
  std::transform(upper.begin(), upper.end(), upper.begin(),
                 [](char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c; });
  if (const auto phone = phoneFromUpperCase(upper)) return phone;
  if (upper.back() < '0' || upper.back() > '2') return std::nullopt;
  upper.pop_back();
  const auto phone = phoneFromUpperCase(upper);
  return phone && isVowel(*phone) ? phone : std::nullopt;
}

std::optional<int> stressOfName(std::string_view name) {
  if (name.empty() || name.back() < '0' || name.back() > '2') return std::nullopt;
  const auto phone = phoneFromName(name);
  return phone && isVowel(*phone) ? std::optional<int>(name.back() - '0') : std::nullopt;
}

bool isSilenceName(std::string_view name) {
  return name.empty() || name == "_" || name == "<s>" || name == "</s>" || phoneFromName(name) == Phone::kSil;
}

std::optional<Phone> closedStop(std::string_view name) {
  if (name.size() != 3 || !name.ends_with("cl") || name[0] < 'a') return std::nullopt;
  const auto stop = phoneFromName(name.substr(0, 1));
  return stop && rowOf(*stop).manner == Articulation::kPlosive ? stop : std::nullopt;
}

bool isGlottalStop(std::string_view name) { return name == "q" || name == "?" || name == "ʔ"; }

}  // namespace mouthpiece
