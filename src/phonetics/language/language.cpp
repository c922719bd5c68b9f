#include "phonetics/labels/phone_sets.h"

#include <algorithm>
#include <array>
#include <utility>

#include "phonetics/labels/labels_builder.h"

namespace mouthpiece {
namespace {

using Symbol = std::pair<std::string_view, Phone>;

/// Southern British and General American; r-coloured centring vowels take the vowel that the lips show.
constexpr std::array kIpaSymbols = {
    Symbol{"ɑ", Phone::kAA},  Symbol{"a", Phone::kAA},  Symbol{"æ", Phone::kAE},  Symbol{"ʌ", Phone::kAH},
    Symbol{"ə", Phone::kAH},  Symbol{"ɐ", Phone::kAH},  Symbol{"ɔ", Phone::kAO},  Symbol{"ɒ", Phone::kAO},
    Symbol{"aʊ", Phone::kAW}, Symbol{"aw", Phone::kAW}, Symbol{"aɪ", Phone::kAY}, Symbol{"aj", Phone::kAY},
    Symbol{"ɛ", Phone::kEH},  Symbol{"e", Phone::kEH},  Symbol{"eə", Phone::kEH}, Symbol{"ɛə", Phone::kEH},
    Symbol{"ɜ", Phone::kER},  Symbol{"ɝ", Phone::kER},  Symbol{"ɚ", Phone::kER},  Symbol{"eɪ", Phone::kEY},
    Symbol{"ej", Phone::kEY}, Symbol{"ɪ", Phone::kIH},  Symbol{"ɪə", Phone::kIH}, Symbol{"ɨ", Phone::kIH},
    Symbol{"i", Phone::kIY},  Symbol{"oʊ", Phone::kOW}, Symbol{"ow", Phone::kOW}, Symbol{"əʊ", Phone::kOW},
    Symbol{"əw", Phone::kOW}, Symbol{"o", Phone::kOW},  Symbol{"ɔɪ", Phone::kOY}, Symbol{"ɔj", Phone::kOY},
    Symbol{"ʊ", Phone::kUH},  Symbol{"ʊə", Phone::kUH}, Symbol{"u", Phone::kUW},  Symbol{"ʉ", Phone::kUW},
    Symbol{"b", Phone::kB},   Symbol{"bʲ", Phone::kB},  Symbol{"tʃ", Phone::kCH}, Symbol{"d", Phone::kD},
    Symbol{"ɾ", Phone::kD},   Symbol{"d̪", Phone::kDH},  Symbol{"dʲ", Phone::kD},  Symbol{"ð", Phone::kDH},
    Symbol{"f", Phone::kF},   Symbol{"fʲ", Phone::kF},  Symbol{"ɡ", Phone::kG},   Symbol{"g", Phone::kG},
    Symbol{"ɟ", Phone::kG},   Symbol{"h", Phone::kHH},  Symbol{"ç", Phone::kHH},  Symbol{"dʒ", Phone::kJH},
    Symbol{"k", Phone::kK},   Symbol{"c", Phone::kK},   Symbol{"l", Phone::kL},   Symbol{"ɫ", Phone::kL},
    Symbol{"ʎ", Phone::kL},   Symbol{"m", Phone::kM},   Symbol{"mʲ", Phone::kM},  Symbol{"ɱ", Phone::kM},
    Symbol{"n", Phone::kN},   Symbol{"ɲ", Phone::kN},   Symbol{"ŋ", Phone::kNG},  Symbol{"p", Phone::kP},
    Symbol{"pʲ", Phone::kP},  Symbol{"ɹ", Phone::kR},   Symbol{"r", Phone::kR},   Symbol{"ɻ", Phone::kR},
    Symbol{"s", Phone::kS},   Symbol{"ʃ", Phone::kSH},  Symbol{"t", Phone::kT},   Symbol{"tʲ", Phone::kT},
    Symbol{"t̪", Phone::kTH},  Symbol{"θ", Phone::kTH},  Symbol{"v", Phone::kV},   Symbol{"vʲ", Phone::kV},
    Symbol{"w", Phone::kW},   Symbol{"ʍ", Phone::kW},   Symbol{"j", Phone::kY},   Symbol{"z", Phone::kZ},
    Symbol{"ʒ", Phone::kZH},  Symbol{"tw", Phone::kT},
};

constexpr std::array kXSampaSymbols = {
    Symbol{"A", Phone::kAA},  Symbol{"a", Phone::kAA},  Symbol{"{", Phone::kAE},  Symbol{"V", Phone::kAH},
    Symbol{"@", Phone::kAH},  Symbol{"6", Phone::kAH},  Symbol{"O", Phone::kAO},  Symbol{"Q", Phone::kAO},
    Symbol{"aU", Phone::kAW}, Symbol{"aI", Phone::kAY}, Symbol{"E", Phone::kEH},  Symbol{"e", Phone::kEH},
    Symbol{"e@", Phone::kEH}, Symbol{"E@", Phone::kEH}, Symbol{"3", Phone::kER},  Symbol{"3`", Phone::kER},
    Symbol{"@`", Phone::kER}, Symbol{"eI", Phone::kEY}, Symbol{"I", Phone::kIH},  Symbol{"I@", Phone::kIH},
    Symbol{"1", Phone::kIH},  Symbol{"i", Phone::kIY},  Symbol{"oU", Phone::kOW}, Symbol{"@U", Phone::kOW},
    Symbol{"OI", Phone::kOY}, Symbol{"U", Phone::kUH},  Symbol{"U@", Phone::kUH}, Symbol{"u", Phone::kUW},
    Symbol{"b", Phone::kB},   Symbol{"tS", Phone::kCH}, Symbol{"d", Phone::kD},   Symbol{"4", Phone::kD},
    Symbol{"D", Phone::kDH},  Symbol{"f", Phone::kF},   Symbol{"g", Phone::kG},   Symbol{"h", Phone::kHH},
    Symbol{"dZ", Phone::kJH}, Symbol{"k", Phone::kK},   Symbol{"l", Phone::kL},   Symbol{"5", Phone::kL},
    Symbol{"m", Phone::kM},   Symbol{"n", Phone::kN},   Symbol{"N", Phone::kNG},  Symbol{"p", Phone::kP},
    Symbol{"r", Phone::kR},   Symbol{"r\\", Phone::kR}, Symbol{"s", Phone::kS},   Symbol{"S", Phone::kSH},
    Symbol{"t", Phone::kT},   Symbol{"T", Phone::kTH},  Symbol{"v", Phone::kV},   Symbol{"w", Phone::kW},
    Symbol{"W", Phone::kW},   Symbol{"j", Phone::kY},   Symbol{"z", Phone::kZ},   Symbol{"Z", Phone::kZH},
};

constexpr std::array<std::string_view, 12> kIpaMarks = {"ː", "ˑ", "ˈ", "ˌ", "ʰ", "ʷ", "̩", "̃", "͡", "̚", "̯", "̥"};
constexpr std::array<std::string_view, 6> kXSampaMarks = {":", "\"", "%", "_h", "=", "_="};

template <std::size_t count>
std::string without(std::string_view name, const std::array<std::string_view, count>& marks) {
  std::string bare(name);
  for (const std::string_view mark : marks) {
    for (auto at = bare.find(mark); at != std::string::npos; at = bare.find(mark)) bare.erase(at, mark.size());
  }
  return bare;
}

template <std::size_t count>
std::optional<Phone> findIn(const std::array<Symbol, count>& symbols, std::string_view name) {
  const auto found = std::find_if(symbols.begin(), symbols.end(), [&](const Symbol& s) { return s.first == name; });
  return found == symbols.end() ? std::nullopt : std::optional(found->second);
}

bool isGlottalStop(std::string_view name) { return name == "q" || name == "ʔ" || name == "?"; }

/// Kaldi marks where in its word a phone stands: "AH0_B".
std::string_view withoutWordPosition(std::string_view name) {
  for (const std::string_view suffix : {"_B", "_I", "_E", "_S"}) {
    if (name.size() > suffix.size() && name.ends_with(suffix)) return name.substr(0, name.size() - suffix.size());
  }
  return name;
}

}  // namespace

std::string_view phoneSetName(PhoneSet set) {
  if (set == PhoneSet::kArpabet) return "ARPAbet";
  return set == PhoneSet::kXSampa ? "X-SAMPA" : "IPA";
}

std::optional<Phone> phoneFromName(std::string_view name, PhoneSet set) {
  if (set == PhoneSet::kArpabet) return phoneFromName(withoutWordPosition(name));
  if (isSilenceName(name)) return Phone::kSil;
  return set == PhoneSet::kIpa ? findIn(kIpaSymbols, without(name, kIpaMarks))
                               : findIn(kXSampaSymbols, without(name, kXSampaMarks));
}

PhoneSet likeliestPhoneSet(std::span<const std::string> names) {
  // TIMIT writes the closures of stops apart; whoever reads the labels knows them.
  constexpr std::array<std::string_view, 6> kClosures = {"bcl", "dcl", "gcl", "pcl", "tcl", "kcl"};
  const auto known = [&](PhoneSet set) {
    return std::count_if(names.begin(), names.end(), [&](const std::string& name) {
      const bool is_closure =
          set == PhoneSet::kArpabet && std::find(kClosures.begin(), kClosures.end(), name) != kClosures.end();
      return is_closure || isSilenceName(name) || isGlottalStop(name) || phoneFromName(name, set).has_value();
    });
  };
  PhoneSet best = PhoneSet::kArpabet;
  for (const PhoneSet set : {PhoneSet::kXSampa, PhoneSet::kIpa}) {
    if (known(set) > known(best)) best = set;
  }
  return best;
}

}  // namespace mouthpiece
