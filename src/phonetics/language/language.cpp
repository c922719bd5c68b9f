#include "phonetics/language/language.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>

#include "base/errors.h"
#include "base/text_encoding.h"

namespace mouthpiece {
namespace {

/// Adding a language: one more row.
const std::array kLanguages = {&english()};

constexpr std::array<std::string_view, 12> kIpaMarks = {"ː", "ˑ", "ˈ", "ˌ", "ʰ", "ʷ", "̩", "̃", "͡", "̚", "̯", "̥"};
constexpr std::array<std::string_view, 6> kXSampaMarks = {":", "\"", "%", "_h", "=", "_="};

std::string without(std::string_view name, std::span<const std::string_view> marks) {
  std::string bare(name);
  for (const std::string_view mark : marks) {
    for (auto at = bare.find(mark); at != std::string::npos; at = bare.find(mark)) bare.erase(at, mark.size());
  }
  return bare;
}

std::optional<Phone> findIn(const Language& language, std::string_view LanguagePhone::*names, std::string_view name) {
  const auto found = std::find_if(language.inventory.begin(), language.inventory.end(),
                                  [&](const LanguagePhone& phone) { return isWordOf(phone.*names, name); });
  return found == language.inventory.end() ? std::nullopt : std::optional(found->phone);
}

/// Kaldi marks where in its word a phone stands: "AH0_B".
std::string_view withoutWordPosition(std::string_view name) {
  for (const std::string_view suffix : {"_B", "_I", "_E", "_S"}) {
    if (name.size() > suffix.size() && name.ends_with(suffix)) return name.substr(0, name.size() - suffix.size());
  }
  return name;
}

}  // namespace

const LanguagePhone* Language::find(Phone phone) const {
  const auto found = std::find_if(inventory.begin(), inventory.end(),
                                  [&](const LanguagePhone& candidate) { return candidate.phone == phone; });
  return found == inventory.end() ? nullptr : &*found;
}

std::span<const Language* const> languages() { return kLanguages; }

const Language& languageOf(std::string_view tag) {
  const std::string wanted = lowerCase(tag);
  for (std::string_view part = wanted; !part.empty(); part = part.substr(0, part.rfind('-'))) {
    for (const Language* language : kLanguages) {
      if (lowerCase(language->tag) == part) return *language;
    }
    if (part.find('-') == std::string_view::npos) break;
  }
  std::vector<std::string_view> known;
  for (const Language* language : kLanguages) known.push_back(language->tag);
  throw InputError(fmt::format("found language '{}'; expected one of {}", printable(tag), fmt::join(known, ", ")));
}

std::string_view phoneSetName(PhoneSet set) {
  if (set == PhoneSet::kArpabet) return "ARPAbet";
  return set == PhoneSet::kXSampa ? "X-SAMPA" : "IPA";
}

std::optional<Phone> phoneFromName(std::string_view name, PhoneSet set, const Language& language) {
  if (set == PhoneSet::kArpabet) return phoneFromName(withoutWordPosition(name));
  if (isSilenceName(name)) return Phone::kSil;
  return set == PhoneSet::kIpa ? findIn(language, &LanguagePhone::ipa, without(name, kIpaMarks))
                               : findIn(language, &LanguagePhone::x_sampa, without(name, kXSampaMarks));
}

PhoneSet likeliestPhoneSet(std::span<const std::string> names, const Language& language) {
  const auto known = [&](PhoneSet set) {
    return std::count_if(names.begin(), names.end(), [&](const std::string& name) {
      const bool is_closure = set == PhoneSet::kArpabet && closedStop(name).has_value();
      return is_closure || isSilenceName(name) || isGlottalStop(name) || phoneFromName(name, set, language).has_value();
    });
  };
  PhoneSet best = PhoneSet::kArpabet;
  for (const PhoneSet set : {PhoneSet::kXSampa, PhoneSet::kIpa}) {
    if (known(set) > known(best)) best = set;
  }
  return best;
}

}  // namespace mouthpiece
