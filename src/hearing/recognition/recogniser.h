#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "audio/audio_clip.h"
#include "hearing/alignment/phone_ear.h"
#include "hearing/alignment/speech_finder.h"
#include "hearing/network/word_network.h"
#include "phonetics/labels/labels_builder.h"
#include "phonetics/labels/speech_labels.h"
#include "phonetics/language/language.h"
#include "phonetics/text/lexicon.h"

namespace mouthpiece {

/// What was heard in a sound of which no one has written the words.
struct HeardSpeech {
  SpeechLabels labels;                  ///< to the end of the sound
  std::vector<double> confidence;       ///< of each of labels.phones, 0 to 1; silences too
  std::string text;                     ///< the words that were recognised, blanks between them; "" for none
  std::vector<SoundStretch> stretches;  ///< all but silence, in order
  std::vector<std::string> warnings;    ///< what is doubtful, for the user
  std::vector<std::string> notices;     ///< what is no doubt, but worth telling
};

/// Says what is said in a sound. Not thread-safe.
class Recogniser {
 public:
  virtual ~Recogniser() = default;
  /// `name` stands for the sound in messages. A sound that is moved here is let go before it is heard: what is
  /// heard of it takes half as much or less. Throws InputError where there is nothing to hear.
  virtual HeardSpeech hear(AudioClip audio, std::string_view name) = 0;
};

enum class HearAs {
  kAuto,   ///< words where they are likely, phones elsewhere
  kWords,  ///< words everywhere
  kPhones  ///< phones everywhere: any language
};

struct RecogniserOptions {
  HearAs as = HearAs::kAuto;
  std::string hint = {};                ///< words and phrases that are likely; UTF-8, hostile
  std::vector<std::string> known = {};  ///< lines that may be said again, less likely than `hint`: a corpus' own
  /// Of a person who may have said it: learnt from, where the recording sounds like them (PhoneEar::learn).
  SpeakerSounds speaker = {};
  const Lexicon* lexicon = nullptr;  ///< kept alive by the caller
  const Language* language = &english();
  /// Hears English words; where it is not there PocketSphinx hears them alone.
  std::shared_ptr<WordNetwork> word_network = {};
};

/// A network's words, PocketSphinx' and our own loop of phones (docs/theory/hearing/recognition.md). Memory is bounded
/// by a stretch between pauses, 20 s at most. Throws InputError without an acoustic model.
std::unique_ptr<Recogniser> makeRecogniser(const RecogniserOptions& options);

/// The confidence of each phone of labels that were built from `segments`, whose confidences are given; silences: 1.
std::vector<double> confidenceOf(const SpeechLabels& labels, const std::vector<PhoneSegment>& segments,
                                 const std::vector<double>& confidence);

}  // namespace mouthpiece
