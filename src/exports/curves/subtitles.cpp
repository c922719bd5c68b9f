#include <fmt/format.h>

#include <cmath>
#include <optional>
#include <span>
#include <utility>

#include "base/text_encoding.h"
#include "exports/curves/curve_files.h"
#include "exports/curves/written_words.h"

namespace mouthpiece {
namespace {

/// "00:00:01,500"
std::string clockOf(Seconds time, char point) {
  const auto milliseconds = std::llround(time * 1000);
  return fmt::format("{:02}:{:02}:{:02}{}{:03}", milliseconds / 3'600'000, milliseconds / 60'000 % 60,
                     milliseconds / 1000 % 60, point, milliseconds % 1000);
}

struct Subtitle {
  TimeSpan span;
  std::string text;
};

/// Chinese and Japanese, which have no blanks between words.
bool isIdeograph(char32_t c) {
  return (c >= 0x3000 && c <= 0x30FF) || (c >= 0x3400 && c <= 0x9FFF) || (c >= 0xF900 && c <= 0xFAFF) ||
         (c >= 0xFF00 && c <= 0xFFEF) || (c >= 0x20000 && c <= 0x3FFFF);
}

/// A word on a line of a subtitle.
struct SubtitleWord {
  TimeSpan span;
  std::string text;
  std::size_t columns = 0;  ///< that it takes: two an ideograph
  bool has_blank = false;   ///< before it
};

SubtitleWord subtitleWord(const TimeSpan& span, const std::string& text, const SubtitleWord* before) {
  const auto isAt = [](std::string_view part) {
    std::size_t at = 0;
    return isIdeograph(decodeUtf8(part, at).value_or(U' '));
  };
  SubtitleWord word{.span = span, .text = text};
  for (std::size_t at = 0; at < text.size();) {
    const std::optional<char32_t> sign = decodeUtf8(text, at);
    if (!sign) ++at;
    word.columns += sign && isIdeograph(*sign) ? 2U : 1U;
  }
  const auto endsInIdeograph = [&](std::string_view part) {
    std::size_t at = part.size();
    while (at > 0 && (static_cast<unsigned char>(part[--at]) & 0xC0U) == 0x80U) continue;
    return isAt(part.substr(at));
  };
  word.has_blank = before != nullptr && !(endsInIdeograph(before->text) && isAt(text));
  return word;
}

/// The words of a phrase on lines of `most` columns and six seconds, filled one after the other.
std::vector<Subtitle> filledLines(std::span<const SubtitleWord> words, std::size_t most) {
  constexpr Seconds kLongest = 6;
  std::vector<Subtitle> lines;
  std::size_t columns = 0;
  for (const SubtitleWord& word : words) {
    const std::size_t more = word.columns + (word.has_blank ? 1 : 0);
    if (!lines.empty() && columns + more <= most && word.span.end - lines.back().span.start <= kLongest) {
      lines.back().text.append(word.has_blank ? " " : "").append(word.text);
      lines.back().span.end = word.span.end;
      columns += more;
    } else {
      lines.push_back({word.span, word.text});
      columns = word.columns;
    }
  }
  return lines;
}

/// As few lines as 42 columns allow, as even as they can be: a word left over would stand for too short a time.
std::vector<Subtitle> subtitlesOf(const SpeechLabels& labels, std::string_view text) {
  constexpr std::size_t kMostColumns = 42;
  constexpr Seconds kPause = 0.7;
  std::vector<std::vector<SubtitleWord>> phrases;
  for (const WrittenWord& word : writtenWords(labels, text)) {
    const bool goes_on = !phrases.empty() && word.span.start - phrases.back().back().span.end <= kPause;
    if (!goes_on) phrases.emplace_back();
    phrases.back().push_back(subtitleWord(word.span, word.text, goes_on ? &phrases.back().back() : nullptr));
  }
  std::vector<Subtitle> subtitles;
  for (const std::vector<SubtitleWord>& phrase : phrases) {
    std::vector<Subtitle> lines = filledLines(phrase, kMostColumns);
    for (std::size_t most = kMostColumns; most-- > 0;) {
      std::vector<Subtitle> evener = filledLines(phrase, most);
      if (evener.size() > lines.size()) break;
      lines = std::move(evener);
    }
    subtitles.insert(subtitles.end(), lines.begin(), lines.end());
  }
  return subtitles;
}

}  // namespace

std::string srtText(const SpeechLabels& labels, std::string_view text) {
  std::string srt;
  int number = 0;
  for (const Subtitle& subtitle : subtitlesOf(labels, text))
    srt += fmt::format("{}\n{} --> {}\n{}\n\n", ++number, clockOf(subtitle.span.start, ','),
                       clockOf(subtitle.span.end, ','), subtitle.text);
  return srt;
}

std::string vttText(const SpeechLabels& labels, std::string_view text) {
  std::string vtt = "WEBVTT\n\n";
  for (const Subtitle& subtitle : subtitlesOf(labels, text))
    vtt += fmt::format("{} --> {}\n{}\n\n", clockOf(subtitle.span.start, '.'), clockOf(subtitle.span.end, '.'),
                       xmlEscaped(subtitle.text));
  return vtt;
}

}  // namespace mouthpiece
