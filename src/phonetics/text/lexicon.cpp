#include "phonetics/text/lexicon.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/errors.h"
#include "base/index.h"
#include "base/files.h"
#include "base/text_encoding.h"

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

Pronunciation parsePhones(std::string_view fields, std::string_view word, std::string_view file,
                          const std::string& line, PhoneSet set, const Language& language) {
  Pronunciation pronunciation;
  for (auto name = takeField(fields); !name.empty() && name != "#"; name = takeField(fields)) {
    const auto phone = set == PhoneSet::kArpabet ? phoneFromName(name) : phoneFromName(name, set, language);
    if (!phone || *phone == Phone::kSil) {
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

Lexicon Lexicon::read(const std::filesystem::path& path) {
  return parse(readFile(path, kMaxLexiconBytes), path.string());
}

Lexicon Lexicon::parse(std::string_view bytes, std::string_view name, PhoneSet set, const Language& language) {
  const std::string decoded = decodeText(bytes, name);
  std::string_view text = decoded;
  Lexicon lexicon;
  for (std::size_t number = 1; !text.empty(); ++number) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    const std::string_view word = takeField(line);
    if (word.empty() || word.starts_with('#') || word.starts_with(";;;")) continue;
    Pronunciation pronunciation = parsePhones(line, word, name, std::to_string(number), set, language);
    lexicon.words_[std::string(withoutVariant(word))].push_back(std::move(pronunciation));
  }
  if (lexicon.words_.empty()) throw InputError(name, "", "holds no words; expected lines of a word and its phones");
  return lexicon;
}

std::string Lexicon::keyOf(std::string_view word) const {
  auto found = words_.find(word);
  if (found == words_.end()) found = words_.find(lowerCase(word));
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
