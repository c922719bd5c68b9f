#pragma once

#include <string>

#include "voices/voice.h"

struct cst_voice_struct;

namespace mouthpiece {

/// One of the voices linked into the program through Flite's library.
class FliteVoice : public Voice {
 public:
  /// `name`: slt, rms, awb or kal16; InputError for any other.
  explicit FliteVoice(std::string name);
  SpokenLine speak(std::string_view text) override;

 private:
  std::string name_;
  cst_voice_struct* voice_;  ///< lives as long as the program, as Flite wants it
};

}  // namespace mouthpiece
