#include "phonetics/language/phone.h"

#include <algorithm>
#include <string>

#include "base/errors.h"

namespace mouthpiece {
namespace {

struct PhoneFacts {
  std::string_view name;
  Viseme first;
  Viseme last;
};

/// In the order of Phone; the classes are those of docs/theory/phones_and_visemes.md.
constexpr std::array<PhoneFacts, kPhoneCount> kPhones = {{
    {"sil", Viseme::kSil, Viseme::kSil},    {"AA", Viseme::kAh, Viseme::kAh},       {"AE", Viseme::kEh, Viseme::kEh},
    {"AH", Viseme::kUh, Viseme::kUh},       {"AO", Viseme::kOh, Viseme::kOh},       {"AW", Viseme::kAh, Viseme::kOo},
    {"AX", Viseme::kUh, Viseme::kUh},       {"AY", Viseme::kAh, Viseme::kEe},       {"EH", Viseme::kEh, Viseme::kEh},
    {"ER", Viseme::kEr, Viseme::kEr},       {"EY", Viseme::kEh, Viseme::kEe},       {"IH", Viseme::kIh, Viseme::kIh},
    {"IY", Viseme::kEe, Viseme::kEe},       {"OW", Viseme::kOh, Viseme::kOo},       {"OY", Viseme::kOh, Viseme::kEe},
    {"UH", Viseme::kUh, Viseme::kUh},       {"UW", Viseme::kOo, Viseme::kOo},       {"B", Viseme::kMBP, Viseme::kMBP},
    {"CH", Viseme::kShChJ, Viseme::kShChJ}, {"D", Viseme::kLNTD, Viseme::kLNTD},    {"DH", Viseme::kTh, Viseme::kTh},
    {"F", Viseme::kFV, Viseme::kFV},        {"G", Viseme::kGK, Viseme::kGK},        {"HH", Viseme::kH, Viseme::kH},
    {"JH", Viseme::kShChJ, Viseme::kShChJ}, {"K", Viseme::kGK, Viseme::kGK},        {"L", Viseme::kLNTD, Viseme::kLNTD},
    {"M", Viseme::kMBP, Viseme::kMBP},      {"N", Viseme::kLNTD, Viseme::kLNTD},    {"NG", Viseme::kGK, Viseme::kGK},
    {"P", Viseme::kMBP, Viseme::kMBP},      {"R", Viseme::kR, Viseme::kR},          {"S", Viseme::kS, Viseme::kS},
    {"SH", Viseme::kShChJ, Viseme::kShChJ}, {"T", Viseme::kLNTD, Viseme::kLNTD},    {"TH", Viseme::kTh, Viseme::kTh},
    {"V", Viseme::kFV, Viseme::kFV},        {"W", Viseme::kW, Viseme::kW},          {"Y", Viseme::kY, Viseme::kY},
    {"Z", Viseme::kS, Viseme::kS},          {"ZH", Viseme::kShChJ, Viseme::kShChJ},
}};

struct Alias {
  std::string_view name;
  Phone phone;
};

/// Names that other phone sets use for the same mouth: Festival's `radio`, TIMIT, CMU with schwas, HTK.
constexpr std::array kAliases = {
    // Schwas: one normal form, so that every corpus and every voice spell a word alike.
    Alias{"AX", Phone::kAH},     Alias{"AXH", Phone::kAH},    Alias{"AX-H", Phone::kAH},  Alias{"AXR", Phone::kER},
    Alias{"IX", Phone::kIH},     Alias{"UX", Phone::kUW},     Alias{"OH", Phone::kAO},    Alias{"EL", Phone::kL},
    Alias{"EM", Phone::kM},      Alias{"EN", Phone::kN},      Alias{"ENG", Phone::kNG},   Alias{"NX", Phone::kN},
    Alias{"DX", Phone::kD},      Alias{"HV", Phone::kHH},     Alias{"HH", Phone::kHH},    Alias{"H", Phone::kHH},
    Alias{"J", Phone::kJH},      Alias{"PAU", Phone::kSil},   Alias{"SP", Phone::kSil},   Alias{"SILENCE", Phone::kSil},
    Alias{"H#", Phone::kSil},    Alias{"#H", Phone::kSil},    Alias{"#", Phone::kSil},    Alias{"EPI", Phone::kSil},
    Alias{"<SIL>", Phone::kSil}, Alias{"<EPS>", Phone::kSil}, Alias{"<P:>", Phone::kSil}, Alias{"BRTH", Phone::kSil},
};

constexpr std::array<std::string_view, kVisemeCount> kVisemeNames = {"sil", "Ah",   "Eh", "Ee",    "Ih", "Oh",  "Oo",
                                                                     "Uh",  "Er",   "R",  "W",     "Y",  "MBP", "FV",
                                                                     "Th",  "LNTD", "S",  "ShChJ", "GK", "H"};

const PhoneFacts& factsOf(Phone phone) {
  const auto index = static_cast<std::size_t>(phone);
  MOUTHPIECE_EXPECT(index < kPhoneCount);
  return kPhones[index];
}

std::optional<Phone> phoneFromUpperCase(std::string_view name) {
  for (const Alias& alias : kAliases) {
    if (alias.name == name) return alias.phone;
  }
  if (name == "SIL") return Phone::kSil;
  for (std::size_t i = 1; i < kPhoneCount; ++i) {
    if (kPhones[i].name == name) return static_cast<Phone>(i);
  }
  return std::nullopt;
}

}  // namespace

std::string_view phoneName(Phone phone) { return factsOf(phone).name; }

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

bool isVowel(Phone phone) { return phone >= Phone::kAA && phone <= Phone::kUW; }

bool isBilabial(Phone phone) { return phone == Phone::kP || phone == Phone::kB || phone == Phone::kM; }

bool isLabiodental(Phone phone) { return phone == Phone::kF || phone == Phone::kV; }

bool isStop(Phone phone) {
  using enum Phone;
  return phone == kP || phone == kB || phone == kT || phone == kD || phone == kK || phone == kG || phone == kCH ||
         phone == kJH;
}

std::string_view visemeName(Viseme viseme) {
  const auto index = static_cast<std::size_t>(viseme);
  MOUTHPIECE_EXPECT(index < kVisemeCount);
  return kVisemeNames[index];
}

Viseme firstViseme(Phone phone) { return factsOf(phone).first; }

Viseme lastViseme(Phone phone) { return factsOf(phone).last; }

}  // namespace mouthpiece
