#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "phonetics/language/phone.h"

namespace mouthpiece {

/// How one word can be said.
struct Pronunciation {
  std::vector<Phone> phones;
  std::vector<int> stress;  ///< a value a phone: 0, 1, 2 where a vowel's digit says so, -1 where nothing does
};

/// Words and their pronunciations (docs/formats/labels.md). A single capital letter is the spoken name of the letter.
class Lexicon {
 public:
  /// Lines of "word phone phone ..."; "word(2)" is a further pronunciation; '#' starts a comment line. Throws
  /// InputError naming file and line for a word without phones, or phones that are not ARPAbet.
  static Lexicon read(const std::filesystem::path& path);
  static Lexicon parse(std::string_view text, std::string_view name);

  /// All pronunciations, the first the usual one; empty when the word is unknown. Looks for the word as it is written,
  /// then in lower case, then (longer words only) in capitals: "A" is the letter, "a" the article.
  [[nodiscard]] const std::vector<Pronunciation>& find(std::string_view word) const;

  /// Makes pronunciation `way` of a word the usual one; nothing happens for an unknown word or way.
  void putFirst(std::string_view word, std::size_t way);

  [[nodiscard]] std::size_t size() const { return words_.size(); }
  [[nodiscard]] const std::map<std::string, std::vector<Pronunciation>, std::less<>>& words() const { return words_; }

 private:
  [[nodiscard]] std::string keyOf(std::string_view word) const;

  std::map<std::string, std::vector<Pronunciation>, std::less<>> words_;
};

}  // namespace mouthpiece
