#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "audio/audio_clip.h"
#include "phonetics/labels/speech_labels.h"
#include "hearing/alignment/phone_decoder.h"
#include "hearing/alignment/pronouncer.h"

namespace mouthpiece {

/// When each phone of a known text is said in a sound.
struct ForcedAlignment {
  SpeechLabels labels;             ///< last until the end of the sound
  std::vector<double> confidence;  ///< of each of labels.words, 0 to 1
  /// Words whose confidence is under kDoubtfulConfidence: indices into labels.words.
  [[nodiscard]] std::vector<std::size_t> doubtfulWords() const;
};

/// Says which words are doubtful, and whether so many are that others may be said; "" for none.
std::string doubtsAbout(const ForcedAlignment& alignment);

/// Of the words that were really said under 1 in 100 is below, of wrong ones 9 in 10 (docs/theory/alignment.md).
inline constexpr double kDoubtfulConfidence = 0.5;

/// Aligns sound with text through PocketSphinx (docs/theory/alignment.md): several pronunciations tried, silence
/// allowed between words, the decoder's steps of 10 ms refined by hearing the sound again from later starts. Not
/// thread-safe; several may live side by side.
class ForcedAligner {
 public:
  /// `model`: see PhoneDecoder.
  explicit ForcedAligner(const std::filesystem::path& model = {}) : decoder_(model) {}

  /// `words`: see Pronouncer, or made by hand. `name` stands for the sound in messages. Throws InputError when there
  /// are no words, or the sound is too short to hold them.
  ForcedAlignment align(const AudioClip& audio, const std::vector<TranscriptWord>& words, std::string_view name,
                        SpeechKind kind = SpeechKind::kSpoken);

 private:
  PhoneDecoder decoder_;
};

}  // namespace mouthpiece
