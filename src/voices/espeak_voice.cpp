#include <espeak-ng/speak_lib.h>
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cstring>
#include <mutex>
#include <utility>

#include "base/errors.h"
#include "base/index.h"
#include "phonetics/text/speakable_text.h"
#include "voices/engines.h"
#include "voices/spoken_line_builder.h"

namespace mouthpiece {
namespace {

constexpr int kIpaTranscription = 0x02;  // espeakPHONEMES_IPA

/// The library speaks one text at a time for the whole program.
std::mutex& espeakLock() {
  static std::mutex lock;
  return lock;
}

/// What one utterance makes while it is spoken.
struct Recording {
  int sample_rate_hz = 0;
  std::vector<float> samples;
  std::vector<EspeakEvent> events;
  std::string text;
  std::vector<std::string> words;
  std::size_t end_of_word = 0;  ///< where in the text the last word ended
};

/// `word` without the marks around it: "ten," is ten.
std::string bareWord(std::string_view word) {
  const auto is_sound = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0; };
  const auto first = std::find_if(word.begin(), word.end(), is_sound);
  const auto last = std::find_if(word.rbegin(), word.rend(), is_sound).base();
  return first < last ? std::string(first, last) : std::string(word);
}

/// A word reaches to the next blank: "42" is announced once for each word that it is read as.
void noteWord(Recording& recording, const espeak_EVENT& event) {
  const auto first = unsignedIndex(std::max(event.text_position, 1) - 1);
  if (first < recording.end_of_word || first >= recording.text.size()) return;
  recording.end_of_word = std::min(recording.text.find(' ', first), recording.text.size());
  recording.words.push_back(bareWord(std::string_view(recording.text).substr(first, recording.end_of_word - first)));
}

void notePhone(Recording& recording, const espeak_EVENT& event) {
  const std::size_t length = strnlen(event.id.string, sizeof event.id.string);
  if (recording.words.empty()) recording.words.emplace_back();
  recording.events.push_back({.time = asReal(event.sample) / recording.sample_rate_hz,
                              .symbol = std::string(event.id.string, length),
                              .word = recording.words.size() - 1});
}

/// eSpeak's callback: samples and the events among them.
int record(short* samples, int count, espeak_EVENT* events) {
  auto* recording = static_cast<Recording*>(events->user_data);
  if (recording == nullptr) return 0;
  for (const espeak_EVENT* event = events; event->type != espeakEVENT_LIST_TERMINATED; ++event) {
    if (event->type == espeakEVENT_WORD) noteWord(*recording, *event);
    if (event->type == espeakEVENT_PHONEME) notePhone(*recording, *event);
  }
  if (samples == nullptr) return 0;
  for (int i = 0; i < count; ++i) recording->samples.push_back(static_cast<float>(samples[i]) / 32768.0F);
  return 0;
}

/// Starts the library once; its sample rate, or 0 when its data are missing.
int startEspeak() {
  static const int rate = [] {
    const int found =
        espeak_Initialize(AUDIO_OUTPUT_SYNCHRONOUS, 0, nullptr,
                          espeakINITIALIZE_PHONEME_EVENTS | espeakINITIALIZE_PHONEME_IPA | espeakINITIALIZE_DONT_EXIT);
    espeak_SetSynthCallback(&record);
    return found;
  }();
  return rate;
}

/// Of the whole text: eSpeak transcribes clause by clause.
std::vector<int> stressesOf(const std::string& text, const Language& language) {
  std::vector<int> stresses;
  const void* rest = text.c_str();
  while (rest != nullptr) {
    const char* clause = espeak_TextToPhonemes(&rest, espeakCHARS_UTF8, kIpaTranscription);
    if (clause == nullptr) break;
    const std::vector<int> more = stressesOfEspeakText(clause, language);
    stresses.insert(stresses.end(), more.begin(), more.end());
  }
  return stresses;
}

class EspeakVoice : public Voice {
 public:
  EspeakVoice(std::string name, const Language& language) : name_(std::move(name)), language_(language) {
    const std::scoped_lock lock(espeakLock());
    choose();
  }

  SpokenLine speak(std::string_view text) override {
    const std::string speakable = speakableText(text, language_);
    const std::scoped_lock lock(espeakLock());
    choose();
    SpokenLineBuilder builder(language_);
    for (const std::string& sentence : splitSentences(speakable, kLongestUtterance)) addTo(builder, sentence);
    return builder.build(speakable, "espeak:" + name_);
  }

 private:
  /// The library has one voice at a time.
  void choose() const {
    if (startEspeak() <= 0 || espeak_SetVoiceByName(name_.c_str()) != EE_OK)
      throw InputError("espeak", "", "cannot find its voices (sudo apt-get install espeak-ng-data)");
  }

  void addTo(SpokenLineBuilder& builder, const std::string& sentence) const {
    Recording recording{.sample_rate_hz = startEspeak(), .samples = {}, .events = {}, .text = sentence, .words = {}};
    const espeak_ERROR error =
        espeak_Synth(sentence.c_str(), sentence.size() + 1, 0, POS_CHARACTER, 0, espeakCHARS_UTF8, nullptr, &recording);
    if (error != EE_OK) throw InputError("espeak", "", fmt::format("could not say '{}'", printable(sentence)));
    AudioClip audio{recording.sample_rate_hz, std::move(recording.samples)};
    std::vector<PhoneSegment> phones =
        phonesFromEspeak(recording.events, stressesOf(sentence, language_), audio, language_);
    builder.add(std::move(audio), std::move(phones), recording.words);
  }

  std::string name_;
  const Language& language_;
};

}  // namespace

std::unique_ptr<Voice> makeEspeakVoice(std::string_view name, const Language& language, const VoiceOptions&) {
  return std::make_unique<EspeakVoice>(std::string(name), language);
}

}  // namespace mouthpiece
