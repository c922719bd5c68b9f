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
  return row->make(name.substr(name.find(':') + 1), languageOf(row->language), options);
}

bool festivalAvailable() { return findProgram("festival").has_value(); }

}  // namespace mouthpiece
