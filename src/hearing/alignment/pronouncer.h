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

/// Finds how words are said: the user's lexicon first, then the language's dictionary (English: CMU's of PocketSphinx'
/// package), then its rules (English: Flite's); another language's engine says the line as a whole (Language::say).
/// Stress is the lexicon's, else the rules'. Thread-safe.
class Pronouncer {
 public:
  /// `lexicon` is kept alive by the caller; nullptr for none.
  explicit Pronouncer(const Lexicon* lexicon = nullptr, const Language& language = english());
  ~Pronouncer();
  Pronouncer(Pronouncer&&) noexcept;
  Pronouncer& operator=(Pronouncer&&) noexcept;

  /// The words of `transcript` (UTF-8, hostile), numbers and signs spelled out. Throws InputError as speakableText
  /// does.
  [[nodiscard]] std::vector<TranscriptWord> wordsOf(std::string_view transcript) const;

  /// wordsOf() of a word that comes without its neighbours. `is_loud`: no word beside it has small letters, so that its
  /// capitals say nothing: it is read as a word where the lexicon or the dictionary has it, and not spelled.
  [[nodiscard]] std::vector<TranscriptWord> wordsOf(std::string_view word, bool is_loud) const;

  [[nodiscard]] const Language& language() const;

  /// Whether the lexicon or the language's dictionary has the word, so that nobody guesses; true for what is no word
  /// of letters, and where the language has no dictionary.
  [[nodiscard]] bool knows(std::string_view word) const;

 private:
  struct State;
  std::unique_ptr<const State> state_;
};

/// The usual pronunciation of every word of the language's dictionary; empty where that is not installed.
std::vector<std::vector<Phone>> dictionaryWords(const Language& language = english());

}  // namespace mouthpiece
