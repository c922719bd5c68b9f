// JSON of services that write down what is said, each by its documentation (docs/formats/times.md).
#include <algorithm>
#include <initializer_list>
#include <optional>
#include <string>
#include <vector>

#include "base/text_numbers.h"
#include "hearing/times/times_reader.h"

namespace mouthpiece {
namespace {

/// 1.3, "1.3", "1.300s", or as Google's library for Node has it: {"seconds": "1", "nanos": 300000000}, what is 0 left
/// out.
Seconds secondsIn(const JsonField& field) {
  if (field.isObject()) {
    const JsonField seconds = field["seconds"], nanos = field["nanos"];
    return (seconds.exists() ? secondsIn(seconds) : 0.0) + (nanos.exists() ? 1e-9 * nanos.number() : 0.0);
  }
  if (!field.isText()) return field.number();
  const std::string written = field.text(64);
  std::string_view text = written;
  if (text.ends_with('s')) text.remove_suffix(1);
  const auto seconds = parseNumber(text);
  if (!seconds) field.refuse("a time in seconds");
  return *seconds;
}

double confidenceOf(const JsonField& field) { return field.exists() && !field.isNull() ? secondsIn(field) : 1; }

TimesFile parseDeepgram(const JsonField& channels, std::string_view name) {
  TimesBuilder builder(name, "Deepgram JSON");
  // Of several channels the first on which somebody speaks.
  std::vector<JsonField> words;
  for (const JsonField& channel : channels.list(1)) {
    if (words.empty()) words = channel["alternatives"].list(1).front()["words"].list();
  }
  for (const JsonField& word : words) {
    const JsonField written = word["punctuated_word"].exists() ? word["punctuated_word"] : word["word"];
    builder.addWord(written.text(), {word["start"].number(), word["end"].number()}, word.path(),
                    confidenceOf(word["confidence"]));
  }
  return builder.finish();
}

TimesFile parseTranscribe(const JsonField& items, std::string_view name) {
  TimesBuilder builder(name, "Amazon Transcribe JSON");
  for (const JsonField& item : items.list()) {
    if (item["type"].text() != "pronunciation") continue;
    const JsonField best = item["alternatives"].list(1).front();
    builder.addWord(best["content"].text(), {secondsIn(item["start_time"]), secondsIn(item["end_time"])}, item.path(),
                    confidenceOf(best["confidence"]));
  }
  return builder.finish();
}

bool tellsSpeakers(const JsonField& result) {
  if (!result["alternatives"].exists()) return false;
  const JsonField words = result["alternatives"].list(1).front()["words"];
  if (!words.exists() || words.size() == 0) return false;
  const JsonField speaker =
      either(words.list().front(), {"speakerTag", "speakerLabel", "speaker_tag", "speaker_label"});
  return speaker.exists() && (!speaker.isNumber() || speaker.number() > 0) &&
         (!speaker.isText() || !speaker.text().empty());
}

TimesFile parseGoogle(const JsonField& results, std::string_view name) {
  TimesBuilder builder(name, "Google JSON");
  std::vector<JsonField> all = results.list();
  // Where speakers are told apart the last result repeats all words, with their speakers.
  if (all.size() > 1 && tellsSpeakers(all.back()) && !tellsSpeakers(all.front())) all = {all.back()};
  for (const JsonField& result : all) {
    // A result that closes a stretch of another channel may have no alternative.
    if (!result["alternatives"].exists()) continue;
    const JsonField best = result["alternatives"].list(1).front();
    if (!best["words"].exists()) best.fail("has no words; expected them with their times (enableWordTimeOffsets)");
    for (const JsonField& word : best["words"].list()) {
      // As version 1, version 2 and Python's library write it.
      const auto timeOf = [&](std::initializer_list<const char*> names) {
        const auto there =
            std::find_if(names.begin(), names.end(), [&](const char* key) { return word[key].exists(); });
        return there == names.end() ? std::nullopt : std::optional(secondsIn(word[*there]));
      };
      const std::optional<Seconds> end = timeOf({"endTime", "endOffset", "end_time", "end_offset"});
      if (!end) word["endTime"].refuse("a time in seconds");
      const Seconds start = timeOf({"startTime", "startOffset", "start_time", "start_offset"}).value_or(0);
      const double sure = confidenceOf(word["confidence"]);
      builder.addWord(word["word"].text(), {start, *end}, word.path(), sure == 0 ? 1 : sure);  // 0: none was given
    }
  }
  return builder.finish();
}

/// Of Google's kind, but that words are lists: ["the", 0.1, 0.3].
TimesFile parseWatson(const JsonField& results, std::string_view name) {
  TimesBuilder builder(name, "Watson JSON");
  for (const JsonField& result : results.list()) {
    const JsonField best = result["alternatives"].list(1).front();
    const std::vector<JsonField> words = best["timestamps"].list();
    const std::vector<JsonField> sure =
        best["word_confidence"].exists() ? best["word_confidence"].list() : std::vector<JsonField>{};
    for (std::size_t i = 0; i < words.size(); ++i) {
      const std::vector<JsonField> word = words[i].list(3, 3);
      const double confidence = i < sure.size() ? sure[i].list(2, 2).back().number() : 1;
      builder.addWord(word[0].text(), {word[1].number(), word[2].number()}, words[i].path(), confidence);
    }
  }
  return builder.finish();
}

/// Numbers and dates are entities; their signs and changes of the speaker are no words.
TimesFile parseSpeechmatics(const JsonField& results, std::string_view name) {
  TimesBuilder builder(name, "Speechmatics JSON");
  for (const JsonField& result : results.list()) {
    const std::string type = result["type"].text();
    if (type != "word" && type != "entity") continue;
    const JsonField best = result["alternatives"].list(1).front();
    builder.addWord(best["content"].text(), {result["start_time"].number(), result["end_time"].number()}, result.path(),
                    confidenceOf(best["confidence"]));
  }
  return builder.finish();
}

/// Of several channels the first that is heard, in the order of their times.
std::vector<JsonField> phrasesOf(const JsonField& phrases, std::string_view offset) {
  std::vector<JsonField> all = phrases.list();
  if (!all.empty() && all.front()["channel"].exists()) {
    const double channel = all.front()["channel"].number();
    std::erase_if(all, [&](const JsonField& phrase) { return phrase["channel"].number() != channel; });
  }
  std::ranges::stable_sort(all, {}, [&](const JsonField& phrase) { return phrase[offset].number(); });
  return all;
}

}  // namespace

TimesFile parseAzureResults(const std::vector<TimesEntry>& results, std::string_view name, const Language& language) {
  TimesBuilder builder(name, "Azure JSON");
  const auto spanOf = [](const JsonField& object) {
    const double start = object["Offset"].number() * kTick;
    return TimeSpan{start, start + object["Duration"].number() * kTick};
  };
  for (const TimesEntry& result : results) {
    if (!result.json["NBest"].exists()) continue;  // of a stretch in which nothing was understood
    for (const JsonField& word : result.json["NBest"].list(1).front()["Words"].list()) {
      builder.addWord(word["Word"].text(), spanOf(word), word.path(), confidenceOf(word["Confidence"]));
      if (!word["Phonemes"].exists()) continue;
      for (const JsonField& phoneme : word["Phonemes"].list()) {
        const std::string label = phoneme["Phoneme"].name();
        std::vector<std::string> unknown;
        std::vector<SpelledPhone> phones = phonesOfSymbol(label, PhoneSet::kArpabet, language, unknown);
        if (phones.empty()) phones = phonesOfSymbol(label, PhoneSet::kIpa, language, unknown);
        if (phones.empty() || !unknown.empty()) phoneme["Phoneme"].refuse("a phone");
        builder.addPhones(phones, spanOf(phoneme), phoneme.path(), true, stressOfName(label));
      }
    }
  }
  return builder.finish();
}

TimesFile parseAzureBatch(const JsonField& phrases, std::string_view name) {
  TimesBuilder builder(name, "Azure JSON");
  for (const JsonField& phrase : phrasesOf(phrases, "offsetInTicks")) {
    if (!phrase["nBest"].exists() || phrase["nBest"].size() == 0) continue;
    for (const JsonField& word : phrase["nBest"].list().front()["words"].list()) {
      const Seconds start = word["offsetInTicks"].number() * kTick;
      builder.addWord(word["word"].text(), {start, start + word["durationInTicks"].number() * kTick}, word.path(),
                      confidenceOf(word["confidence"]));
    }
  }
  return builder.finish();
}

TimesFile parseAzurePhrases(const JsonField& phrases, std::string_view name) {
  TimesBuilder builder(name, "Azure JSON");
  for (const JsonField& phrase : phrasesOf(phrases, "offsetMilliseconds")) {
    for (const JsonField& word : phrase["words"].list()) {
      const Seconds start = word["offsetMilliseconds"].number() * kMillisecond;
      builder.addWord(word["text"].text(), {start, start + word["durationMilliseconds"].number() * kMillisecond},
                      word.path());
    }
  }
  return builder.finish();
}

TimesFile parseResults(const JsonField& root, std::string_view name) {
  // Of Google's long recognitions the operation that holds the results may be kept whole.
  const JsonField results = root["results"].exists() ? root["results"] : root["response"]["results"];
  if (results.exists() && results.isList()) {
    const std::vector<JsonField> all = results.list();
    if (!all.empty() && all.front()["type"].exists()) return parseSpeechmatics(results, name);
    const JsonField heard = all.empty() ? results : all.front()["alternatives"];
    const bool is_watson = heard.isList() && heard.size() > 0 && heard.list().front()["timestamps"].exists();
    return is_watson ? parseWatson(results, name) : parseGoogle(results, name);
  }
  if (!results.exists() || !results.isObject()) results.refuse("results of a recognition");
  if (results["channels"].exists()) return parseDeepgram(results["channels"], name);
  if (results["items"].exists()) return parseTranscribe(results["items"], name);
  results.fail(
      "has no channels or items; expected JSON of Deepgram, Amazon Transcribe, Google, Watson or Speechmatics");
}

TimesFile parseAssemblyAi(const JsonField& root, std::string_view name) {
  TimesBuilder builder(name, "AssemblyAI JSON");
  for (const JsonField& word : root["words"].list()) {
    builder.addWord(word["text"].text(), {word["start"].number() * kMillisecond, word["end"].number() * kMillisecond},
                    word.path(), confidenceOf(word["confidence"]));
  }
  return builder.finish();
}

TimesFile parseRev(const JsonField& monologues, std::string_view name) {
  TimesBuilder builder(name, "Rev JSON");
  for (const JsonField& monologue : monologues.list()) {
    for (const JsonField& element : monologue["elements"].list()) {
      if (element["type"].text() != "text") continue;  // signs, and noises of the type "unknown"
      builder.addWord(element["value"].text(), {element["ts"].number(), element["end_ts"].number()}, element.path(),
                      confidenceOf(element["confidence"]));
    }
  }
  return builder.finish();
}

}  // namespace mouthpiece
