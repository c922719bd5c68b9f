#include "phonetics/language/language.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>

#include "base/errors.h"
#include "base/text_encoding.h"
#include "phonetics/language/espeak_languages.h"
#include "phonetics/language/language_tag.h"

namespace mouthpiece {
namespace {

/// Adding a language that eSpeak NG speaks: a row of espeak_languages.cpp. One with rules of its own: one more here.
const std::vector<const Language*>& ownLanguages() {
  static const std::vector<const Language*> kAll = [] {
    std::vector<const Language*> all = {&english()};
    for (const Language& language : espeakRows()) all.push_back(&language);
    all.push_back(&japanese());
    return all;
  }();
  return kAll;
}

/// Written otherwise by those who follow ISO 639-3 ("cmn"), or as was usual before: "iw", "in". Norwegian is Bokmål.
std::string usualTag(const std::string& lower_case) {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 4> kOther{
      {{"cmn", "zh"}, {"no", "nb"}, {"iw", "he"}, {"in", "id"}}};
  const std::string_view language = std::string_view(lower_case).substr(0, lower_case.find('-'));
  const auto* const other = std::ranges::find(kOther, language, &std::pair<std::string_view, std::string_view>::first);
  return other == kOther.end() ? lower_case : std::string(other->second) + lower_case.substr(language.size());
}

/// What else languages are called, in lower case; their own names in English are in their rows.
constexpr std::array<std::pair<std::string_view, std::string_view>, 10> kNames{{{"de", "deutsch"},
                                                                                {"es", "español espanol castellano"},
                                                                                {"fr", "français francais"},
                                                                                {"it", "italiano"},
                                                                                {"pt", "português portugues"},
                                                                                {"pt-BR", "brazilian"},
                                                                                {"pl", "polski"},
                                                                                {"nl", "nederlands flemish"},
                                                                                {"zh", "chinese 中文 汉语 漢語 普通话"},
                                                                                {"ja", "日本語 nihongo"}}};

const Language* languageNamed(const std::string& lower_case) {
  for (const Language* language : ownLanguages()) {
    const auto* const names =
        std::ranges::find(kNames, language->tag, &std::pair<std::string_view, std::string_view>::first);
    if (lowerCase(language->name) == lower_case || (names != kNames.end() && isWordOf(names->second, lower_case)))
      return language;
  }
  return nullptr;
}

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

std::span<const Language* const> languages() { return ownLanguages(); }

std::string plainTag(std::string_view tag) {
  std::string plain = lowerCase(tag.substr(0, tag.find_first_of(".@")));
  std::replace(plain.begin(), plain.end(), '_', '-');
  return plain;
}

const Language& languageOf(std::string_view tag) {
  if (const Language* named = languageNamed(lowerCase(tag))) return *named;
  const std::string wanted = usualTag(plainTag(tag));
  for (std::string_view part = wanted; !part.empty(); part = part.substr(0, part.rfind('-'))) {
    for (const Language* language : ownLanguages()) {
      if (lowerCase(language->tag) == part) return *language;
    }
    if (const Language* untuned = untunedLanguage(part)) return *untuned;
    if (part.find('-') == std::string_view::npos) break;
  }
  std::vector<std::string_view> known;
  for (const Language* language : ownLanguages()) known.push_back(language->tag);
  throw InputError(fmt::format("found language '{}'{}; expected one of {}, or another that eSpeak NG speaks",
                               printable(tag), isUnusable(wanted) ? ", of which eSpeak NG gives no usable phones" : "",
                               fmt::join(known, ", ")));
}

std::string_view phoneSetName(PhoneSet set) {
  if (set == PhoneSet::kArpabet) return "ARPAbet";
  return set == PhoneSet::kXSampa ? "X-SAMPA" : "IPA";
}

std::optional<Phone> phoneFromName(std::string_view name, PhoneSet set, const Language& language) {
  if (set == PhoneSet::kArpabet) return phoneFromName(withoutWordPosition(name));
  if (isSilenceName(name)) return Phone::kSil;
  const auto own = set == PhoneSet::kIpa ? findIn(language, &LanguagePhone::ipa, without(name, kIpaMarks))
                                         : findIn(language, &LanguagePhone::x_sampa, without(name, kXSampaMarks));
  return own;
}

namespace {

/// Whether the set writes a sound so: one letter with marks, an affricate or a diphthong.
bool isSymbolOf(PhoneSet set, std::string_view name, const Language& language) {
  if (phoneFromName(name, set, language)) return true;
  if (set == PhoneSet::kArpabet) return false;
  const bool is_ascii =
      std::all_of(name.begin(), name.end(), [](char c) { return static_cast<unsigned char>(c) < 0x80; });
  if (set == PhoneSet::kXSampa && !is_ascii) return false;
  const IpaReading reading = readIpa(set == PhoneSet::kXSampa ? ipaFromXSampa(name) : std::string(name));
  if (!reading.unknown.empty() || reading.sounds.empty() || reading.sounds.size() > 2) return false;
  return reading.sounds.size() == 1 || reading.sounds[0].opens_affricate ||
         (reading.sounds[0].isVowel() && reading.sounds[1].isVowel());
}

}  // namespace

PhoneSet likeliestPhoneSet(std::span<const std::string> names, const Language& language) {
  const auto known = [&](PhoneSet set) {
    return std::count_if(names.begin(), names.end(), [&](const std::string& name) {
      const bool is_closure = set == PhoneSet::kArpabet && closedStop(name).has_value();
      return is_closure || isSilenceName(name) || isGlottalStop(name) || isSymbolOf(set, name, language);
    });
  };
  PhoneSet best = PhoneSet::kArpabet;
  for (const PhoneSet set : {PhoneSet::kXSampa, PhoneSet::kIpa}) {
    if (known(set) > known(best)) best = set;
  }
  return best;
}

}  // namespace mouthpiece
