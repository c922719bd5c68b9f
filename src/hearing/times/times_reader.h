#pragma once

#include <initializer_list>
#include <optional>
#include <vector>

#include "base/json_fields.h"
#include "hearing/times/times_file.h"

namespace mouthpiece {

// Units of times, s.
inline constexpr double kMillisecond = 1e-3;
inline constexpr double kTick = 1e-7;  ///< Azure's

/// Puts words and phones together and checks their times, whatever the file.
class TimesBuilder {
 public:
  TimesBuilder(std::string_view file, std::string kind) : file_(file) { times_.kind = std::move(kind); }

  /// `place`: for messages. What is written between brackets ("[Music]", "(laughs)") and notes ("♪ la ♪") is not said.
  /// A word may be given zero time (10 ms are taken), and begin 50 ms before the last one's end.
  /// False where nothing of it is said.
  bool addWord(std::string_view text, TimeSpan span, const std::string& place, double confidence = 1);
  /// A phone, or a silence; the last word is its own where `in_word`.
  void addPhone(PhoneSegment phone, const std::string& place, bool in_word = false);
  void addPhone(std::optional<Phone> phone, TimeSpan span, const std::string& place) {
    addPhone({.phone = phone.value_or(Phone::kSil), .span = span}, place);
  }
  /// Those of one symbol, in equal parts. `stress`: of a vowel among them.
  void addPhones(const std::vector<SpelledPhone>& phones, TimeSpan span, const std::string& place, bool in_word,
                 std::optional<int> stress = std::nullopt);
  void addNotSaid(std::string_view text) { times_.not_said.emplace_back(text); }
  /// `language`: text that tells it, if it is there.
  void setLanguage(const JsonField& language) {
    if (language.exists() && language.isText()) times_.language = language.text();
  }
  void setLines() { times_.words_are_lines = true; }
  void setShapes() { times_.phones_are_shapes = true; }

  [[nodiscard]] Seconds lastWordEnd() const { return times_.words.empty() ? 0 : times_.words.back().span.end; }

  /// Throws InputError where nothing was added.
  TimesFile finish();

 private:
  /// What is left of `text` without what is not said.
  std::string saidOf(std::string_view text);
  void dropBracketsOverWords();
  void cutAt(Seconds next, TimeSpan& line);
  void check(TimeSpan& span, Seconds last_end, std::string_view text, const std::string& place) const;

  std::string file_;
  TimesFile times_;
  Seconds last_phone_end_ = 0;
};

/// One of several values of a file, and where it stands: a line, or its place in the list.
struct TimesEntry {
  JsonField json;
  std::string place;
};

/// The first of several spellings of a key that is there; else the first.
JsonField either(const JsonField& object, std::initializer_list<std::string_view> keys);

/// Each throws InputError; times_json.cpp, times_synthesis.cpp, times_services.cpp, times_tiers.cpp and
/// times_lines.cpp. `text`: one value, or several one after the other.
TimesFile parseTimesJson(std::string_view text, std::string_view name, const Language& language);
/// Events of synthesis as an application writes them down: visemes, words, or both.
TimesFile parseAzureEvents(const std::vector<TimesEntry>& events, std::string_view name);
TimesFile parseElevenLabs(const std::vector<TimesEntry>& chunks, std::string_view name);
TimesFile parsePiper(const std::vector<TimesEntry>& chunks, std::string_view name, const Language& language);
TimesFile parsePolly(const std::vector<TimesEntry>& marks, std::string_view name);
/// Recognition with details: NBest, words in ticks, phonemes where pronunciation was assessed.
TimesFile parseAzureResults(const std::vector<TimesEntry>& results, std::string_view name, const Language& language);
/// Of its transcription of many files, and of its fast one.
TimesFile parseAzureBatch(const JsonField& phrases, std::string_view name);
TimesFile parseAzurePhrases(const JsonField& phrases, std::string_view name);
/// Of Deepgram, Amazon Transcribe, Google, Watson and Speechmatics.
TimesFile parseResults(const JsonField& root, std::string_view name);
TimesFile parseAssemblyAi(const JsonField& root, std::string_view name);
TimesFile parseRev(const JsonField& monologues, std::string_view name);
/// Words with their phones, or alone. `bytes`: not decoded yet.
TimesFile parseTimedTextGrid(std::string_view bytes, std::string_view name, const Language& language);
/// The Montreal Forced Aligner's other two ways to write these.
TimesFile parseTiersJson(const JsonField& tiers, std::string_view name, const Language& language);
TimesFile parseTiersCsv(std::string_view text, std::string_view name, const Language& language);
/// Phones of a CTM; nullopt where the rows are words, which are written alike.
std::optional<TimesFile> parsePhoneCtm(std::string_view text, std::string_view name, const Language& language);
TimesFile parseSubtitles(std::string_view text, std::string_view name);
TimesFile parseTabbedLines(std::string_view text, std::string_view name);
/// Lyrics and whisper.cpp's CSV.
TimesFile parseLrc(std::string_view text, std::string_view name);
TimesFile parseWhisperCsv(std::string_view text, std::string_view name);
TimesFile parseRhubarbTsv(std::string_view text, std::string_view name);
TimesFile parseRhubarbXml(std::string_view text, std::string_view name);
TimesFile parseWordCtm(std::string_view text, std::string_view name);

/// The phone that stands for one of Rhubarb's mouth shapes; nullopt for X, the mouth at rest. Throws InputError for
/// another name.
std::optional<Phone> phoneOfShape(std::string_view shape, std::string_view file, const std::string& place);

}  // namespace mouthpiece
