#include "phonetics/labels/label_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <iterator>
#include <optional>
#include <vector>

#include "base/errors.h"
#include "base/files.h"
#include "base/text_encoding.h"
#include "phonetics/labels/label_entries.h"
#include "phonetics/labels/textgrid.h"

namespace mouthpiece {
namespace {

/// The colour that Festival's own tools write; readers pass over it.
constexpr int kEspsColour = 121;

std::string withoutBlanks(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return std::isspace(c) != 0 || std::iscntrl(c) != 0; }, '_');
  return text.empty() ? "take" : text;
}

/// A line a phone.
std::string inLines(std::string head, const SpeechLabels& labels, const auto& line_of) {
  for (const LabelledPhone& phone : labels.phones) head += line_of(phone.span, phone.name()) + "\n";
  return head;
}

/// Times in whole units.
std::string inUnits(const SpeechLabels& labels, double units_per_second) {
  return inLines("", labels, [=](const TimeSpan& span, std::string_view name) {
    return fmt::format("{} {} {}", std::llround(span.start * units_per_second),
                       std::llround(span.end * units_per_second), name);
  });
}

std::string espsText(const SpeechLabels& labels) {
  return inLines("separator ;\nnfields 1\n#\n", labels, [](const TimeSpan& span, std::string_view name) {
    return fmt::format("    {:.6f}  {}  {}", span.end, kEspsColour, name);
  });
}

std::string ctmText(const SpeechLabels& labels, const std::string& take) {
  return inLines("", labels, [&](const TimeSpan& span, std::string_view name) {
    return fmt::format("{} 1 {:.6f} {:.6f} {}", take, span.start, span.duration(), name);
  });
}

std::string secondsText(const SpeechLabels& labels) {
  return inLines("", labels, [](const TimeSpan& span, std::string_view name) {
    return fmt::format("{:.6f} {:.6f} {}", span.start, span.end, name);
  });
}

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
    intervals.push_back({phone.span, std::string(phone.name())});
  }
  return intervals;
}

/// A number a phone; nothing in silence.
std::vector<Interval> confidenceIntervals(const SpeechLabels& labels, std::span<const double> confidence) {
  std::vector<Interval> intervals = phoneIntervals(labels);
  const std::size_t gap = intervals.size() - labels.phones.size();
  for (std::size_t i = 0; i < labels.phones.size(); ++i) {
    const bool is_silent = labels.phones[i].phone == Phone::kSil;
    intervals[gap + i].text = is_silent ? "" : fmt::format("{:.2f}", confidence[i]);
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

/// Of a long text the values alone, one a line.
std::string shortened(std::string_view text) {
  std::string out = "File type = \"ooTextFile\"\nObject class = \"TextGrid\"\n\n";
  std::size_t line_number = 0;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    if (++line_number <= 2) continue;
    if (line.starts_with("tiers?")) out += "<exists>\n";
    const std::size_t equals = line.find(" = ");
    if (equals != std::string_view::npos) out += std::string(line.substr(equals + 3)) + "\n";
  }
  return out;
}

std::string toUtf16(std::string_view text) {
  std::string out = "\xFE\xFF";
  const auto put = [&](unsigned unit) {
    out += static_cast<char>(unit >> 8U);
    out += static_cast<char>(unit & 0xFFU);
  };
  for (std::size_t at = 0; at < text.size();) {
    const char32_t c = decodeUtf8(text, at).value_or(0xFFFD);
    if (c < 0x10000) {
      put(static_cast<unsigned>(c));
    } else {
      put(0xD800 + static_cast<unsigned>((c - 0x10000) >> 10U));
      put(0xDC00 + static_cast<unsigned>((c - 0x10000) & 0x3FFU));
    }
  }
  return out;
}

std::optional<LabelFormat> formatOf(const std::filesystem::path& path) {
  const std::string ending = lowerCase(path.extension().string());
  if (ending == ".textgrid") return LabelFormat::kTextGrid;
  if (ending == ".lab") return LabelFormat::kHtk;
  if (ending == ".phn") return LabelFormat::kTimit;
  if (ending == ".ctm") return LabelFormat::kCtm;
  if (ending == ".txt") return LabelFormat::kSeconds;
  return std::nullopt;
}

}  // namespace

std::string formatTextGrid(const SpeechLabels& labels, std::span<const double> confidence) {
  MOUTHPIECE_EXPECT(confidence.empty() || confidence.size() == labels.phones.size());
  const Seconds duration = labels.duration();
  std::string out = "File type = \"ooTextFile\"\nObject class = \"TextGrid\"\n\n";
  fmt::format_to(std::back_inserter(out), "xmin = 0\nxmax = {}\ntiers? <exists>\nsize = {}\nitem []:\n", duration,
                 confidence.empty() ? 3 : 4);
  const auto text = [](const LabelledWord& word) { return word.text; };
  const auto stress = [](const LabelledSyllable& syllable) { return std::to_string(syllable.stress); };
  std::vector<LabelledWord> named = labels.words;
  std::erase_if(named, [](const LabelledWord& word) { return word.text.empty(); });
  appendTier(out, 1, "words", intervalsOf(labels, named, text), duration);
  appendTier(out, 2, "phones", phoneIntervals(labels), duration);
  appendTier(out, 3, "syllables", intervalsOf(labels, labels.syllables, stress), duration);
  if (!confidence.empty()) appendTier(out, 4, "confidence", confidenceIntervals(labels, confidence), duration);
  return out;
}

void writeTextGrid(const std::filesystem::path& path, const SpeechLabels& labels, std::span<const double> confidence) {
  writeFileAtomically(path, formatTextGrid(labels, confidence));
}

std::string formatLabels(const SpeechLabels& labels, LabelFormat format, const LabelFileOptions& options) {
  MOUTHPIECE_EXPECT(options.sample_rate_hz > 0);
  std::string text;
  switch (format) {
    case LabelFormat::kTextGrid:
      text = formatTextGrid(labels);
      break;
    case LabelFormat::kShortTextGrid:
      text = shortened(formatTextGrid(labels));
      break;
    case LabelFormat::kHtk:
      return inUnits(labels, kHtkUnitsPerSecond);
    case LabelFormat::kEsps:
      return espsText(labels);
    case LabelFormat::kTimit:
      return inUnits(labels, options.sample_rate_hz);
    case LabelFormat::kCtm:
      return ctmText(labels, withoutBlanks(options.name));
    case LabelFormat::kSeconds:
      return secondsText(labels);
  }
  return options.utf16 ? toUtf16(text) : text;
}

void writeLabels(const std::filesystem::path& path, const SpeechLabels& labels, LabelFormat format,
                 const LabelFileOptions& options) {
  writeFileAtomically(path, formatLabels(labels, format, options));
}

void writeLabels(const std::filesystem::path& path, const SpeechLabels& labels, const LabelFileOptions& options) {
  const auto format = formatOf(path);
  if (!format) {
    throw InputError(path.string(), "", "has an unknown ending; expected .TextGrid, .lab, .phn, .ctm or .txt");
  }
  writeLabels(path, labels, *format, options);
}

bool isLabelFileName(const std::filesystem::path& path) { return formatOf(path).has_value(); }

}  // namespace mouthpiece
