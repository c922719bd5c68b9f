// JSON of other programs, each by its documentation (docs/formats/times.md).
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "base/errors.h"
#include "base/index.h"
#include "base/text_encoding.h"
#include "base/text_numbers.h"
#include "hearing/times/times_reader.h"

namespace mouthpiece {
namespace {

constexpr std::string_view kExpected = "words with their times";

TimeSpan spanIn(const JsonField& object) { return {object["start"].number(), object["end"].number()}; }

double confidenceIn(const JsonField& object) {
  const JsonField field = either(object, {"probability", "confidence", "conf", "Confidence", "score"});
  return field.exists() && field.isNumber() ? field.number() : 1;
}

bool isTimed(const JsonField& word) {
  const auto isThere = [&](std::string_view key) { return word[key].exists() && !word[key].isNull(); };
  return isThere("start") || isThere("end");
}

/// What ElevenLabs lists among the words of a recording: blanks and noises.
bool isNoWord(const JsonField& entry) {
  const JsonField type = entry["type"];
  return type.exists() && type.isText() && (type.text() == "spacing" || type.text() == "audio_event");
}

/// Python writes NaN and Infinity, which no JSON has, for numbers that are not known: as if nothing stood there.
std::string withoutUnknownNumbers(std::string_view text) {
  constexpr std::array<std::string_view, 3> kUnknown{"-Infinity", "Infinity", "NaN"};
  std::string valid;
  bool is_in_text = false;
  for (std::size_t i = 0; i < text.size();) {
    const auto found = std::find_if(kUnknown.begin(), kUnknown.end(),
                                    [&](std::string_view name) { return text.substr(i).starts_with(name); });
    if (!is_in_text && found != kUnknown.end()) {
      valid += "null";
      i += found->size();
      continue;
    }
    const bool is_escaped = is_in_text && text[i] == '\\' && i + 1 < text.size();
    if (is_escaped) valid += text[i++];
    if (text[i] == '"' && !is_escaped) is_in_text = !is_in_text;
    valid += text[i++];
  }
  return valid;
}

JsonField parseOthersJson(std::string_view text, std::string_view file) {
  const bool is_suspect = text.find("NaN") != text.npos || text.find("Infinity") != text.npos;
  return is_suspect ? parseJson(withoutUnknownNumbers(text), file, kExpected) : parseJson(text, file, kExpected);
}

/// In equal parts of `span`; where that has no room for them, as one.
void addUntimed(TimesBuilder& builder, std::span<const JsonField> words, const TimeSpan& span) {
  constexpr Seconds kLeast = 0.02;
  const auto textOf = [](const JsonField& word) { return either(word, {"word", "text"}).text(); };
  const Seconds share = span.duration() / asReal(std::max<std::size_t>(1, words.size()));
  if (share < kLeast && !words.empty()) {
    std::string together;
    for (const JsonField& word : words) together += (together.empty() ? "" : " ") + std::string(trimmed(textOf(word)));
    builder.addWord(together, span, words.front().path(), confidenceIn(words.front()));
    return;
  }
  for (std::size_t i = 0; i < words.size(); ++i) {
    const Seconds start = span.start + share * asReal(i);
    builder.addWord(textOf(words[i]), {start, start + share}, words[i].path(), confidenceIn(words[i]));
  }
}

/// WhisperX gives digits no times: such words share what lies between their neighbours. `all_of`: the segment of all of
/// them, where its times are known.
void addWords(TimesBuilder& builder, std::vector<JsonField> all, std::optional<TimeSpan> all_of = std::nullopt) {
  constexpr Seconds kAWord = 0.3;
  std::erase_if(all, isNoWord);
  for (std::size_t i = 0; i < all.size();) {
    const std::size_t first = i;
    while (i < all.size() && !isTimed(all[i])) ++i;
    if (i - first == all.size() && !all_of)
      static_cast<void>(all.front()["start"].number());  // says that it is missing
    const Seconds last = builder.lastWordEnd();
    const Seconds next = i < all.size() ? all[i]["start"].number() : all_of ? all_of->end : last;
    Seconds start = last;
    if (first == 0) start = std::max(last, std::min(all_of ? all_of->start : next, next - kAWord * asReal(i)));
    addUntimed(builder, std::span(all).subspan(first, i - first), {start, std::max(start, next)});
    if (i == all.size()) return;
    builder.addWord(either(all[i], {"word", "text"}).text(), spanIn(all[i]), all[i].path(), confidenceIn(all[i]));
    ++i;
  }
}

/// openai-whisper, faster-whisper and the API's verbose_json; lines where words have no times.
TimesFile parseWhisper(const JsonField& root, std::string_view name) {
  TimesBuilder builder(name, "Whisper JSON");
  builder.setLanguage(root["language"]);
  const auto hasWords = [](const JsonField& object) { return object["words"].exists() && object["words"].size() > 0; };
  if (hasWords(root) || !root["segments"].exists()) {
    addWords(builder, root["words"].list());
    return builder.finish();
  }
  const std::vector<JsonField> segments = root["segments"].list();
  const bool has_words = std::any_of(segments.begin(), segments.end(), hasWords);
  if (!has_words) builder.setLines();
  for (const JsonField& segment : segments) {
    if (hasWords(segment)) {
      const bool is_timed = segment["start"].exists() && segment["end"].exists();
      addWords(builder, segment["words"].list(), is_timed ? std::optional(spanIn(segment)) : std::nullopt);
    } else if (!has_words || segment["text"].exists()) {
      builder.addWord(segment["text"].text(), spanIn(segment), segment.path());
    }
  }
  return builder.finish();
}

/// Pipelines of Hugging Face's transformers: words, or lines; the last one's end may be unknown.
TimesFile parseTransformers(const JsonField& root, std::string_view name) {
  constexpr Seconds kAWord = 0.5;
  TimesBuilder builder(name, "Transformers JSON");
  const std::vector<JsonField> chunks = root["chunks"].list();
  const auto blanksIn = [](const JsonField& chunk) {
    const std::string text = chunk["text"].text();
    return std::ranges::count(trimmed(text), ' ');
  };
  if (std::ranges::any_of(chunks, [&](const JsonField& chunk) { return blanksIn(chunk) > 0; })) builder.setLines();
  for (const JsonField& chunk : chunks) {
    const std::vector<JsonField> times = chunk["timestamp"].list(2, 2);
    const Seconds start = times[0].number();
    const Seconds end = times[1].isNull() ? start + kAWord * asReal(blanksIn(chunk) + 1) : times[1].number();
    builder.addWord(chunk["text"].text(), {start, end}, chunk.path());
  }
  return builder.finish();
}

/// whisper.cpp: milliseconds. Of pieces (-ml 1) most begin with a blank; one that does not goes on with the last word.
TimesFile parseWhisperCpp(const JsonField& root, std::string_view name) {
  TimesBuilder builder(name, "whisper.cpp JSON");
  if (root["result"].isObject()) builder.setLanguage(root["result"]["language"]);
  struct Piece {
    std::string text;
    TimeSpan span;
    std::string place;
  };
  std::vector<Piece> pieces;
  for (const JsonField& segment : root["transcription"].list()) {
    const JsonField offsets = segment["offsets"];
    pieces.push_back({segment["text"].text(),
                      {offsets["from"].number() * kMillisecond, offsets["to"].number() * kMillisecond},
                      segment.path()});
  }
  std::erase_if(pieces, [](const Piece& piece) { return trimmed(piece.text).empty(); });
  const auto begins = std::ranges::count_if(pieces, [](const Piece& piece) { return piece.text.starts_with(' '); });
  const auto has_several = [](const Piece& piece) { return trimmed(piece.text).find(' ') != std::string_view::npos; };
  // Segments of one word each are lines.
  const auto is_long = [](const Piece& piece) { return piece.span.duration() > 1.5; };
  const bool are_words = pieces.size() > 1 && 2 * begins > std::ssize(pieces) &&
                         std::ranges::none_of(pieces, has_several) &&
                         (begins < std::ssize(pieces) || std::ranges::none_of(pieces, is_long));
  if (!are_words) builder.setLines();
  for (std::size_t i = 0; i < pieces.size();) {
    Piece word = std::move(pieces[i++]);
    for (; are_words && i < pieces.size() && !pieces[i].text.starts_with(' ') && !pieces[i].text.starts_with('[');
         ++i) {
      word.text += pieces[i].text;
      word.span.end = std::max(word.span.end, pieces[i].span.end);
    }
    builder.addWord(trimmed(word.text), word.span, word.place);
  }
  return builder.finish();
}

/// Results as they come, among them what is only likely (`partial`); of several readings the best, which comes first.
TimesFile parseVosk(const std::vector<TimesEntry>& entries, std::string_view name) {
  TimesBuilder builder(name, "Vosk JSON");
  for (const TimesEntry& entry : entries) {
    const bool has_several = entry.json["alternatives"].exists() && entry.json["alternatives"].size() > 0;
    const JsonField best = has_several ? entry.json["alternatives"].list().front() : entry.json;
    if (best["result"].exists()) addWords(builder, best["result"].list());
  }
  return builder.finish();
}

/// Words that it did not find have no times; phones are "dh_B": ARPAbet and the place in the word.
TimesFile parseGentle(const JsonField& root, std::string_view name) {
  TimesBuilder builder(name, "Gentle JSON");
  for (const JsonField& word : root["words"].list()) {
    if (word["case"].text() != "success") continue;
    const TimeSpan span = spanIn(word);
    builder.addWord(word["word"].text(), span, word.path());
    Seconds at = span.start;
    for (const JsonField& phone : word["phones"].exists() ? word["phones"].list() : std::vector<JsonField>{}) {
      const std::string label = phone["phone"].name();
      const Seconds end = at + phone["duration"].number();
      const std::string bare = label.substr(0, label.find('_'));
      const auto known = phoneFromName(bare);
      if (!known && bare != "oov" && !isSilenceName(bare)) phone["phone"].refuse("a phone of ARPAbet");
      if (known) builder.addPhone({.phone = *known, .span = {at, end}}, phone.path(), true);
      at = end;
    }
  }
  return builder.finish();
}

TimesFile parseRhubarbJson(const JsonField& root, std::string_view name) {
  TimesBuilder builder(name, "Rhubarb JSON");
  builder.setShapes();
  for (const JsonField& cue : root["mouthCues"].list())
    builder.addPhone(phoneOfShape(cue["value"].name(8), name, cue.path()), spanIn(cue), cue.path());
  return builder.finish();
}

/// Ours: its words have notes in place of times.
bool isWrittenSong(const JsonField& root) {
  if (!root["words"].isList()) return false;
  const std::vector<JsonField> words = root["words"].list();
  return std::any_of(words.begin(), words.end(),
                     [](const JsonField& word) { return word.isObject() && word["notes"].exists(); });
}

/// Where each value of several that follow one another begins and ends: "{...} {...}".
std::vector<std::string_view> valuesIn(std::string_view text) {
  std::vector<std::string_view> values;
  std::size_t begin = 0, depth = 0;
  bool is_in_text = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (is_in_text) {
      if (c == '\\') ++i;
      is_in_text = c != '"';
    } else if (c == '"') {
      is_in_text = true;
    } else if (c == '{' || c == '[') {
      if (depth++ == 0) begin = i;
    } else if ((c == '}' || c == ']') && depth > 0 && --depth == 0) {
      values.push_back(text.substr(begin, i + 1 - begin));
    }
  }
  if (depth > 0) values.push_back(text.substr(begin));  // cut short, which its reader says
  return values;
}

bool hasAny(const JsonField& entry, std::initializer_list<std::string_view> keys) {
  return std::ranges::any_of(keys, [&](std::string_view key) { return entry[key].exists(); });
}

/// A list, or values one after the other.
TimesFile parseEntries(const std::vector<TimesEntry>& entries, std::string_view name, const Language& language) {
  for (const TimesEntry& entry : entries) {
    if (!entry.json.isObject()) entry.json.refuse("an object");
  }
  const auto someHave = [&](std::initializer_list<std::string_view> keys) {
    return std::ranges::any_of(entries, [&](const TimesEntry& entry) { return hasAny(entry.json, keys); });
  };
  if (someHave({"phoneme_alignments"})) return parsePiper(entries, name, language);
  if (someHave({"VisemeId", "viseme_id", "visemeId", "AudioOffset", "audio_offset", "audioOffset"}))
    return parseAzureEvents(entries, name);
  if (someHave({"NBest"})) return parseAzureResults(entries, name, language);
  if (someHave({"alignment", "normalizedAlignment", "normalized_alignment"})) return parseElevenLabs(entries, name);
  if (someHave({"result", "alternatives", "partial"})) return parseVosk(entries, name);
  if (someHave({"type"}) && someHave({"time"})) return parsePolly(entries, name);
  TimesBuilder builder(name, "JSON words");
  std::vector<JsonField> words;
  for (const TimesEntry& entry : entries) words.push_back(entry.json);
  addWords(builder, std::move(words));
  return builder.finish();
}

}  // namespace

JsonField either(const JsonField& object, std::initializer_list<std::string_view> keys) {
  for (const std::string_view key : keys) {
    if (object[key].exists()) return object[key];
  }
  return object[*keys.begin()];
}

TimesFile parseTimesJson(std::string_view text, std::string_view name, const Language& language) {
  std::vector<TimesEntry> entries;
  const std::vector<std::string_view> values = valuesIn(text);
  if (values.size() > 1) {
    std::ptrdiff_t number = 1;
    for (const char* counted = text.data(); const std::string_view value : values) {
      number += std::count(counted, value.data(), '\n');
      counted = value.data();
      const std::string line = std::to_string(number);
      entries.push_back({parseOthersJson(value, fmt::format("{}:{}", name, line)), line});
    }
    return parseEntries(entries, name, language);
  }
  const JsonField root = parseOthersJson(text, name);
  if (root.isList()) {
    for (const JsonField& entry : root.list(1)) entries.push_back({entry, entry.path()});
    return parseEntries(entries, name, language);
  }
  entries.push_back({root, "1"});
  if (root["results"].exists() || root["response"].exists()) return parseResults(root, name);
  if (root["audio_url"].exists() && root["words"].exists()) return parseAssemblyAi(root, name);
  if (root["monologues"].exists()) return parseRev(root["monologues"], name);
  if (root["tiers"].exists()) return parseTiersJson(root["tiers"], name, language);
  if (root["mouthCues"].exists()) return parseRhubarbJson(root, name);
  if (root["recognizedPhrases"].exists()) return parseAzureBatch(root["recognizedPhrases"], name);
  if (root["phrases"].exists()) return parseAzurePhrases(root["phrases"], name);
  if (root["visemes"].exists()) {
    for (const char* const list : {"words", "visemes"}) {
      const JsonField events = root[list];
      for (const JsonField& event : events.exists() ? events.list() : std::vector<JsonField>{})
        entries.push_back({event, event.path()});
    }
    entries.erase(entries.begin());
    return parseAzureEvents(entries, name);
  }
  if (hasAny(root, {"alignment", "normalizedAlignment", "normalized_alignment", "characters"}))
    return parseElevenLabs(entries, name);
  if (root["transcript"].exists() && root["words"].exists()) return parseGentle(root, name);
  // whisper.cpp has a `result`, too: the language.
  if (root["transcription"].exists()) return parseWhisperCpp(root, name);
  if (root["chunks"].exists()) return parseTransformers(root, name);
  if (hasAny(root, {"phoneme_alignments", "NBest", "result", "alternatives"}) ||
      (root["type"].exists() && root["time"].exists()))
    return parseEntries(entries, name, language);
  const bool heard_nothing = (root["text"].exists() && root["text"].isText() && root["text"].text().empty()) ||
                             (root["RecognitionStatus"].exists() && root["RecognitionStatus"].text() != "Success");
  if (heard_nothing && !root["words"].exists() && !root["segments"].exists())
    root.fail("tells that nothing was heard; expected words with their times");
  if (isWrittenSong(root)) root.fail("is a written song; expected words with their times");
  if (root["segments"].exists() || root["words"].exists()) return parseWhisper(root, name);
  root.fail(
      "has no words, segments, chunks, result, results, transcription, alignment, NBest, visemes, phoneme_alignments, "
      "mouthCues, monologues or tiers; expected JSON of Whisper, Vosk, Gentle, Azure, Deepgram, Amazon Transcribe, "
      "Google, Watson, Speechmatics, Rev, AssemblyAI, ElevenLabs, Piper, Rhubarb or the Montreal Forced Aligner");
}

}  // namespace mouthpiece
