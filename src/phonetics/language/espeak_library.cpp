#include "phonetics/language/espeak_library.h"

#include <espeak-ng/speak_lib.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <mutex>
#include <numeric>
#include <utility>

#include "base/errors.h"
#include "base/index.h"
#include "base/late_library.h"
#include "base/text_encoding.h"
#include "base/unicode.h"

// There where a program is built with a leak sanitizer.
extern "C" {
[[gnu::weak]] void __lsan_disable();  // NOLINT(bugprone-reserved-identifier,readability-identifier-naming)
[[gnu::weak]] void __lsan_enable();   // NOLINT(bugprone-reserved-identifier,readability-identifier-naming)
}

namespace mouthpiece {
namespace {

constexpr int kIpaTranscription = 0x02;                    // espeakPHONEMES_IPA
constexpr int kPhonesParted = static_cast<int>('_') << 8;  // a sign between the phones of a transcription

/// The library speaks one text at a time for the whole program. It loses its list of voices whenever it is unloaded
/// (eSpeak NG 1.51), and a leak sanitizer cannot tell whose that was: it looks away.
class EspeakLock {
 public:
  EspeakLock() : lock_(mutex()) {
    if (__lsan_disable != nullptr) __lsan_disable();
  }
  ~EspeakLock() {
    if (__lsan_enable != nullptr) __lsan_enable();
  }
  EspeakLock(const EspeakLock&) = delete;
  EspeakLock& operator=(const EspeakLock&) = delete;

 private:
  static std::mutex& mutex() {
    static std::mutex one;
    return one;
  }
  std::scoped_lock<std::mutex> lock_;
};

/// What one utterance makes while it is spoken.
struct EspeakRecording {
  EspeakSpeech speech;
  std::string text;
  std::vector<std::size_t> places;  ///< of the text's characters
  std::vector<std::size_t> starts;  ///< where in the text each announced word begins
};

/// Where each character begins.
std::vector<std::size_t> characterPlaces(std::string_view text) {
  std::vector<std::size_t> places;
  for (std::size_t at = 0; at < text.size();) {
    places.push_back(at);
    if (!decodeUtf8(text, at)) ++at;
  }
  return places;
}

/// `word` without the marks around it: "ten," is ten.
std::string bareWord(std::string_view word) {
  std::size_t first = word.size(), end = 0;
  for (std::size_t at = 0; at < word.size();) {
    const std::size_t begin = at;
    const auto c = decodeUtf8(word, at);
    if (!c) at = begin + 1;
    if (!c || !isWordSign(*c)) continue;
    first = std::min(first, begin);
    end = at;
  }
  return first < end ? std::string(word.substr(first, end - first)) : std::string(word);
}

bool isSaid(std::string_view word) {
  for (std::size_t at = 0; at < word.size();) {
    const auto c = decodeUtf8(word, at);
    if (!c) ++at;
    if (c && isWordSign(*c)) return true;
  }
  return false;
}

/// "42" is announced once for each word that it is read as: what begins before the next blank is the same word.
void noteWord(EspeakRecording& recording, const espeak_EVENT& event) {
  const auto character = unsignedIndex(std::max(event.text_position, 1) - 1);
  if (character >= recording.places.size()) return;
  const std::size_t start = recording.places[character];
  std::vector<std::size_t>& starts = recording.starts;
  if (starts.empty() || start >= std::min(recording.text.find(' ', starts.back()), recording.text.size()))
    starts.push_back(start);
}

void notePhone(EspeakRecording& recording, const espeak_EVENT& event) {
  EspeakSpeech& speech = recording.speech;
  std::string_view symbol(event.id.string, strnlen(event.id.string, sizeof event.id.string));
  // A word of another language is announced by its tag: "(en)".
  if (symbol.starts_with('(')) symbol.remove_prefix(std::min(symbol.find(')') + 1, symbol.size()));
  if (recording.starts.empty()) recording.starts.push_back(0);
  speech.events.push_back({.time = asReal(event.sample) / speech.sample_rate_hz,
                           .symbol = std::string(symbol),
                           .word = recording.starts.size() - 1});
}

/// eSpeak's callback: samples and the events among them.
int recordSpeech(short* samples, int count, espeak_EVENT* events) {
  auto* recording = static_cast<EspeakRecording*>(events->user_data);
  if (recording == nullptr) return 0;
  for (const espeak_EVENT* event = events; event->type != espeakEVENT_LIST_TERMINATED; ++event) {
    if (event->type == espeakEVENT_WORD) noteWord(*recording, *event);
    if (event->type == espeakEVENT_PHONEME) notePhone(*recording, *event);
  }
  if (samples == nullptr) return 0;
  for (int i = 0; i < count; ++i) recording->speech.samples.push_back(static_cast<float>(samples[i]) / 32768.0F);
  return 0;
}

/// The library as it is when nobody has called it yet: what it says goes on from where its last line left its noise,
/// its phases and even its pace (eSpeak NG 1.51). There is one at a time.
class FreshEspeak {
 public:
  FreshEspeak() { set_callback_(&recordSpeech); }
  ~FreshEspeak() {
    if (rate_hz > 0) terminate_();
  }
  FreshEspeak(const FreshEspeak&) = delete;
  FreshEspeak& operator=(const FreshEspeak&) = delete;

 private:
  LoadedLibrary library_{"libespeak-ng.so.1", "libespeak-ng1"};
  decltype(&::espeak_SetSynthCallback) set_callback_ =
      library_.find<decltype(::espeak_SetSynthCallback)>("espeak_SetSynthCallback");
  decltype(&::espeak_Terminate) terminate_ = library_.find<decltype(::espeak_Terminate)>("espeak_Terminate");

 public:
  decltype(&::espeak_ListVoices) const list = library_.find<decltype(::espeak_ListVoices)>("espeak_ListVoices");
  decltype(&::espeak_SetVoiceByName) const set_voice =
      library_.find<decltype(::espeak_SetVoiceByName)>("espeak_SetVoiceByName");
  decltype(&::espeak_Synth) const say = library_.find<decltype(::espeak_Synth)>("espeak_Synth");
  decltype(&::espeak_TextToPhonemes) const transcribe =
      library_.find<decltype(::espeak_TextToPhonemes)>("espeak_TextToPhonemes");
  /// Of its sound; 0 or less when its data are missing.
  const int rate_hz = library_.find<decltype(::espeak_Initialize)>("espeak_Initialize")(
      AUDIO_OUTPUT_SYNCHRONOUS, 0, nullptr,
      espeakINITIALIZE_PHONEME_EVENTS | espeakINITIALIZE_PHONEME_IPA | espeakINITIALIZE_DONT_EXIT);
};

/// A voice's languages follow each other: a byte of priority, the name, a zero; a zero ends the list.
bool speaks(const espeak_VOICE& voice, std::string_view language) {
  for (const char* entry = voice.languages; entry != nullptr && *entry != '\0'; entry += 2 + std::strlen(entry + 1)) {
    if (language == entry + 1) return true;
  }
  return false;
}

/// The library has one voice at a time, and dies when it is asked to speak without one.
void chooseVoice(const FreshEspeak& espeak, std::string_view voice) {
  if (espeak.rate_hz <= 0)
    throw InputError("espeak", "", "cannot find its voices (sudo apt-get install espeak-ng-data)");
  if (espeak.set_voice(std::string(voice).c_str()) == EE_OK) return;
  for (const espeak_VOICE** known = espeak.list(nullptr); *known != nullptr; ++known) {
    if (speaks(**known, voice) && espeak.set_voice((*known)->identifier) == EE_OK) return;
  }
  throw InputError(
      "espeak", "",
      fmt::format("has no voice {}; expected one of its data (sudo apt-get install espeak-ng-data)", printable(voice)));
}

/// A voice that was looked for is mostly about to speak: the library that it was found in, which has said nothing yet,
/// waits here for its first sentence.
struct WaitingEspeak {
  std::string voice;
  std::unique_ptr<FreshEspeak> espeak;
};

/// Under an EspeakLock alone.
WaitingEspeak& waitingEspeak() {
  static WaitingEspeak waiting;
  return waiting;
}

/// Speaks with `voice`, and with that alone: the choice of another leaves its traces, too.
std::unique_ptr<FreshEspeak> freshEspeakOf(std::string_view voice) {
  WaitingEspeak waiting = std::exchange(waitingEspeak(), {});
  if (waiting.espeak != nullptr && waiting.voice == voice) return std::move(waiting.espeak);
  waiting.espeak.reset();
  auto espeak = std::make_unique<FreshEspeak>();
  chooseVoice(*espeak, voice);
  return espeak;
}

/// eSpeak transcribes clause by clause.
std::vector<std::string> transcriptionsOf(const FreshEspeak& espeak, const std::string& text) {
  std::vector<std::string> clauses;
  const void* rest = text.c_str();
  while (rest != nullptr) {
    const char* clause = espeak.transcribe(&rest, espeakCHARS_UTF8, kIpaTranscription);
    if (clause == nullptr) break;
    clauses.emplace_back(clause);
  }
  return clauses;
}

/// How many phones eSpeak transcribes a word alone by, at least one.
std::size_t phonesAlone(const FreshEspeak& espeak, const std::string& word) {
  std::size_t phones = 0;
  for (const void* rest = word.c_str(); rest != nullptr;) {
    const char* clause = espeak.transcribe(&rest, espeakCHARS_UTF8, kIpaTranscription | kPhonesParted);
    if (clause == nullptr) break;
    const std::string_view parted(clause);
    phones += unsignedIndex(std::count(parted.begin(), parted.end(), '_')) + (parted.empty() ? 0 : 1);
  }
  return std::max<std::size_t>(phones, 1);
}

/// The words of what was announced as one, from a blank to the next: eSpeak's dictionaries say phrases ("of the", "es
/// ist") as one. One that has too few phones for its words stays one.
std::vector<std::string> wordsOfPhrase(std::string_view phrase, std::size_t phones) {
  std::vector<std::string> words;
  for (std::string_view rest = phrase; !rest.empty();) {
    const std::size_t end = std::min(rest.find(' '), rest.size());
    if (isSaid(rest.substr(0, end))) words.push_back(bareWord(rest.substr(0, end)));
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  if (words.empty() || (words.size() > 1 && words.size() > phones)) return {bareWord(phrase)};
  return words;
}

/// The written words of what was announced, each with its share of the phrase's phones by how many it has alone.
void partIntoWords(const FreshEspeak& espeak, EspeakRecording& recording) {
  EspeakSpeech& speech = recording.speech;
  auto event = speech.events.begin();
  for (std::size_t i = 0; i < recording.starts.size(); ++i) {
    const std::size_t start = recording.starts[i];
    const std::size_t end = i + 1 < recording.starts.size() ? recording.starts[i + 1] : recording.text.size();
    const auto own_end = std::find_if(event, speech.events.end(), [&](const EspeakEvent& e) { return e.word > i; });
    const auto phones =
        unsignedIndex(std::count_if(event, own_end, [](const EspeakEvent& e) { return !e.symbol.empty(); }));
    const std::vector<std::string> words =
        wordsOfPhrase(std::string_view(recording.text).substr(start, end - start), phones);
    std::vector<std::size_t> last(words.size(), 1);  // the phones up to each word's last
    if (words.size() > 1)
      std::transform(words.begin(), words.end(), last.begin(),
                     [&](const std::string& word) { return phonesAlone(espeak, word); });
    std::partial_sum(last.begin(), last.end(), last.begin());
    const std::size_t all = last.back();
    for (std::size_t w = 0; words.size() > 1 && w < words.size(); ++w) {
      const std::size_t before = w == 0 ? 0 : last[w - 1];
      last[w] = std::clamp((last[w] * phones + all / 2) / all, before + 1, phones + w + 1 - words.size());
    }
    std::size_t word = 0, said = 0;
    for (; event != own_end; ++event) {
      said += event->symbol.empty() ? 0U : 1U;
      while (word + 1 < words.size() && said > last[word]) ++word;
      event->word = speech.words.size() + word;
    }
    speech.words.insert(speech.words.end(), words.begin(), words.end());
  }
}

/// The words of a text without blanks between its characters (Chinese), or with.
std::vector<std::string> charactersOf(std::string_view text) {
  std::vector<std::string> characters;
  bool joins = false;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t begin = at;
    const auto c = decodeUtf8(text, at);
    if (!c) at = begin + 1;
    const bool is_word = c && isWordSign(*c);
    const bool is_alone = c && *c >= 0x2E80;
    if (is_word && (is_alone || !joins)) {
      characters.emplace_back(text.substr(begin, at - begin));
    } else if (is_word) {
      characters.back() += text.substr(begin, at - begin);
    }
    joins = is_word && !is_alone;
  }
  return characters;
}

}  // namespace

EspeakSpeech speakWithEspeak(std::string_view voice, const std::string& sentence, std::string_view written) {
  const EspeakLock lock;
  const std::unique_ptr<const FreshEspeak> espeak = freshEspeakOf(voice);
  EspeakRecording recording{.speech = {}, .text = sentence, .places = characterPlaces(sentence), .starts = {}};
  recording.speech.sample_rate_hz = espeak->rate_hz;
  const espeak_ERROR error =
      espeak->say(sentence.c_str(), sentence.size() + 1, 0, POS_CHARACTER, 0, espeakCHARS_UTF8, nullptr, &recording);
  if (error != EE_OK) throw InputError("espeak", "", fmt::format("could not say '{}'", printable(sentence)));
  recording.speech.transcriptions = transcriptionsOf(*espeak, sentence);
  partIntoWords(*espeak, recording);
  if (!written.empty()) {
    std::vector<std::string> shown = charactersOf(written);
    if (shown.size() == recording.speech.words.size()) recording.speech.words = std::move(shown);
  }
  return std::move(recording.speech);
}

void expectEspeakVoice(std::string_view voice) {
  const EspeakLock lock;
  auto espeak = freshEspeakOf(voice);
  waitingEspeak() = {std::string(voice), std::move(espeak)};
}

const std::vector<EspeakLanguage>& espeakLanguages() {
  static const std::vector<EspeakLanguage> kAll = [] {
    const EspeakLock lock;
    waitingEspeak() = {};
    const FreshEspeak espeak;
    std::vector<EspeakLanguage> all;
    if (espeak.rate_hz <= 0) return all;
    for (const espeak_VOICE** voice = espeak.list(nullptr); *voice != nullptr; ++voice) {
      if ((*voice)->languages == nullptr || *(*voice)->languages == '\0') continue;
      const std::string tag = (*voice)->languages + 1;
      const bool is_variant = std::string_view((*voice)->identifier).starts_with("mb/");
      const bool is_known = std::any_of(all.begin(), all.end(), [&](const auto& known) { return known.tag == tag; });
      if (!is_variant && !is_known) all.push_back({tag, (*voice)->name});
    }
    return all;
  }();
  return kAll;
}

}  // namespace mouthpiece
