#include "voices/voice.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <utility>

#include "base/errors.h"
#include "base/child_process.h"
#include "voices/corpus_voice.h"
#include "voices/espeak_voice.h"
#include "voices/festival_voice.h"
#include "voices/flite_voice.h"

namespace mouthpiece {
namespace {

constexpr std::string_view kFallback = "slt";
constexpr std::string_view kReader = "kal_diphone";  // quick, and only its phones are used

/// Speaks with another voice than was asked for, and says so.
class StandInVoice : public Voice {
 public:
  StandInVoice(std::unique_ptr<Voice> voice, std::string notice)
      : voice_(std::move(voice)), notice_(std::move(notice)) {}
  SpokenLine speak(std::string_view text) override {
    SpokenLine line = voice_->speak(text);
    line.notice = notice_;
    return line;
  }

 private:
  std::unique_ptr<Voice> voice_;
  std::string notice_;
};

std::unique_ptr<Voice> makeFestivalVoice(std::string_view name, const VoiceOptions& options) {
  if (const auto program = findProgram("festival")) {
    return std::make_unique<FestivalVoice>(*program, std::string(name), options.lexicon);
  }
  return std::make_unique<StandInVoice>(
      std::make_unique<FliteVoice>(std::string(kFallback)),
      fmt::format(
          "Festival is not installed (sudo apt-get install festival festvox-us-slt-hts): speaking with flite:{}",
          kFallback));
}

std::unique_ptr<Voice> makeCorpusVoice(const VoiceOptions& options) {
  if (options.corpus == nullptr) throw InputError("found no corpus for the voice 'corpus'; expected one to speak with");
  CorpusVoiceOptions speaking;
  speaking.selection = options.selection;
  speaking.rate = options.rate;
  return std::make_unique<CorpusVoice>(makeFestivalVoice(kReader, options), *options.corpus, speaking);
}

}  // namespace

std::vector<std::string> knownVoices() {
  return {"festival:cmu_us_slt_arctic_hts",
          "festival:kal_diphone",
          "flite:slt",
          "flite:rms",
          "flite:awb",
          "flite:kal16",
          "espeak:en-us",
          "corpus"};
}

std::unique_ptr<Voice> makeVoice(std::string_view name, const VoiceOptions& options) {
  const std::vector<std::string> known = knownVoices();
  if (std::find(known.begin(), known.end(), name) == known.end()) {
    throw InputError(fmt::format("found voice '{}'; expected one of {}", printable(name), fmt::join(known, ", ")));
  }
  if (name == "corpus") return makeCorpusVoice(options);
  const std::size_t colon = name.find(':');
  const std::string_view own_name = name.substr(colon + 1);
  if (name.substr(0, colon) == "festival") return makeFestivalVoice(own_name, options);
  if (name.substr(0, colon) == "espeak") return std::make_unique<EspeakVoice>(std::string(own_name));
  return std::make_unique<FliteVoice>(std::string(own_name));
}

bool festivalAvailable() { return findProgram("festival").has_value(); }

}  // namespace mouthpiece
