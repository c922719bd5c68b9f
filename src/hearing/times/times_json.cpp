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

constexpr double kTick = 1e-7;  ///< Azure's: 100 ns
constexpr double kMillisecond = 1e-3;
constexpr std::string_view kExpected = "words with their times";

/// The first of several spellings of a key that is there; else the first.
JsonField either(const JsonField& object, std::initializer_list<std::string_view> keys) {
  for (const std::string_view key : keys) {
    if (object[key].exists()) return object[key];
  }
  return object[*keys.begin()];
}

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

/// WhisperX gives digits no times: such words share what lies between their neighbours. `end`: of all of them, where it
/// is known.
void addWords(TimesBuilder& builder, const JsonField& words, std::optional<Seconds> end = std::nullopt) {
  std::vector<JsonField> all = words.list();
  std::erase_if(all, isNoWord);
  Seconds at = 0;  // where the last timed word ended
  for (std::size_t i = 0; i < all.size();) {
    std::size_t timed = i;
    while (timed < all.size() && !isTimed(all[timed])) ++timed;
    const Seconds next = timed < all.size() ? all[timed]["start"].number() : end.value_or(at);
    const auto untimed = static_cast<double>(timed - i);
    if (untimed == static_cast<double>(all.size()))
      static_cast<void>(all.front()["start"].number());  // says that it is missing
    for (const Seconds start = i == 0 ? std::max(0.0, next - 0.3 * untimed) : at; i < timed; ++i) {
      const Seconds share = std::max(0.0, next - start) / untimed;
      const Seconds own = start + share * (untimed - static_cast<double>(timed - i));
      builder.addWord(either(all[i], {"word", "text"}).text(), {own, own + share}, all[i].path(), confidenceIn(all[i]));
    }
    if (timed == all.size()) return;
    const TimeSpan span = spanIn(all[timed]);
    builder.addWord(either(all[timed], {"word", "text"}).text(), span, all[timed].path(), confidenceIn(all[timed]));
    at = span.end;
    i = timed + 1;
  }
}

/// openai-whisper, faster-whisper and the API's verbose_json; lines where words have no times.
TimesFile parseWhisper(const JsonField& root, std::string_view name) {
  TimesBuilder builder(name, "Whisper JSON");
  const auto hasWords = [](const JsonField& object) { return object["words"].exists() && object["words"].size() > 0; };
  if (hasWords(root) || !root["segments"].exists()) {
    addWords(builder, root["words"]);
    return builder.finish();
  }
  const std::vector<JsonField> segments = root["segments"].list();
  const bool has_words = std::any_of(segments.begin(), segments.end(), hasWords);
  if (!has_words) builder.setLines();
  for (const JsonField& segment : segments) {
    if (hasWords(segment)) {
      const JsonField end = segment["end"];
      addWords(builder, segment["words"], end.exists() ? std::optional(end.number()) : std::nullopt);
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

/// whisper.cpp: milliseconds.
TimesFile parseWhisperCpp(const JsonField& root, std::string_view name) {
  TimesBuilder builder(name, "whisper.cpp JSON");
  builder.setLines();
  for (const JsonField& segment : root["transcription"].list()) {
    const JsonField offsets = segment["offsets"];
    builder.addWord(segment["text"].text(),
                    {offsets["from"].number() * kMillisecond, offsets["to"].number() * kMillisecond}, segment.path());
  }
  return builder.finish();
}

TimesFile parseVosk(const JsonField& root, std::string_view name) {
  TimesBuilder builder(name, "Vosk JSON");
  addWords(builder, root["result"]);
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
      if (known) builder.addPhone(known, {at, end}, phone.path(), true);
      at = end;
    }
  }
  return builder.finish();
}

/// Azure's viseme ids, 0 to 21, each by a phone of its row in the documentation.
std::optional<Phone> phoneOfViseme(std::int64_t id) {
  using enum Phone;
  constexpr std::array<Phone, 22> kPhones = {kSil, kAE, kAA, kAO, kEH, kER, kIY, kUW, kOW, kAW, kOY,
                                             kAY,  kHH, kR,  kL,  kS,  kSH, kDH, kF,  kT,  kK,  kP};
  const Phone phone = kPhones[static_cast<std::size_t>(id)];
  return phone == kSil ? std::nullopt : std::optional<Phone>(phone);
}

/// Recognition with details: NBest, words in ticks, phonemes where pronunciation was assessed.
TimesFile parseAzureResult(const JsonField& root, std::string_view name, const Language& language) {
  TimesBuilder builder(name, "Azure JSON");
  const auto spanOf = [](const JsonField& object) {
    const double start = object["Offset"].number() * kTick;
    return TimeSpan{start, start + object["Duration"].number() * kTick};
  };
  for (const JsonField& word : root["NBest"].list(1).front()["Words"].list()) {
    builder.addWord(word["Word"].text(), spanOf(word), word.path(), confidenceIn(word));
    if (!word["Phonemes"].exists()) continue;
    for (const JsonField& phoneme : word["Phonemes"].list()) {
      const std::string label = phoneme["Phoneme"].name();
      auto phone = phoneFromName(label);
      if (!phone) phone = phoneFromName(label, PhoneSet::kIpa, language);
      if (!phone) phoneme["Phoneme"].refuse("a phone");
      builder.addPhone(phone, spanOf(phoneme), phoneme.path(), true);
    }
  }
  return builder.finish();
}

/// Events of synthesis as an application writes them down: visemes, and words.
TimesFile parseAzureEvents(const JsonField& visemes, const JsonField* words, std::string_view name) {
  TimesBuilder builder(name, "Azure visemes");
  if (words != nullptr) {
    for (const JsonField& word : words->list()) {
      const double start = either(word, {"AudioOffset", "audio_offset", "audioOffset"}).number() * kTick;
      const double end = start + either(word, {"Duration", "duration"}).number() * kTick;
      builder.addWord(either(word, {"Text", "text"}).text(), {start, end}, word.path());
    }
  }
  builder.setShapes();
  std::optional<Phone> shape;
  double start = -1;
  for (const JsonField& event : visemes.list()) {
    const double time = either(event, {"AudioOffset", "audio_offset", "audioOffset"}).number(0) * kTick;
    if (start >= 0) builder.addPhone(shape, {start, time}, event.path());
    shape = phoneOfViseme(either(event, {"VisemeId", "viseme_id", "visemeId"}).whole(0, 21));
    start = time;
  }
  constexpr Seconds kLast = 0.1;
  if (start >= 0) builder.addPhone(shape, {start, start + kLast}, visemes.path());
  return builder.finish();
}

/// Characters with their times; blanks part words.
TimesFile parseElevenLabs(const JsonField& root, std::string_view name) {
  TimesBuilder builder(name, "ElevenLabs JSON");
  const JsonField alignment = root["alignment"].exists() && !root["alignment"].isNull() ? root["alignment"]
                              : root["normalized_alignment"].exists()                   ? root["normalized_alignment"]
                                                                                        : root;
  const std::vector<JsonField> characters = alignment["characters"].list();
  const std::vector<JsonField> starts =
      alignment["character_start_times_seconds"].list(characters.size(), characters.size());
  const std::vector<JsonField> ends =
      alignment["character_end_times_seconds"].list(characters.size(), characters.size());
  std::string word, place;
  TimeSpan span;
  const auto finish = [&] {
    if (!word.empty()) builder.addWord(word, span, place);
    word.clear();
  };
  for (std::size_t i = 0; i < characters.size(); ++i) {
    const std::string character = characters[i].text(64);
    const TimeSpan own{starts[i].number(), ends[i].number()};
    if (trimmed(character).empty() || character == "\n") {
      finish();
      continue;
    }
    if (word.empty()) {
      span.start = own.start;
      place = characters[i].path();
    } else if (own.start < span.end - 0.05) {
      starts[i].refuse(fmt::format("a time from {} s on", span.end));
    }
    word += character;
    span.end = own.end;
  }
  finish();
  return builder.finish();
}

/// Piper's phoneme alignments: eSpeak's symbols one code point each, and how many samples each lasts.
class PiperReader {
 public:
  PiperReader(TimesBuilder& builder, const Language& language) : builder_(builder), language_(language) {}

  void addChunk(const JsonField& chunk, const JsonField& root) {
    const JsonField rate = chunk["sample_rate"].exists() ? chunk["sample_rate"] : root["sample_rate"];
    const double step = 1 / rate.number(1000, 768000);
    for (const JsonField& entry : chunk["phoneme_alignments"].list()) {
      const std::string symbol = entry["phoneme"].text(64);
      const Seconds end = at_ + entry["num_samples"].number(0, 1e12) * step;
      add(symbol, {at_, end}, entry.path());
      at_ = end;
    }
    flush();
  }

 private:
  void add(const std::string& symbol, const TimeSpan& span, const std::string& place) {
    constexpr std::string_view kMarks = "ˈˌːˑ";
    if (kMarks.find(symbol) != std::string_view::npos && !symbol.empty() &&
        static_cast<unsigned char>(symbol[0]) >= 0x80) {
      if (!pending_.empty() && (symbol == "ː" || symbol == "ˑ")) {
        span_.end = span.end;
      } else {
        flush();
        start_early_ = start_early_.value_or(span.start);
      }
      return;
    }
    const std::string both = pending_ + symbol;
    if (!pending_.empty() && phoneFromName(both, PhoneSet::kIpa, language_)) {
      pending_ = both;
      span_.end = span.end;
      return;
    }
    flush();
    if (phoneFromName(symbol, PhoneSet::kIpa, language_)) {
      pending_ = symbol;
      span_ = {start_early_.value_or(span.start), span.end};
      place_ = place;
    }
    start_early_.reset();
  }

  void flush() {
    if (!pending_.empty()) builder_.addPhone(phoneFromName(pending_, PhoneSet::kIpa, language_), span_, place_);
    pending_.clear();
  }

  TimesBuilder& builder_;
  const Language& language_;
  Seconds at_ = 0;
  std::string pending_, place_;
  TimeSpan span_;
  std::optional<Seconds> start_early_;
};

TimesFile parsePiper(const JsonField& root, std::string_view name, const Language& language) {
  TimesBuilder builder(name, "Piper JSON");
  PiperReader reader(builder, language);
  if (root.isList()) {
    for (const JsonField& chunk : root.list()) reader.addChunk(chunk, chunk);
  } else {
    reader.addChunk(root, root);
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

/// Amazon's visemes of English.
std::optional<Phone> phoneOfPolly(const JsonField& value) {
  using enum Phone;
  constexpr std::array<std::pair<std::string_view, Phone>, 16> kVisemes = {{{"p", kP},
                                                                            {"t", kT},
                                                                            {"S", kSH},
                                                                            {"T", kTH},
                                                                            {"f", kF},
                                                                            {"k", kK},
                                                                            {"i", kIY},
                                                                            {"r", kR},
                                                                            {"s", kS},
                                                                            {"u", kUW},
                                                                            {"@", kAH},
                                                                            {"a", kAA},
                                                                            {"e", kEY},
                                                                            {"E", kEH},
                                                                            {"o", kOW},
                                                                            {"O", kAO}}};
  const std::string name = value.name(16);
  if (name == "sil") return std::nullopt;
  for (const auto& [viseme, phone] : kVisemes) {
    if (viseme == name) return phone;
  }
  value.refuse("one of Amazon Polly's visemes");
}

/// Ours: its words have notes in place of times.
bool isWrittenSong(const JsonField& root) {
  if (!root["words"].isList()) return false;
  const std::vector<JsonField> words = root["words"].list();
  return std::any_of(words.begin(), words.end(),
                     [](const JsonField& word) { return word.isObject() && word["notes"].exists(); });
}

}  // namespace

TimesFile parseTimesJson(std::string_view text, std::string_view name, const Language& language) {
  const JsonField root = parseOthersJson(text, name);
  if (root.isList()) {
    const std::vector<JsonField> entries = root.list(1);
    const JsonField& first = entries.front();
    if (!first.isObject()) first.refuse("an object");
    if (first["phoneme_alignments"].exists()) return parsePiper(root, name, language);
    if (either(first, {"VisemeId", "viseme_id", "visemeId"}).exists()) return parseAzureEvents(root, nullptr, name);
    TimesBuilder builder(name, "JSON words");
    addWords(builder, root);
    return builder.finish();
  }
  if (root["results"].exists() || root["response"].exists()) return parseResults(root, name);
  if (root["audio_url"].exists() && root["words"].exists()) return parseAssemblyAi(root, name);
  if (root["monologues"].exists()) return parseRev(root["monologues"], name);
  if (root["tiers"].exists()) return parseTiersJson(root["tiers"], name, language);
  if (root["mouthCues"].exists()) return parseRhubarbJson(root, name);
  if (root["NBest"].exists()) return parseAzureResult(root, name, language);
  if (root["visemes"].exists()) {
    const JsonField words = root["words"];
    return parseAzureEvents(root["visemes"], words.exists() ? &words : nullptr, name);
  }
  if (root["phoneme_alignments"].exists()) return parsePiper(root, name, language);
  if (root["alignment"].exists() || root["normalized_alignment"].exists() || root["characters"].exists())
    return parseElevenLabs(root, name);
  if (root["transcript"].exists() && root["words"].exists()) return parseGentle(root, name);
  // whisper.cpp has a `result`, too: the language.
  if (root["transcription"].exists()) return parseWhisperCpp(root, name);
  if (root["chunks"].exists()) return parseTransformers(root, name);
  if (root["result"].exists()) return parseVosk(root, name);
  if (isWrittenSong(root)) root.fail("is a written song; expected words with their times");
  if (root["segments"].exists() || root["words"].exists()) return parseWhisper(root, name);
  root.fail(
      "has no words, segments, chunks, result, results, transcription, alignment, NBest, visemes, phoneme_alignments, "
      "mouthCues, monologues or tiers; expected JSON of Whisper, Vosk, Gentle, Azure, Deepgram, Amazon Transcribe, "
      "Google, Watson, Speechmatics, Rev, AssemblyAI, ElevenLabs, Piper, Rhubarb or the Montreal Forced Aligner");
}

/// Polly's speech marks, in milliseconds and without ends: each lasts until the next; Vosk's results one a line.
TimesFile parseJsonLines(std::string_view text, std::string_view name) {
  TimesBuilder polly(name, "Polly speech marks"), vosk(name, "Vosk JSON");
  bool is_vosk = false;
  std::string word, word_place, shape_place;
  double word_start = -1, shape_start = -1;
  std::optional<Phone> shape;
  double last = 0;
  const auto finishWord = [&](double end) {
    if (word_start >= 0) polly.addWord(word, {word_start, end}, word_place);
    word_start = -1;
  };
  LineReader reader(text);
  for (std::string_view line; reader.next(line);) {
    if (trimmed(line).empty()) continue;
    const std::string place = std::to_string(reader.lineNumber());
    const JsonField mark = parseOthersJson(line, fmt::format("{}:{}", name, place));
    if (mark["result"].exists() || mark["text"].exists()) {
      is_vosk = true;
      if (mark["result"].exists()) addWords(vosk, mark["result"]);
      continue;
    }
    const std::string type = mark["type"].name(32);
    const double time = mark["time"].number(0) * kMillisecond;
    last = time;
    if (type == "word") {
      finishWord(time);
      word = mark["value"].text();
      word_start = time;
      word_place = place;
    } else if (type == "viseme") {
      if (shape_start >= 0) polly.addPhone(shape, {shape_start, time}, place);
      shape = phoneOfPolly(mark["value"]);
      // A word ends where the mouth comes to rest.
      if (!shape) finishWord(time);
      shape_start = time;
    }
  }
  if (is_vosk) return vosk.finish();
  constexpr Seconds kLast = 0.3;
  finishWord(last + kLast);
  if (shape_start >= 0 && shape) polly.addPhone(shape, {shape_start, shape_start + 0.1}, "end");
  polly.setShapes();
  return polly.finish();
}

}  // namespace mouthpiece
