#include "phonetics/labels/label_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <optional>

#include "base/errors.h"
#include "base/files.h"
#include "base/text_encoding.h"
#include "phonetics/labels/textgrid.h"

namespace mouthpiece {
namespace {

constexpr double kHtkUnitsPerSecond = 1e7;

/// The colour that Festival's own tools write; readers pass over it.
constexpr int kEspsColour = 121;

std::string withoutBlanks(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return std::isspace(c) != 0 || std::iscntrl(c) != 0; }, '_');
  return text.empty() ? "take" : text;
}

/// "start end label" a line, times in whole units.
std::string inUnits(const SpeechLabels& labels, double units_per_second) {
  std::string text;
  for (const LabelledPhone& phone : labels.phones) {
    fmt::format_to(std::back_inserter(text), "{} {} {}\n", std::llround(phone.span.start * units_per_second),
                   std::llround(phone.span.end * units_per_second), phoneName(phone.phone));
  }
  return text;
}

std::string espsText(const SpeechLabels& labels) {
  std::string text = "separator ;\nnfields 1\n#\n";
  for (const LabelledPhone& phone : labels.phones) {
    fmt::format_to(std::back_inserter(text), "    {:.6f}  {}  {}\n", phone.span.end, kEspsColour,
                   phoneName(phone.phone));
  }
  return text;
}

std::string ctmText(const SpeechLabels& labels, const std::string& name) {
  std::string text;
  for (const LabelledPhone& phone : labels.phones) {
    fmt::format_to(std::back_inserter(text), "{} 1 {:.6f} {:.6f} {}\n", name, phone.span.start, phone.span.duration(),
                   phoneName(phone.phone));
  }
  return text;
}

std::string secondsText(const SpeechLabels& labels) {
  std::string text;
  for (const LabelledPhone& phone : labels.phones) {
    fmt::format_to(std::back_inserter(text), "{:.6f} {:.6f} {}\n", phone.span.start, phone.span.end,
                   phoneName(phone.phone));
  }
  return text;
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
  std::string ending = path.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(), [](unsigned char c) { return std::tolower(c); });
  if (ending == ".textgrid") return LabelFormat::kTextGrid;
  if (ending == ".lab") return LabelFormat::kHtk;
  if (ending == ".phn") return LabelFormat::kTimit;
  if (ending == ".ctm") return LabelFormat::kCtm;
  if (ending == ".txt") return LabelFormat::kSeconds;
  return std::nullopt;
}

}  // namespace

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
