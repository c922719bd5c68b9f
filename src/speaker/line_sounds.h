#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "hearing/alignment/pronouncer.h"
#include "mouthpiece/corpus.h"
#include "mouthpiece/speaker.h"
#include "phonetics/labels/likely_words.h"
#include "phonetics/text/lexicon.h"
#include "singing/sung_line.h"
#include "speaker/speaker_data.h"
#include "synthesis/synthesis.h"
#include "voices/voice.h"

namespace mouthpiece {

class ForcedAligner;
struct ForcedAlignment;
class SamplesToHear;
class Recogniser;
class WordNetwork;
struct LabelledSound;

/// Takes whose sound tells how the corpus' speaker says his phones, at most so many, evenly spaced.
std::vector<LabelledSound> soundsOf(const Corpus& corpus, std::size_t most);

/// A line's sound and labels; of a song, what is heard in it.
struct LineSound : SungLine {
  std::vector<double> confidence = {};  ///< of each phone of a recording that was recognised, in [0, 1]; else empty
};

/// Makes the sound and the labels of one line after another: a voice speaks it, its words are found in a recording, or
/// are heard there, or it is sung. What takes long to make is made for the first line that needs it, and kept.
class LineSounds {
 public:
  /// What is referred to outlives this. `lexicon`: the user's, or null.
  LineSounds(const SpeakerOptions& options, SharedCorpus corpus, const SynthesisOptions& synthesis,
             const Language& language, const Lexicon* lexicon);
  LineSounds(const LineSounds&) = delete;
  LineSounds& operator=(const LineSounds&) = delete;
  ~LineSounds();

  /// Throws InputError for files that cannot be read, text that cannot be spoken, sound in which nothing is said.
  LineSound soundOf(const Line& line);
  /// The labels with their phones all in words.
  SpeechLabels withLikelyWords(SpeechLabels labels);
  /// The words, as places in `labels`, that neither the lexicon nor the language's dictionary has.
  std::vector<std::size_t> guessedWords(const SpeechLabels& labels);

 private:
  LineSound alignRecording(const Line& line);
  LineSound hearRecording(const Line& line);
  LineSound readLabelled(const Line& line);
  LineSound speak(const std::string& text);
  LineSound speakOrRead(const Line& line);
  /// A song that is written down, sung by a voice or beside a recording of it.
  LineSound songOf(const Line& line);
  /// Asks the network about what the alignment is not sure of; says what is wrong where it cannot.
  std::string judge(const SamplesToHear& to_hear, ForcedAlignment& alignment);
  /// Of words that another program heard in `audio`: what a transcript's would be told.
  std::string doubtsAboutTimes(const AudioClip& audio, const std::string& text, std::string_view name);
  ForcedAligner& aligner();
  Pronouncer& pronouncer();
  const std::shared_ptr<WordNetwork>& network();

  const SpeakerOptions& options_;
  SharedCorpus corpus_;
  const SynthesisOptions& synthesis_;
  const Language& language_;
  const Lexicon* lexicon_;
  std::optional<Lexicon> line_lexicon_;  ///< the same for the line at hand: pronunciations that the corpus can speak
  std::unique_ptr<Voice> voice_;
  std::unique_ptr<Pronouncer> pronouncer_;
  std::unique_ptr<ForcedAligner> aligner_;
  std::unique_ptr<Recogniser> recogniser_;
  std::string recogniser_hint_;
  std::shared_ptr<WordNetwork> word_network_;
  std::optional<LikelyWords> likely_words_;  ///< of the corpus
};

}  // namespace mouthpiece
