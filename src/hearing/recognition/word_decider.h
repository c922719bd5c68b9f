#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "audio/audio_clip.h"
#include "hearing/alignment/forced_alignment.h"
#include "hearing/alignment/pronouncer.h"
#include "hearing/alignment/voice_transform.h"
#include "hearing/network/network_phones.h"
#include "hearing/network/word_network.h"
#include "hearing/recognition/known_lines.h"
#include "hearing/recognition/recogniser.h"
#include "hearing/recognition/sound_search.h"
#include "hearing/recognition/stretch_hearing.h"

namespace mouthpiece {

/// Words fit a stretch when their phones have this share of what is heard, in the mean over its frames.
inline constexpr double kWordsFit = 0.40;

/// Words for a stretch, with their phones on its clock.
struct WordsHeard {
  ForcedAlignment alignment;
  std::vector<double> fits;  ///< of each phone: its share of what is heard
  double fit = 0;            ///< of all, in the mean over time
  double believed = 1;       ///< as a transcript is, the least believed of its lines
  double word_odds = 0;      ///< logarithm of the odds of a word as a transcript's, the mean
};

/// Words of a model of the language for a stretch.
struct ModelWords {
  WordsHeard heard;
  double odds = 0;                ///< logarithm of the odds that many are wrong
  std::vector<double> word_odds;  ///< of each of its words, that it is; none where they are not the labels' words
  bool by_network = false;
};

/// What is heard of a stretch before it is known which words are taken.
struct UndecidedStretch {
  std::span<const std::int16_t> samples;  ///< 16 kHz
  AudioClip clip;                         ///< the same
  TimeSpan span;                          ///< on the sound's clock
  bool is_noisy;                          ///< the sound that it is of
  bool is_speaker;                        ///< PhoneEar::knowsSpeaker()
  VoiceTransform voice;                   ///< PhoneEar::voice()
  StretchHearing hearing;                 ///< by the ear alone, which the odds of words were learnt from
  HeardPhones by_network;                 ///< none where the network does not hear it
  std::optional<StretchHearing> by_both;  ///< by the ear and the network, where this hears it
  [[nodiscard]] const StretchHearing& phones() const { return by_both ? *by_both : hearing; }
};

/// The words that are taken for a stretch, if any, and the logarithm of the odds that much of them is wrong.
struct WordDecision {
  std::optional<WordsHeard> words;
  bool are_taken = false;  ///< else phones are heard, by the words where they fit
  bool by_model = false;   ///< no hint's or corpus' words
  bool by_hint = false;
  std::vector<double> word_odds;  ///< ModelWords::word_odds
  double odds = 0;
};

/// Where nothing but silence is heard without words, words of a model that are less likely said than not are what it
/// makes of noise: a network hears "you" in wind.
bool isNoSpeech(const WordDecision& decision, const StretchHearing& hearing);

/// Looks for the words of stretches: a hint's, a corpus' or a model's of the language
/// (docs/theory/hearing/recognition.md). Not thread-safe.
class WordDecider {
 public:
  /// Throws InputError where the hint is too long or cannot be said, and where there is no model of the language.
  explicit WordDecider(const RecogniserOptions& options);

  /// `by_network`: the network's words of the stretch, if any.
  WordDecision decide(const std::vector<NetworkWord>& by_network, const UndecidedStretch& stretch);

 private:
  /// PocketSphinx, from when it is first asked.
  WordSearch& search();
  /// The hint's words, where they are in its order: any sound is some row of them.
  std::optional<WordsHeard> hintedWords(const UndecidedStretch& stretch);
  /// Whether the corpus' lines may be said, by the network's words where it heard some.
  [[nodiscard]] bool mayBeKnown(const std::vector<NetworkWord>& by_network, bool is_speaker) const;
  /// The logarithm of the odds that much of the corpus' words is wrong, against a network's: those of its speaker are
  /// meant that follow each other as in its lines.
  [[nodiscard]] double oddsOfKnown(const WordsHeard& words, const UndecidedStretch& stretch, double in_order) const;
  std::optional<WordsHeard> wordsAs(std::string_view text, const UndecidedStretch& stretch);
  std::optional<ModelWords> wordsBySearch(const UndecidedStretch& stretch);
  std::optional<ModelWords> wordsByNetwork(const std::vector<NetworkWord>& words, const UndecidedStretch& stretch);
  /// The same with the hint's words in place of such as they sound like, where the network is not sure of these and the
  /// hint's are believed.
  ModelWords withHintedWords(ModelWords found, std::vector<NetworkWord> words, const UndecidedStretch& stretch);
  /// The likelier of both.
  std::optional<ModelWords> wordsByModels(const std::vector<NetworkWord>& by_network, const UndecidedStretch& stretch);

  HearAs as_;
  const Language& language_;
  Pronouncer pronouncer_;
  ForcedAligner aligner_;
  KnownLines hint_, lines_;
  std::optional<WordSearch> search_;
};

}  // namespace mouthpiece
