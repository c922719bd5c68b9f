#include <fmt/format.h>

#include <iterator>
#include <vector>

#include "base/files.h"
#include "phonetics/labels/textgrid.h"

namespace mouthpiece {
namespace {

struct Interval {
  TimeSpan span;
  std::string text;
};

/// Ranges of phones with their text, empty intervals between them: Praat's tiers have no gaps.
template <typename Items, typename TextOf>
std::vector<Interval> intervalsOf(const SpeechLabels& labels, const Items& items, TextOf text_of) {
  std::vector<Interval> intervals;
  Seconds end = 0;
  for (const auto& item : items) {
    const TimeSpan span = labels.spanOf(item.phones);
    if (span.start > end) intervals.push_back({{end, span.start}, ""});
    intervals.push_back({{span.start, span.end}, text_of(item)});
    end = span.end;
  }
  if (labels.duration() > end) intervals.push_back({{end, labels.duration()}, ""});
  return intervals;
}

std::vector<Interval> phoneIntervals(const SpeechLabels& labels) {
  std::vector<Interval> intervals;
  if (labels.phones.empty()) return intervals;
  if (labels.phones.front().span.start > 0) intervals.push_back({{0, labels.phones.front().span.start}, ""});
  for (const LabelledPhone& phone : labels.phones) {
    intervals.push_back({phone.span, std::string(phoneName(phone.phone))});
  }
  return intervals;
}

std::string praatString(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"') out += '"';
    out += c;
  }
  return out + "\"";
}

void appendTier(std::string& out, std::size_t number, std::string_view name, const std::vector<Interval>& intervals,
                Seconds duration) {
  auto to = std::back_inserter(out);
  fmt::format_to(to, "    item [{}]:\n        class = \"IntervalTier\"\n        name = \"{}\"\n", number, name);
  fmt::format_to(to, "        xmin = 0\n        xmax = {}\n        intervals: size = {}\n", duration, intervals.size());
  for (std::size_t i = 0; i < intervals.size(); ++i) {
    fmt::format_to(to, "        intervals [{}]:\n            xmin = {}\n            xmax = {}\n            text = {}\n",
                   i + 1, intervals[i].span.start, intervals[i].span.end, praatString(intervals[i].text));
  }
}

}  // namespace

std::string formatTextGrid(const SpeechLabels& labels) {
  const Seconds duration = labels.duration();
  std::string out = "File type = \"ooTextFile\"\nObject class = \"TextGrid\"\n\n";
  fmt::format_to(std::back_inserter(out), "xmin = 0\nxmax = {}\ntiers? <exists>\nsize = 3\nitem []:\n", duration);
  const auto text = [](const LabelledWord& word) { return word.text; };
  const auto stress = [](const LabelledSyllable& syllable) { return std::to_string(syllable.stress); };
  appendTier(out, 1, "words", intervalsOf(labels, labels.words, text), duration);
  appendTier(out, 2, "phones", phoneIntervals(labels), duration);
  appendTier(out, 3, "syllables", intervalsOf(labels, labels.syllables, stress), duration);
  return out;
}

void writeTextGrid(const std::filesystem::path& path, const SpeechLabels& labels) {
  writeFileAtomically(path, formatTextGrid(labels));
}

}  // namespace mouthpiece
