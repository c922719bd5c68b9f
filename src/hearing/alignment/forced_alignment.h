#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "audio/audio_clip.h"
#include "hearing/alignment/pronouncer.h"
#include "hearing/alignment/samples_to_hear.h"
#include "phonetics/labels/speech_labels.h"

namespace mouthpiece {

/// When each phone of a known text is said in a sound.
struct ForcedAlignment {
  SpeechLabels labels;             ///< last until the end of the sound
  std::vector<double> confidence;  ///< of each of labels.words, 0 to 1
  /// Of each of labels.words, how far the stretch of some twelve words about it is believed as a whole; empty where
  /// that is not judged: sung words, languages besides English.
  std::vector<double> line_confidence = {};
  /// Words whose confidence is under kDoubtfulConfidence, in stretches whose own is; in such a stretch at least the
  /// least sure one. Indices into labels.words.
  [[nodiscard]] std::vector<std::size_t> doubtfulWords() const;
};

/// Says which words are doubtful and when they are said, and whether so many are that others may be said; "" for none.
std::string doubtsAbout(const ForcedAlignment& alignment);

class Aligner;
/// What makes labels that came with a sound doubtful, for the user: that other words are said in it, or that they lie
/// beside it. "" for nothing. `name` stands for the sound.
std::string doubtsAbout(const SpeechLabels& labels, const AudioClip& audio, Aligner& aligner, std::string_view name);

/// 2 in 100 stretches of right words are below (docs/theory/hearing/doubt.md).
inline constexpr double kDoubtfulConfidence = 0.5;

/// How words are said. Sung ones are heard with less of their held vowels and pauses, so that these do not outweigh the
/// consonants (docs/theory/hearing/sung_alignment.md).
enum class SpeechKind { kSpoken, kSung };
/// How near the borders of spoken phones are wanted: heard again, so that they lie between the decoder's steps of 10
/// ms, or as they were heard first.
enum class BorderTimes { kFine, kFirstHeard };

/// How likely each phone of English is at each time of a sound, whatever is said, by another ear than the aligner's: a
/// row a phone, by its number, and a column every kEarStep from kEarShift on. None: it was not heard.
using HeardPhones = Eigen::MatrixXf;

/// Finds known words in a sound. Not thread-safe; several may live side by side.
class Aligner {
 public:
  virtual ~Aligner() = default;
  /// `words`: see Pronouncer, or made by hand. `name` stands for the sound in messages. Throws InputError when there
  /// are no words, the sound is too short to hold them, or nobody speaks in it for certain.
  virtual ForcedAlignment align(const AudioClip& audio, const std::vector<TranscriptWord>& words, std::string_view name,
                                SpeechKind kind = SpeechKind::kSpoken, BorderTimes times = BorderTimes::kFine) = 0;
};

class PhoneDecoder;
class TextDoubt;

/// PocketSphinx' (docs/theory/hearing/alignment.md): several pronunciations tried, silence allowed between words, the
/// decoder's steps of 10 ms refined by hearing the row that was found again.
class ForcedAligner : public Aligner {
 public:
  /// `model`: folder of the acoustic model; empty: the language's.
  explicit ForcedAligner(const std::filesystem::path& model = {}, const Language& language = english());
  ~ForcedAligner() override;

  ForcedAlignment align(const AudioClip& audio, const std::vector<TranscriptWord>& words, std::string_view name,
                        SpeechKind kind = SpeechKind::kSpoken, BorderTimes times = BorderTimes::kFine) override;
  /// The same of a sound of which nothing else is kept: of an hour, it would take as much memory as all that is heard
  /// in it. `lasts`: how long it is. `heard` counts beside the acoustic model in spoken words.
  ForcedAlignment align(const SamplesToHear& samples, Seconds lasts, const std::vector<TranscriptWord>& words,
                        std::string_view name, SpeechKind kind, BorderTimes times = BorderTimes::kFine,
                        const HeardPhones& heard = {});
  /// align()'s labels of spoken words alone: judging how far these are believed takes more than half of its time.
  SpeechLabels labelsOf(const AudioClip& audio, const std::vector<TranscriptWord>& words, std::string_view name);

 private:
  struct Placed;
  Placed place(const SamplesToHear& samples, Seconds lasts, const std::vector<TranscriptWord>& words,
               std::string_view name, SpeechKind kind, BorderTimes times, const HeardPhones& heard);

  const Language& language_;
  std::unique_ptr<PhoneDecoder> decoder_;
  std::unique_ptr<TextDoubt> doubt_;  ///< made when the first text is judged
};

}  // namespace mouthpiece
