#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "phonetics/text/lexicon.h"

namespace mouthpiece {

/// A word of a transcript and the ways it can be said, the usual one first.
struct TranscriptWord {
  std::string text;
  std::vector<Pronunciation> ways;
};

/// Finds how words are said: the user's lexicon first, then the CMU dictionary of PocketSphinx' package, then Flite's
/// dictionary and letter-to-sound rules. Stress is the lexicon's, else Flite's. Thread-safe.
class Pronouncer {
 public:
  /// `lexicon` is kept alive by the caller; nullptr for none.
  explicit Pronouncer(const Lexicon* lexicon = nullptr);
  ~Pronouncer();
  Pronouncer(Pronouncer&&) noexcept;
  Pronouncer& operator=(Pronouncer&&) noexcept;

  /// The words of `transcript` (UTF-8, hostile), numbers and signs spelled out. Throws InputError as speakableText
  /// does.
  [[nodiscard]] std::vector<TranscriptWord> wordsOf(std::string_view transcript) const;

 private:
  struct State;
  std::unique_ptr<const State> state_;
};

/// The usual pronunciation of every word of the CMU dictionary; empty where the dictionary is not installed.
std::vector<std::vector<Phone>> dictionaryWords();

}  // namespace mouthpiece
