#include "voices/voice.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>

#include "base/child_process.h"
#include "base/errors.h"
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

 private:
  std::unique_ptr<Voice> voice_;
  std::string name_;
};

/// The corpus' recordings are chosen by what Festival would say.
bool readsLexicons(std::string_view name) {
  return (name.starts_with("festival:") || name == "corpus") && festivalAvailable();
}

}  // namespace

std::span<const VoiceRow> voices() { return kVoices; }

std::vector<std::string> knownVoices() {
  std::vector<std::string> names;
  for (const VoiceRow& row : kVoices) names.emplace_back(row.name);
  return names;
}

std::unique_ptr<Voice> makeVoice(std::string_view name, const VoiceOptions& options) {
  const auto row =
      std::find_if(kVoices.begin(), kVoices.end(), [&](const VoiceRow& known) { return known.name == name; });
  if (row == kVoices.end()) {
    throw InputError(
        fmt::format("found voice '{}'; expected one of {}", printable(name), fmt::join(knownVoices(), ", ")));
  }
  std::unique_ptr<Voice> voice = row->make(name.substr(name.find(':') + 1), languageOf(row->language), options);
  if (options.lexicon == nullptr || readsLexicons(name)) return voice;
  return std::make_unique<OwnLexiconVoice>(std::move(voice), std::string(name));
}

bool festivalAvailable() { return findProgram("festival").has_value(); }

}  // namespace mouthpiece
