#include <utility>

#include "phonetics/language/espeak_library.h"
#include "phonetics/text/speakable_text.h"
#include "voices/engines.h"
#include "voices/spoken_line_builder.h"

namespace mouthpiece {
namespace {

class EspeakVoice : public Voice {
 public:
  EspeakVoice(std::string name, const Language& language) : name_(std::move(name)), language_(language) {
    expectEspeakVoice(engineName());
  }

  SpokenLine speak(std::string_view text) override {
    const std::string speakable = speakableText(text, language_);
    SpokenLineBuilder builder(language_);
    std::vector<std::string> unknown;
    for (const std::string& sentence : splitSentences(speakable, kLongestUtterance)) addTo(builder, sentence, unknown);
    return builder.build(speakable, "espeak:" + name_);
  }

 private:
  /// Of a language with a row of its own the voice that the row names.
  [[nodiscard]] std::string_view engineName() const {
    return language_.espeak_voice.empty() ? std::string_view(name_) : language_.espeak_voice;
  }

  void addTo(SpokenLineBuilder& builder, const std::string& sentence, std::vector<std::string>& unknown) const {
    const bool respelled = language_.respell != nullptr;
    EspeakSpeech speech = speakWithEspeak(engineName(), respelled ? language_.respell(sentence) : sentence,
                                          respelled ? std::string_view(sentence) : std::string_view());
    std::vector<int> stresses;
    for (const std::string& clause : speech.transcriptions) {
      const std::vector<int> more = stressesOfEspeakText(clause, language_);
      stresses.insert(stresses.end(), more.begin(), more.end());
    }
    AudioClip audio{speech.sample_rate_hz, std::move(speech.samples)};
    std::vector<PhoneSegment> phones = phonesFromEspeak(speech.events, stresses, audio, language_, unknown);
    builder.add(std::move(audio), std::move(phones), speech.words);
  }

  std::string name_;
  const Language& language_;
};

}  // namespace

std::unique_ptr<Voice> makeEspeakVoice(std::string_view name, const Language& language, const VoiceOptions&) {
  return std::make_unique<EspeakVoice>(std::string(name), language);
}

}  // namespace mouthpiece
