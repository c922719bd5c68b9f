#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "base/errors.h"
#include "base/files.h"
#include "base/index.h"
#include "base/text_encoding.h"
#include "base/text_numbers.h"
#include "phonetics/labels/label_entries.h"
#include "phonetics/labels/textgrid.h"

namespace mouthpiece {
namespace {

constexpr std::uint64_t kMaxTextGridBytes = std::uint64_t{64} << 20U;

/// Praat's rule for its text files, which makes long and short text one format: what stands free and is a number, a
/// "string" or a <flag> counts; every other word, and a ! comment, is decoration.
class PraatTokens {
 public:
  PraatTokens(std::string_view text, std::string_view file) : text_(text), file_(file) {}

  [[nodiscard]] std::string line() const { return std::to_string(line_); }

  double number(std::string_view what) {
    while (true) {
      if (const auto value = parseNumber(nextWord(what))) return *value;
    }
  }

  std::size_t count(std::string_view what) {
    const double value = number(what);
    // An interval takes at least three characters a number: more than bytes in the file is a lie.
    if (!(value >= 0) || value != std::floor(value) || value > asReal(text_.size())) {
      throw InputError(file_, line(),
                       fmt::format("found {} for {}; expected a count that the file can hold", value, what));
    }
    return static_cast<std::size_t>(value);
  }

  std::string string(std::string_view what) {
    while (skipToWord()) {
      if (text_[at_] == '"') return takeString();
      const std::string_view word = takeWord();
      if (parseNumber(word)) fail(what, fmt::format("the number {}", printable(word)));
    }
    fail(what, "the end of the file");
  }

  std::string_view flag(std::string_view what) {
    while (true) {
      if (const std::string_view word = nextWord(what); word.starts_with('<')) return word;
    }
  }

 private:
  [[noreturn]] void fail(std::string_view expected, std::string_view found) const {
    throw InputError(file_, line(), fmt::format("found {}; expected {}", found, expected));
  }

  std::string_view nextWord(std::string_view what) {
    if (!skipToWord()) fail(what, "the end of the file");
    if (text_[at_] == '"') fail(what, "a string");
    return takeWord();
  }

  static bool isSpace(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }

  /// Moves over blanks and comments; false at the end.
  bool skipToWord() {
    while (at_ < text_.size() && (isSpace(text_[at_]) || text_[at_] == '!')) {
      if (text_[at_] == '!') {
        at_ = std::min(text_.find('\n', at_), text_.size());
      } else {
        if (text_[at_] == '\n') ++line_;
        ++at_;
      }
    }
    return at_ < text_.size();
  }

  std::string_view takeWord() {
    const std::size_t begin = at_;
    while (at_ < text_.size() && !isSpace(text_[at_])) ++at_;
    return text_.substr(begin, at_ - begin);
  }

  std::string takeString() {
    const std::string opened_at = line();
    std::string value;
    for (++at_; at_ < text_.size(); ++at_) {
      if (text_[at_] == '\n') ++line_;
      if (text_[at_] == '"') {
        ++at_;
        if (at_ >= text_.size() || text_[at_] != '"') return value;  // a doubled quote stands for one
      }
      value += text_[at_];
    }
    throw InputError(file_, opened_at, "found a string without its closing quote");
  }

  std::string_view text_;
  std::string_view file_;
  std::size_t at_ = 0;
  std::size_t line_ = 1;
};

struct Tier {
  std::string name;
  bool has_intervals = false;
  std::vector<LabelEntry> entries;
  std::string place;
};

struct TextGrid {
  TimeSpan span;
  std::vector<Tier> tiers;
};

Tier readTier(PraatTokens& tokens, std::string_view file) {
  Tier tier;
  const std::string tier_class = tokens.string("a tier's class");
  tier.place = tokens.line();
  tier.has_intervals = tier_class == "IntervalTier";
  if (!tier.has_intervals && tier_class != "TextTier") {
    throw InputError(file, tier.place,
                     fmt::format("found tier class '{}'; expected IntervalTier or TextTier", printable(tier_class)));
  }
  tier.name = tokens.string("a tier's name");
  tokens.number("the tier's start");
  tokens.number("the tier's end");
  const std::size_t entry_count = tokens.count("the number of intervals");
  for (std::size_t i = 0; i < entry_count; ++i) {
    LabelEntry entry;
    entry.span.start = tokens.number("an interval's start");
    entry.place = tokens.line();
    entry.span.end = tier.has_intervals ? tokens.number("an interval's end") : entry.span.start;
    entry.text = tokens.string("an interval's text");
    tier.entries.push_back(std::move(entry));
  }
  return tier;
}

TextGrid readTiers(std::string_view text, std::string_view file) {
  PraatTokens tokens(text, file);
  const std::string kind = tokens.string("\"ooTextFile\"");
  if (kind == "Praat chronological TextGrid text file") {
    throw InputError(file, "1", "is a chronological TextGrid; expected one saved as (long or short) text file");
  }
  if (kind != "ooTextFile" || tokens.string("\"TextGrid\"") != "TextGrid") {
    throw InputError(file, tokens.line(),
                     "is no TextGrid; expected File type \"ooTextFile\", Object class \"TextGrid\"");
  }
  TextGrid grid;
  grid.span.start = tokens.number("the start time");
  grid.span.end = tokens.number("the end time");
  constexpr Seconds kShortest = 0.001;
  const bool is_finite = std::isfinite(grid.span.start) && std::isfinite(grid.span.end);
  if (!is_finite || !(grid.span.duration() >= kShortest && grid.span.duration() <= kLatestLabel)) {
    throw InputError(file, tokens.line(),
                     fmt::format("runs from {} to {} s; expected {} s to {} s, forwards", grid.span.start,
                                 grid.span.end, kShortest, kLatestLabel));
  }
  if (tokens.flag("<exists>") != "<exists>") throw InputError(file, tokens.line(), "has no tiers");
  const std::size_t tier_count = tokens.count("the number of tiers");
  for (std::size_t i = 0; i < tier_count; ++i) grid.tiers.push_back(readTier(tokens, file));
  return grid;
}

/// The tier with one of these names, or with "SPEAKER - " before it (Montreal Forced Aligner). nullptr when there is
/// none.
const Tier* findTier(const TextGrid& grid, std::string_view file, std::initializer_list<std::string_view> names) {
  const Tier* found = nullptr;
  for (const Tier& tier : grid.tiers) {
    std::string name = lowerCase(tier.name);
    if (const auto dash = name.rfind(" - "); dash != std::string::npos) name.erase(0, dash + 3);
    if (std::find(names.begin(), names.end(), name) == names.end()) continue;
    if (!tier.has_intervals) {
      throw InputError(file, tier.place,
                       fmt::format("tier '{}' holds points; expected intervals", printable(tier.name)));
    }
    if (found != nullptr) {
      throw InputError(file, tier.place,
                       fmt::format("found two such tiers, '{}' and '{}'; expected one speaker", printable(found->name),
                                   printable(tier.name)));
    }
    found = &tier;
  }
  return found;
}

std::vector<LabelEntry> entriesFromStart(const Tier& tier, Seconds start) {
  std::vector<LabelEntry> entries = tier.entries;
  for (LabelEntry& entry : entries) entry.span = {entry.span.start - start, entry.span.end - start};
  return entries;
}

/// A `syllables` tier has an interval a syllable with its stress as text; silence is empty. Phones outside one, and
/// files whose tier says anything else, keep what their phones say.
void takeSyllables(const Tier& tier, const TextGrid& grid, std::string_view file, std::vector<PhoneSegment>& phones) {
  const auto entries = entriesFromStart(tier, grid.span.start);
  const bool is_ours = std::all_of(entries.begin(), entries.end(), [](const LabelEntry& entry) {
    return isSilenceName(entry.text) || entry.text == "0" || entry.text == "1" || entry.text == "2";
  });
  if (!is_ours) return;
  const auto syllables = wordsFromEntries(file, entries);
  std::size_t s = 0;
  for (PhoneSegment& phone : phones) {
    while (s < syllables.size() && syllables[s].span.end <= phone.span.middle()) ++s;
    if (s == syllables.size() || !syllables[s].span.contains(phone.span.middle()) || phone.phone == Phone::kSil)
      continue;
    phone.syllable = s;
    phone.stress = syllables[s].text[0] - '0';
  }
}

TextGrid tiersIn(std::string_view bytes, std::string_view name) {
  if (bytes.starts_with("ooBinaryFile")) throw InputError(name, "", "is a binary TextGrid; expected one saved as text");
  return readTiers(decodeText(bytes, name), name);
}

const Tier* phonesOf(const TextGrid& grid, std::string_view file) {
  return findTier(grid, file, {"phones", "phonemes", "phone", "segments", "mau"});
}

const Tier* wordsOf(const TextGrid& grid, std::string_view file) {
  return findTier(grid, file, {"words", "word", "ort-mau", "orthography"});
}

std::vector<std::string> namesOfTiers(const TextGrid& grid) {
  std::vector<std::string> names;
  for (const Tier& tier : grid.tiers) names.push_back(printable(tier.name));
  return names;
}

}  // namespace

std::vector<std::string> tierNames(std::string_view bytes, std::string_view name) {
  return namesOfTiers(tiersIn(bytes, name));
}

bool isTextGrid(std::string_view bytes) {
  if (!kindOfNoText(bytes).empty()) return false;
  const std::string start = decodeText(bytes.substr(0, 64), "");
  constexpr std::array<std::string_view, 4> kSigns{"File type", "ooTextFile", "ooBinaryFile", "Praat"};
  return std::any_of(kSigns.begin(), kSigns.end(),
                     [&](std::string_view sign) { return start.find(sign) != std::string::npos; });
}

LabelTiers parseTextGridTiers(std::string_view bytes, std::string_view name) {
  const TextGrid grid = tiersIn(bytes, name);
  LabelTiers tiers;
  if (const Tier* words = wordsOf(grid, name)) tiers.words = entriesFromStart(*words, grid.span.start);
  if (const Tier* phones = phonesOf(grid, name)) tiers.phones = entriesFromStart(*phones, grid.span.start);
  return tiers;
}

SpeechLabels parseTextGrid(std::string_view bytes, std::string_view name, const Language& language) {
  const TextGrid grid = tiersIn(bytes, name);
  const Tier* phone_tier = phonesOf(grid, name);
  if (phone_tier == nullptr) {
    throw InputError(name, "",
                     fmt::format("has tiers [{}]; expected one named phones", fmt::join(namesOfTiers(grid), ", ")));
  }
  auto phones = phonesFromEntries(name, entriesFromStart(*phone_tier, grid.span.start), language);
  if (const Tier* tier = findTier(grid, name, {"syllables"})) takeSyllables(*tier, grid, name, phones);
  std::vector<WordSegment> words;
  if (const Tier* tier = wordsOf(grid, name)) words = wordsFromEntries(name, entriesFromStart(*tier, grid.span.start));
  return buildSpeechLabels(std::move(phones), words, grid.span.duration(), language);
}

SpeechLabels readTextGrid(const std::filesystem::path& path, const Language& language) {
  return parseTextGrid(readFile(path, kMaxTextGridBytes), path.string(), language);
}

}  // namespace mouthpiece
