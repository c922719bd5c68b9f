#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "audio/audio_clip.h"
#include "corpus_tools/takes/take_report.h"
#include "phonetics/text/lexicon.h"
#include "phonetics/labels/speech_labels.h"

namespace mouthpiece {

class ForcedAligner;
class Pronouncer;

/// Finds the labels of takes that have none. Thread-safe: each thread at work has an aligner of its own.
class TakeLabeller {
 public:
  /// `lexicon` is kept alive by the caller. Nothing is loaded before the first take asks.
  explicit TakeLabeller(const Lexicon& lexicon);
  ~TakeLabeller();

  struct Labels {
    SpeechLabels labels;
    std::vector<DoubtfulWord> doubtful;
  };
  /// Throws InputError when the words cannot be said or do not fit the sound.
  Labels label(const AudioClip& audio, const std::string& text, const std::string& name);

 private:
  std::unique_ptr<ForcedAligner> takeAligner();

  const Lexicon& lexicon_;
  std::mutex mutex_;
  std::unique_ptr<Pronouncer> pronouncer_;
  std::vector<std::unique_ptr<ForcedAligner>> idle_;
};

}  // namespace mouthpiece
