#pragma once

#include <filesystem>
#include <string>

#include "voices/voice.h"

namespace mouthpiece {

/// Festival as a child process: one run a line. The text is a file that Festival's tokeniser reads as data.
class FestivalVoice : public Voice {
 public:
  /// `voice` is Festival's own name ("kal_diphone"), one of ours: it becomes part of a Scheme program.
  FestivalVoice(std::filesystem::path program, std::string voice, const Lexicon* lexicon);
  SpokenLine speak(std::string_view text) override;

 private:
  std::filesystem::path program_;
  std::string voice_;
  const Lexicon* lexicon_;
};

}  // namespace mouthpiece
