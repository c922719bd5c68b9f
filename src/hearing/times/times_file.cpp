#include "hearing/times/times_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "base/errors.h"
#include "base/index.h"
#include "base/text_encoding.h"
#include "base/text_numbers.h"
#include "hearing/times/times_reader.h"
#include "phonetics/labels/textgrid.h"

namespace mouthpiece {
namespace {

constexpr Seconds kLatestTime = 24 * 3600.0;
constexpr Seconds kForgivenOverlap = 0.05, kLeastTime = 0.010;

/// With the blanks and tabs at its end.
std::string_view wholeFirstLine(std::string_view text) {
  text.remove_prefix(std::min(text.find_first_not_of(" \t\r\n"), text.size()));
  const std::string_view line = text.substr(0, text.find('\n'));
  return line.ends_with('\r') ? line.substr(0, line.size() - 1) : line;
}
std::string_view firstLine(std::string_view text) { return trimmed(wholeFirstLine(text)); }

std::vector<std::string_view> fieldsOf(std::string_view line) {
  std::vector<std::string_view> fields;
  for (std::size_t at = 0; (at = line.find_first_not_of(" \t", at)) != std::string_view::npos;) {
    const std::size_t end = std::min(line.find_first_of(" \t", at), line.size());
    fields.push_back(line.substr(at, end - at));
    at = end;
  }
  return fields;
}

/// "name channel start duration label".
bool isCtm(std::string_view line) {
  const auto fields = fieldsOf(line);
  return fields.size() >= 5 && parseNumber(fields[2]) && parseNumber(fields[3]);
}

/// "start end phone", as .lab and .phn files have it.
bool isLabel(std::string_view line) {
  const auto fields = fieldsOf(line);
  return fields.size() == 3 && parseNumber(fields[0]) && parseNumber(fields[1]);
}

bool isTsv(std::string_view line) {
  const std::size_t tab = line.find('\t');
  return tab != std::string_view::npos && parseNumber(line.substr(0, tab)) && line.find('\t', tab + 1) == line.npos;
}

/// "start end text", or two times and a label.
bool isTabbedLine(std::string_view line) {
  std::vector<std::string_view> fields;
  splitFields(line, '\t', fields);
  return fields.size() == 3 && (line == "start\tend\ttext" || (parseNumber(fields[0]) && parseNumber(fields[1])));
}

/// "[00:12.00]words", or "[by:somebody]" before such: lyrics. JSON's lists begin otherwise, and so does an .ass file.
bool isLrc(std::string_view text) {
  const std::string_view first = firstLine(text);
  if (!first.starts_with('[') || first.size() < 3) return false;
  const std::size_t colon = first.find(':');
  return colon < first.find(']') && std::ranges::all_of(first.substr(1, colon - 1), [](char c) {
           return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
         });
}

/// Signs that open and close what is not said. Round brackets do at the beginning of a word alone ("word(s)").
struct NotSaid {
  std::string_view open, close;
  bool opens_words;
};
constexpr std::array<NotSaid, 5> kNotSaid{
    {{"[", "]", false}, {"(", ")", true}, {"（", "）", false}, {"♪", "♪", false}, {"♫", "♫", false}}};

/// The words' places that one bracket goes over, where each word has times of its own: "(upbeat", "music)".
std::optional<std::size_t> endOfBracket(const std::vector<TimesFile::Word>& words, std::size_t first) {
  constexpr std::size_t kMostWords = 8;
  for (const auto& [open, close, opens_words] : kNotSaid) {
    if (open == close || !words[first].text.starts_with(open)) continue;
    for (std::size_t i = first + 1; i < std::min(words.size(), first + kMostWords); ++i) {
      if (words[i].text.find(close) != std::string::npos) return i + 1;
    }
  }
  return std::nullopt;
}

}  // namespace

void TimesBuilder::check(TimeSpan& span, Seconds last_end, std::string_view text, const std::string& place) const {
  if (!std::isfinite(span.start) || !std::isfinite(span.end) || span.start < 0 || span.end > kLatestTime) {
    throw InputError(file_, place,
                     fmt::format("found times {} to {} s; expected 0 to {} s", span.start, span.end, kLatestTime));
  }
  if (span.end < span.start) {
    throw InputError(file_, place,
                     fmt::format("'{}' ends at {:.3f} s, before it begins at {:.3f} s; expected a later end",
                                 printable(text), span.end, span.start));
  }
  if (span.start < last_end - kForgivenOverlap) {
    throw InputError(file_, place,
                     fmt::format("'{}' begins at {:.3f} s, before the one before it ends, at {:.3f} s; expected times "
                                 "in order",
                                 printable(text), span.start, last_end));
  }
  span.start = std::max(span.start, last_end);
  span.end = std::max(span.end, span.start);
}

/// A sign that does not close stays, but a line's notes: they last to its end. "# la la #" is sung, "#1" is said.
std::string TimesBuilder::saidOf(std::string_view text) {
  if (times_.words_are_lines && text.starts_with("# ")) {
    addNotSaid(text);
    return {};
  }
  std::string said;
  std::array<bool, kNotSaid.size()> closes;
  closes.fill(true);
  while (!text.empty()) {
    const bool begins_word = said.empty() || said.back() == ' ';
    const auto* const sign = std::ranges::find_if(kNotSaid, [&](const NotSaid& each) {
      return text.starts_with(each.open) && (begins_word || !each.opens_words);
    });
    const bool is_sign = sign != kNotSaid.end() && closes[unsignedIndex(sign - kNotSaid.begin())];
    const std::size_t close = is_sign ? text.find(sign->close, sign->open.size()) : std::string_view::npos;
    const bool lasts = is_sign && sign->open == sign->close && times_.words_are_lines;
    if (close == std::string_view::npos && !lasts) {
      if (is_sign) closes[unsignedIndex(sign - kNotSaid.begin())] = false;
      said += text.front();
      text.remove_prefix(1);
      continue;
    }
    const std::size_t end = close == std::string_view::npos ? text.size() : close + sign->close.size();
    addNotSaid(trimmed(text.substr(0, end)));
    text.remove_prefix(end);
  }
  return std::string(trimmed(said));
}

void TimesBuilder::dropBracketsOverWords() {
  if (times_.words_are_lines || !times_.phones.empty()) return;
  std::vector<TimesFile::Word> kept;
  for (std::size_t i = 0; i < times_.words.size();) {
    const std::optional<std::size_t> end = endOfBracket(times_.words, i);
    if (!end) {
      kept.push_back(std::move(times_.words[i++]));
      continue;
    }
    std::string left_out = times_.words[i].text;
    for (++i; i < *end; ++i) left_out += " " + times_.words[i].text;
    addNotSaid(left_out);
  }
  times_.words = std::move(kept);
}

/// A line may stay on the screen as the next one comes: half of it at least stands alone.
void TimesBuilder::cutAt(Seconds next, TimeSpan& line) {
  if (next >= line.end - kForgivenOverlap || next < line.middle()) return;
  line.end = next;
  ++times_.cut_lines;
}

bool TimesBuilder::addWord(std::string_view text, TimeSpan span, const std::string& place, double confidence) {
  // Kaldi's and Watson's marks of what is no word: <unk>, <eps>, %HESITATION.
  const std::string_view bare = trimmed(text);
  const bool is_mark =
      bare.find(' ') == bare.npos && ((bare.starts_with('<') && bare.ends_with('>')) ||
                                      (bare.starts_with('%') && bare.size() > 1 && bare[1] >= 'A' && bare[1] <= 'Z'));
  if (is_mark) addNotSaid(bare);
  std::string said = is_mark ? std::string() : saidOf(text);
  if (said.empty()) return false;
  if (times_.words_are_lines && !times_.words.empty()) cutAt(span.start, times_.words.back().span);
  check(span, times_.words.empty() ? 0 : times_.words.back().span.end, said, place);
  span.end = std::max(span.end, span.start + kLeastTime);
  if (!(confidence >= 0 && confidence <= 1)) confidence = 1;
  times_.words.push_back({std::move(said), span, confidence});
  return true;
}

void TimesBuilder::addPhone(PhoneSegment phone, const std::string& place, bool in_word) {
  check(phone.span, last_phone_end_, phoneName(phone.phone), place);
  last_phone_end_ = std::max(last_phone_end_, phone.span.end);
  if (phone.phone == Phone::kSil || phone.span.duration() <= 0) return;
  phone.word = in_word && !times_.words.empty() ? std::optional(times_.words.size() - 1) : std::nullopt;
  times_.phones.push_back(std::move(phone));
}

void TimesBuilder::addPhones(const std::vector<SpelledPhone>& phones, TimeSpan span, const std::string& place,
                             bool in_word, std::optional<int> stress) {
  const Seconds length = span.duration() / asReal(std::max<std::size_t>(1, phones.size()));
  Seconds start = span.start;
  for (std::size_t i = 0; i < phones.size(); ++i) {
    const Seconds end = i + 1 == phones.size() ? span.end : start + length;
    addPhone({.phone = phones[i].phone,
              .span = {start, end},
              .stress = isVowel(phones[i].phone) ? stress : std::nullopt,
              .ipa = phones[i].ipa},
             place, in_word);
    start = end;
  }
}

TimesFile TimesBuilder::finish() {
  dropBracketsOverWords();
  if (times_.words.empty() && times_.phones.empty())
    throw InputError(file_, "", fmt::format("is {} without words or phones; expected some", times_.kind));
  return std::move(times_);
}

TimesFile parseTimes(std::string_view bytes, std::string_view name, const Language& language) {
  expectText(bytes, name, "words with their times");
  const std::string text = decodeText(bytes, name);
  const std::string_view first = firstLine(text);
  if (first.empty()) throw InputError(name, "", "is empty; expected words with their times");
  if (isTextGrid(bytes)) return parseTimedTextGrid(bytes, name, language);
  if (isLrc(text)) return parseLrc(text, name);
  if (first.starts_with("[Script Info]"))
    throw InputError(name, "1", "is a script of SubStation (ASS); expected SRT, as `ffmpeg -i FILE out.srt` writes it");
  if (first == "start,end,text") return parseWhisperCsv(text, name);
  if (first.starts_with('{') || first.starts_with('[')) return parseTimesJson(text, name, language);
  if (first.starts_with('<')) return parseRhubarbXml(text, name);
  if (first.starts_with("WEBVTT") || text.find("-->") != std::string::npos) return parseSubtitles(text, name);
  if (first.starts_with("Begin,End,Label,Type")) return parseTiersCsv(text, name, language);
  if (isTabbedLine(wholeFirstLine(text))) return parseTabbedLines(text, name);
  if (isTsv(first)) return parseRhubarbTsv(text, name);
  if (first.starts_with(";;") || isCtm(first)) {
    if (std::optional<TimesFile> phones = parsePhoneCtm(text, name, language)) return std::move(*phones);
    return parseWordCtm(text, name);
  }
  if (isLabel(first)) throw InputError(name, "1", "holds labels of phones; expected words with their times");
  throw InputError(
      name, "1",
      fmt::format(
          "starts with '{}'; expected JSON of Whisper, Vosk, Gentle, Azure, Polly, Deepgram, Amazon "
          "Transcribe, Google, Watson, Speechmatics, Rev, AssemblyAI, ElevenLabs, Piper, Rhubarb or the Montreal "
          "Forced Aligner, its CSV, Rhubarb's TSV or XML, Whisper's TSV, Audacity's labels, a TextGrid, CTM, "
          "SRT or WebVTT",
          printable(first.substr(0, 24))));
}

}  // namespace mouthpiece
