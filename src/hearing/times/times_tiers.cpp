// Words and phones side by side: TextGrids, phones of a CTM, and the Montreal Forced Aligner's JSON and CSV.
#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "base/errors.h"
#include "base/files.h"
#include "base/text_encoding.h"
#include "base/text_numbers.h"
#include "hearing/times/times_reader.h"
#include "phonetics/labels/label_entries.h"
#include "phonetics/labels/label_files.h"
#include "phonetics/labels/textgrid.h"

namespace mouthpiece {
namespace {

constexpr std::uint64_t kMostLabelBytes = std::uint64_t{64} << 20U;

TimesFile fromLabels(const SpeechLabels& labels, std::string kind) {
  TimesFile times;
  times.kind = std::move(kind);
  for (const LabelledWord& word : labels.words) times.words.push_back({word.text, labels.spanOf(word.phones), 1});
  for (const LabelledPhone& phone : labels.phones) {
    if (phone.phone == Phone::kSil) continue;
    times.phones.push_back(
        {.phone = phone.phone,
         .span = phone.span,
         .word = phone.word,
         .syllable = phone.syllable,
         .stress = phone.syllable ? std::optional(labels.syllables[*phone.syllable].stress) : std::nullopt,
         .ipa = phone.ipa});
  }
  return times;
}

/// What the aligner could not spell ("spn") and words that it did not keep ("<unk>") are left to our own.
TimesFile fromTiers(LabelTiers tiers, std::string kind, std::string_view name, const Language& language) {
  std::erase_if(tiers.phones, [](const LabelEntry& phone) { return phone.text == kUnspelledWord; });
  std::erase_if(tiers.words, [](const LabelEntry& word) { return word.text.starts_with('<'); });
  TimesBuilder builder(name, std::move(kind));
  const std::vector<WordSegment> words = wordsFromEntries(name, tiers.words);
  std::size_t next = 0;
  std::optional<TimeSpan> word;  // the last one, if it is said
  const auto addWordsUntil = [&](Seconds time) {
    for (; next < words.size() && words[next].span.start <= time; ++next) {
      const bool is_said = builder.addWord(words[next].text, words[next].span, "words");
      word = is_said ? std::optional(words[next].span) : std::nullopt;
    }
  };
  for (const PhoneSegment& phone : phonesFromEntries(name, tiers.phones, language)) {
    addWordsUntil(phone.span.middle());
    builder.addPhone(phone, "phones", word && word->contains(phone.span.middle()));
  }
  addWordsUntil(kLatestLabel);
  return builder.finish();
}

std::size_t countRows(std::string_view text) {
  std::size_t rows = 0;
  LineReader reader(text);
  for (std::string_view line; reader.next(line);) rows += trimmed(line).empty() || line.starts_with(";;") ? 0U : 1U;
  return rows;
}

}  // namespace

bool lacksPhones(const std::filesystem::path& labels) {
  const std::string bytes = readFile(labels, kMostLabelBytes);
  if (!isTextGrid(bytes)) return false;
  const LabelTiers tiers = parseTextGridTiers(bytes, labels.string());
  const auto is_unspelled = [](const LabelEntry& phone) { return phone.text == kUnspelledWord; };
  const bool are_missing = tiers.phones.empty() || std::ranges::any_of(tiers.phones, is_unspelled);
  return are_missing &&
         std::ranges::any_of(tiers.words, [](const LabelEntry& word) { return !isSilenceName(word.text); });
}

TimesFile parseTimedTextGrid(std::string_view bytes, std::string_view name, const Language& language) {
  LabelTiers tiers = parseTextGridTiers(bytes, name);
  if (tiers.words.empty() && tiers.phones.empty())
    throw InputError(
        name, "",
        fmt::format("has tiers [{}]; expected one named words, or phones", fmt::join(tierNames(bytes, name), ", ")));
  return fromTiers(std::move(tiers), "TextGrid", name, language);
}

TimesFile parseTiersJson(const JsonField& tiers, std::string_view name, const Language& language) {
  LabelTiers found;
  for (const auto& [key, tier] : tiers.members()) {
    const std::size_t dash = key.rfind(" - ");  // "SPEAKER - words"
    const std::string_view kind = std::string_view(key).substr(dash == std::string::npos ? 0 : dash + 3);
    if (kind != "words" && kind != "phones") continue;
    std::vector<LabelEntry>& entries = kind == "words" ? found.words : found.phones;
    if (!entries.empty()) tier.fail(fmt::format("is a second tier of {}; expected one speaker", kind));
    for (const JsonField& entry : tier["entries"].list()) {
      const std::vector<JsonField> fields = entry.list(3, 3);
      entries.push_back({fields[2].text(),
                         {fields[0].number(), fields[1].number()},
                         fmt::format("tiers.{}.entries[{}]", key, entries.size())});
    }
  }
  return fromTiers(std::move(found), "MFA JSON", name, language);
}

TimesFile parseTiersCsv(std::string_view text, std::string_view name, const Language& language) {
  LabelTiers found;
  LineReader reader(text);
  std::string speaker;
  std::vector<std::string_view> fields;
  for (std::string_view line; reader.next(line);) {
    if (trimmed(line).empty() || line.starts_with("Begin,End,")) continue;
    const std::string place = std::to_string(reader.lineNumber());
    splitFields(trimmed(line), ',', fields);
    if (fields.size() < 4 || fields.size() > 5)
      throw InputError(name, place,
                       fmt::format("found {} fields; expected Begin,End,Label,Type,Speaker", fields.size()));
    const auto start = parseNumber(fields[0]), end = parseNumber(fields[1]);
    if (!start || !end)
      throw InputError(name, place,
                       fmt::format("found '{}'; expected a time in seconds", printable(fields[start ? 1 : 0])));
    if (fields.size() == 5 && speaker.empty()) speaker = fields[4];
    if (fields.size() == 5 && fields[4] != speaker) {
      throw InputError(
          name, place,
          fmt::format("found the speaker '{}' after '{}'; expected one", printable(fields[4]), printable(speaker)));
    }
    if (fields[3] == "words" || fields[3] == "phones")
      (fields[3] == "words" ? found.words : found.phones).push_back({std::string(fields[2]), {*start, *end}, place});
  }
  return fromTiers(std::move(found), "MFA CSV", name, language);
}

/// Most Latin letters are signs of IPA: where phones had several sounds in every fourth row, they are words.
std::optional<TimesFile> parsePhoneCtm(std::string_view text, std::string_view name, const Language& language) {
  try {
    TimesFile phones = fromLabels(parseLabFile(text, name, {.language = &language}), "CTM of phones");
    if (4 * phones.phones.size() <= 5 * countRows(text)) return phones;
  } catch (const InputError&) {  // then it is words
  }
  return std::nullopt;
}

}  // namespace mouthpiece
