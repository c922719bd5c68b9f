#pragma once

#include <string>

#include "voices/voice.h"

namespace mouthpiece {

/// eSpeak NG's formant synthesis, through its library; American English. Quick; its breath is
/// never quite the same twice.
class EspeakVoice : public Voice {
 public:
  /// `name`: en-us; InputError for any other, and when eSpeak's data are not installed.
  explicit EspeakVoice(std::string name);
  SpokenLine speak(std::string_view text) override;

 private:
  std::string name_;
};

}  // namespace mouthpiece
