#include "voices/voice.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>

#include "base/child_process.h"
#include "base/errors.h"
#include "base/text_encoding.h"
#include "phonetics/language/language_tag.h"
#include "voices/engines.h"

namespace mouthpiece {
namespace {

/// Adding a voice: one more row.
constexpr std::array kVoices = {
    VoiceRow{"festival:cmu_us_slt_arctic_hts", "a woman, by Festival's statistical synthesis", "en", makeFestivalVoice},
    VoiceRow{"festival:kal_diphone", "a man, by Festival's diphones; quick, and sings", "en", makeFestivalVoice},
    VoiceRow{"flite:slt", "a woman, linked into the program", "en", makeFliteVoice},
    VoiceRow{"flite:rms", "a man, linked into the program", "en", makeFliteVoice},
    VoiceRow{"flite:awb", "a Scotsman, linked into the program", "en", makeFliteVoice},
    VoiceRow{"flite:kal16", "a man, by diphones, linked into the program", "en", makeFliteVoice},
    VoiceRow{"espeak:en-us", "eSpeak NG's formant synthesis", "en", makeEspeakVoice},
    VoiceRow{"espeak:en-gb", "eSpeak NG's formant synthesis", "en", makeEspeakVoice},
    VoiceRow{"espeak:de", "eSpeak NG's formant synthesis", "de", makeEspeakVoice},
    VoiceRow{"espeak:es", "eSpeak NG's formant synthesis", "es", makeEspeakVoice},
    VoiceRow{"espeak:es-419", "eSpeak NG's formant synthesis", "es-419", makeEspeakVoice},
    VoiceRow{"espeak:fr", "eSpeak NG's formant synthesis", "fr", makeEspeakVoice},
    VoiceRow{"espeak:it", "eSpeak NG's formant synthesis", "it", makeEspeakVoice},
    VoiceRow{"espeak:pt", "eSpeak NG's formant synthesis", "pt", makeEspeakVoice},
    VoiceRow{"espeak:pt-br", "eSpeak NG's formant synthesis", "pt-BR", makeEspeakVoice},
    VoiceRow{"espeak:pl", "eSpeak NG's formant synthesis", "pl", makeEspeakVoice},
    VoiceRow{"espeak:nl", "eSpeak NG's formant synthesis", "nl", makeEspeakVoice},
    VoiceRow{"espeak:zh", "eSpeak NG's formant synthesis", "zh", makeEspeakVoice},
    VoiceRow{"corpus", "the corpus' own recordings", "en", makeCorpusVoice},
};

/// A voice that says by itself how words sound.
class OwnLexiconVoice : public Voice {
 public:
  OwnLexiconVoice(std::unique_ptr<Voice> voice, std::string name) : voice_(std::move(voice)), name_(std::move(name)) {}

  SpokenLine speak(std::string_view text) override {
    SpokenLine line = voice_->speak(text);
    if (!line.notice.empty()) line.notice += "; ";
    line.notice += fmt::format("the voice {} reads no lexicon: words are said as it knows them", name_);
    return line;
  }
  void speakInPieces(std::string_view text, const std::function<void(const SpokenPiece&)>& take) override {
    voice_->speakInPieces(text, take);
  }

 private:
  std::unique_ptr<Voice> voice_;
  std::string name_;
};

/// The corpus' recordings are chosen by what Festival would say.
bool readsLexicons(std::string_view name) {
  return (name.starts_with("festival:") || name == "corpus") && festivalAvailable();
}

}  // namespace

void Voice::speakInPieces(std::string_view text, const std::function<void(const SpokenPiece&)>& take) {
  SpokenLine line = speak(text);
  take({.labels = std::move(line.labels), .audio = {}});
  take({.labels = {}, .audio = std::move(line.audio)});
}

std::span<const VoiceRow> voices() { return kVoices; }

std::vector<std::string> knownVoices() {
  std::vector<std::string> names;
  for (const VoiceRow& row : kVoices) names.emplace_back(row.name);
  return names;
}

namespace {

/// "espeak:sv" is a voice, too, though the table lacks it.
VoiceRow rowOfVoice(std::string_view name) {
  const auto row =
      std::find_if(kVoices.begin(), kVoices.end(), [&](const VoiceRow& known) { return known.name == name; });
  if (row != kVoices.end()) return *row;
  constexpr std::string_view kEspeak = "espeak:";
  if (name.starts_with(kEspeak)) {
    const Language& language = languageOf(name.substr(kEspeak.size()));
    if (!language.espeak_voice.empty()) return {name, "eSpeak NG's formant synthesis", language.tag, makeEspeakVoice};
  }
  throw InputError(
      fmt::format("found voice '{}'; expected one of {}", printable(name), fmt::join(knownVoices(), ", ")));
}

}  // namespace

const Language& languageOfVoice(std::string_view name) { return languageOf(rowOfVoice(name).language); }

std::string voiceFor(const Language& language) {
  for (const VoiceRow& row : kVoices) {
    if (&languageOf(row.language) == &language) return std::string(row.name);
  }
  if (!language.espeak_voice.empty()) return fmt::format("espeak:{}", language.tag);
  throw InputError(
      fmt::format("found text to speak in {}, which no voice says; expected a recording of it", language.name));
}

std::optional<std::string> voiceOfRegion(std::string_view tag) {
  constexpr std::string_view kEspeak = "espeak:";
  const std::string wanted = plainTag(tag);
  for (const VoiceRow& row : kVoices) {
    if (!row.name.starts_with(kEspeak)) continue;
    const std::string_view region = row.name.substr(kEspeak.size());
    const bool is_region = lowerCase(row.language) != region && region != "en-us";
    if (is_region && wanted.starts_with(region) && (wanted.size() == region.size() || wanted[region.size()] == '-'))
      return std::string(row.name);
  }
  return std::nullopt;
}

std::unique_ptr<Voice> makeVoice(std::string_view name, const VoiceOptions& options) {
  const VoiceRow row = rowOfVoice(name);
  std::unique_ptr<Voice> voice = row.make(name.substr(name.find(':') + 1), languageOf(row.language), options);
  if (options.lexicon == nullptr || readsLexicons(name)) return voice;
  return std::make_unique<OwnLexiconVoice>(std::move(voice), std::string(name));
}

bool festivalAvailable() { return findProgram("festival").has_value(); }

}  // namespace mouthpiece
