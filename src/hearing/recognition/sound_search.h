#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "hearing/alignment/voice_transform.h"
#include "hearing/recognition/recogniser.h"
#include "phonetics/language/language.h"

namespace mouthpiece {

/// Words that follow each other as in some lines, or in another order, which is less likely.
struct PhraseBook {
  /// Each a row of words of the dictionary, or of `more`.
  std::vector<std::vector<std::string>> lines;
  /// Words that the dictionary may lack.
  std::vector<std::pair<std::string, std::vector<Phone>>> more;
};

/// Words that were found.
struct FoundWords {
  std::vector<std::string> words;
  /// Of each word, natural logarithm: how many different words the search kept in its middle. Empty for a book's words.
  std::vector<double> rivals = {};
};

/// PocketSphinx' search for words. Not thread-safe.
class WordSearch {
 public:
  /// Throws InputError where the language's models are not there, and for a language without.
  explicit WordSearch(const Language& language);
  ~WordSearch();

  /// Whether the language has what is needed.
  static bool isAvailable(const Language& language);

  /// The likeliest words of the language in a sound of 16 kHz, by its language model. `voice`: of who says them.
  FoundWords hear(std::span<const std::int16_t> samples, const VoiceTransform& voice = {});

  /// What hearBook() hears by under this name.
  void setBook(const std::string& name, const PhraseBook& book);
  /// The likeliest words of the book; none of one without words.
  std::vector<std::string> hearBook(const std::string& name, std::span<const std::int16_t> samples,
                                    const VoiceTransform& voice = {});

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace mouthpiece
