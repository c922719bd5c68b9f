#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "base/time.h"

namespace mouthpiece {

/// What eSpeak tells while it speaks, in order. A phone's time is when its sound sets on: of a stop, the burst.
struct EspeakEvent {
  Seconds time = 0;
  std::string symbol;  ///< IPA; "" for a pause
  std::size_t word = 0;
};

/// One sentence as eSpeak NG speaks it.
struct EspeakSpeech {
  int sample_rate_hz = 0;
  std::vector<float> samples;
  std::vector<EspeakEvent> events;
  std::vector<std::string> words;           ///< as they are written, without the marks around them
  std::vector<std::string> transcriptions;  ///< of its clauses, in IPA with stress
};

/// eSpeak NG's library speaks one text at a time for the whole program: thread-safe by a lock. `voice`: a language of
/// its list ("de", "en-us"). `written`: the same words in the script that they are to be shown in, where that is
/// another; "" for `sentence`. Throws InputError when the voice or its data are missing.
EspeakSpeech speakWithEspeak(std::string_view voice, const std::string& sentence, std::string_view written = {});

/// Throws the same.
void expectEspeakVoice(std::string_view voice);

/// A language of eSpeak NG's list.
struct EspeakLanguage {
  std::string tag;   ///< "sv"
  std::string name;  ///< "Swedish"
};
/// All of them; none where it is not installed.
const std::vector<EspeakLanguage>& espeakLanguages();

}  // namespace mouthpiece
