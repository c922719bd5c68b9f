#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "audio/audio_clip.h"
#include "phonetics/speech_labels.h"

namespace mouthpiece {

/// A line as a voice spoke it: the sound and, on the same clock, its labels.
struct SpokenLine {
  AudioClip audio;
  SpeechLabels labels;
  std::string text;   ///< what was asked for, cleaned
  std::string voice;  ///< the voice that really spoke, e.g. "festival:cmu_us_slt_arctic_hts"
  std::string notice; ///< a word to the user (e.g. "Festival is not installed: speaking with flite:slt"), or ""
};

/// Turns text into speech. Not thread-safe.
class Voice {
 public:
  virtual ~Voice() = default;
  /// `text` is UTF-8 and hostile. Throws InputError for text with nothing to say in it, in a script the
  /// voice cannot read, or too long.
  virtual SpokenLine speak(std::string_view text) = 0;
};

/// Makes the voice of that name: "festival:cmu_us_slt_arctic_hts", "festival:kal_diphone", "flite:slt|rms|awb|kal16".
/// A missing Festival falls back on Flite, said in SpokenLine::notice. Throws InputError for an unknown
/// name, listing the known ones.
std::unique_ptr<Voice> makeVoice(std::string_view name);

}  // namespace mouthpiece
