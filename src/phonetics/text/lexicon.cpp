#include "phonetics/text/lexicon.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "base/errors.h"
#include "base/files.h"
#include "base/index.h"
#include "base/text_encoding.h"
#include "base/unicode.h"

namespace mouthpiece {
namespace {

constexpr std::uint64_t kMaxLexiconBytes = std::uint64_t{256} << 20U;

std::string upperCase(std::string_view text) {
  std::string upper(text);
  std::transform(upper.begin(), upper.end(), upper.begin(),
                 [](char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c; });
  return upper;
}

std::string_view takeField(std::string_view& line) {
  constexpr std::string_view kBlanks = " \t\r";
  line.remove_prefix(std::min(line.find_first_not_of(kBlanks), line.size()));
  const std::string_view field = line.substr(0, line.find_first_of(kBlanks));
  line.remove_prefix(field.size());
  return field;
}

/// "four(2)" -> "four"; anything else as it is.
std::string_view withoutVariant(std::string_view word) {
  const std::size_t open = word.rfind('(');
  if (open == 0 || open == std::string_view::npos || !word.ends_with(')') || open + 2 >= word.size()) return word;
  const std::string_view digits = word.substr(open + 1, word.size() - open - 2);
  const bool is_number = std::all_of(digits.begin(), digits.end(), [](char c) { return c >= '0' && c <= '9'; });
  return is_number ? word.substr(0, open) : word;
}

/// A symbol, or a row of them, of IPA or X-SAMPA; false where one is unknown. Stress goes to the next vowel.
bool addSymbol(Pronunciation& pronunciation, std::string_view name, PhoneSet set, const Language& language,
               int& stress) {
  std::vector<std::string> unknown;
  const std::vector<SpelledPhone> phones = phonesOfSymbol(name, set, language, unknown);
  const std::string ipa = set == PhoneSet::kXSampa ? ipaFromXSampa(name) : std::string(name);
  if (ipa == "ˈ" || ipa == "ˌ") {
    stress = ipa == "ˈ" ? 1 : 2;
    return true;
  }
  if (phones.empty() || !unknown.empty()) return false;
  if (ipa.starts_with("ˈ") || ipa.starts_with("ˌ")) stress = ipa.starts_with("ˈ") ? 1 : 2;
  for (const SpelledPhone& phone : phones) {
    if (phone.phone == Phone::kSil) return false;
    if (phone.stress != 0) stress = phone.stress;
    pronunciation.phones.push_back(phone.phone);
    pronunciation.heard.push_back(phone.heard);
    pronunciation.ipa.push_back(phone.ipa);
    pronunciation.stress.push_back(isVowel(phone.phone) && stress != 0 ? std::exchange(stress, 0) : -1);
  }
  return true;
}

/// What the first comments say, else what most symbols are.
PhoneSet phoneSetOf(std::string_view text, const Language& language) {
  std::vector<std::string> names;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    const std::string_view word = takeField(line);
    if (word.starts_with('#') || word.starts_with(";;;")) {
      const std::string said = lowerCase(std::string(word) + std::string(line));
      const std::size_t at = said.find("phones:");
      if (at == std::string::npos) continue;
      if (said.find("x-sampa", at) != std::string::npos) return PhoneSet::kXSampa;
      if (said.find("ipa", at) != std::string::npos) return PhoneSet::kIpa;
      if (said.find("arpabet", at) != std::string::npos) return PhoneSet::kArpabet;
      continue;
    }
    for (auto name = takeField(line); !name.empty() && name != "#"; name = takeField(line)) names.emplace_back(name);
  }
  const auto is_ascii = [](const std::string& name) {
    return std::none_of(name.begin(), name.end(), [](char c) { return static_cast<unsigned char>(c) >= 0x80; });
  };
  if (std::all_of(names.begin(), names.end(), is_ascii)) return likeliestPhoneSet(names, language);
  return PhoneSet::kIpa;
}

Pronunciation parsePhones(std::string_view fields, std::string_view word, std::string_view file,
                          const std::string& line, PhoneSet set, const Language& language) {
  Pronunciation pronunciation;
  int stress = 0;  // a mark alone, or before the consonants of its syllable
  for (auto name = takeField(fields); !name.empty() && name != "#"; name = takeField(fields)) {
    const auto phone = phoneFromName(name);
    if (set != PhoneSet::kArpabet) {
      if (addSymbol(pronunciation, name, set, language, stress)) continue;
    }
    if (set != PhoneSet::kArpabet || !phone || *phone == Phone::kSil) {
      throw InputError(file, line,
                       fmt::format("found phone '{}' in '{}'; expected {}", printable(name), printable(word),
                                   set == PhoneSet::kArpabet ? "ARPAbet (AA AE AH ... ZH)" : phoneSetName(set)));
    }
    pronunciation.phones.push_back(*phone);
    pronunciation.stress.push_back(stressOfName(name).value_or(-1));
  }
  if (pronunciation.phones.empty()) {
    throw InputError(file, line, fmt::format("found '{}' alone; expected a word and its phones", printable(word)));
  }
  return pronunciation;
}

}  // namespace

Lexicon Lexicon::read(const std::filesystem::path& path, const Language& language) {
  return parseAnySet(readFile(path, kMaxLexiconBytes), path.string(), language);
}

Lexicon Lexicon::parseAnySet(std::string_view bytes, std::string_view name, const Language& language) {
  const std::string text = decodeText(bytes, name);
  return parse(text, name, phoneSetOf(text, language), language);
}

Lexicon Lexicon::parse(std::string_view bytes, std::string_view name, PhoneSet set, const Language& language) {
  const std::string decoded = decodeText(bytes, name);
  std::string_view text = decoded;
  Lexicon lexicon;
  for (std::size_t number = 1; !text.empty(); ++number) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    std::string_view word = takeField(line);
    if (word.size() > 1 && word.ends_with(':')) word.remove_suffix(1);  // "Nguyen: W IH N"
    if (word.empty() || word.starts_with('#') || word.starts_with(";;;")) continue;
    Pronunciation pronunciation = parsePhones(line, word, name, std::to_string(number), set, language);
    lexicon.words_[toNfc(withoutVariant(word))].push_back(std::move(pronunciation));
  }
  if (lexicon.words_.empty()) throw InputError(name, "", "holds no words; expected lines of a word and its phones");
  return lexicon;
}

std::string Lexicon::keyOf(std::string_view as_written) const {
  const std::string word = toNfc(as_written);
  auto found = words_.find(word);
  if (found == words_.end()) found = words_.find(toLower(word));
  if (found == words_.end() && word.size() > 1) found = words_.find(upperCase(word));
  return found == words_.end() ? "" : found->first;
}

const std::vector<Pronunciation>& Lexicon::find(std::string_view word) const {
  static const std::vector<Pronunciation> kUnknown;
  const auto found = words_.find(keyOf(word));
  return found == words_.end() ? kUnknown : found->second;
}

void Lexicon::putFirst(std::string_view word, std::size_t way) {
  const auto found = words_.find(keyOf(word));
  if (found == words_.end() || way >= found->second.size()) return;
  const auto place = found->second.begin() + signedIndex(way);
  std::rotate(found->second.begin(), place, place + 1);
}

}  // namespace mouthpiece
