#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "phonetics/labels/speech_labels.h"
#include "phonetics/language/language.h"

namespace mouthpiece {

/// Words and their pronunciations (docs/formats/labels.md). A single capital letter is the spoken name of the letter.
class Lexicon {
 public:
  /// Lines of "word phone phone ..."; "word(2)" is a further pronunciation; '#' starts a comment line. Throws
  /// InputError naming file and line for a word without phones, or phones that the set does not know.
  /// Its phones are ARPAbet, IPA or X-SAMPA: what a comment "# phones: IPA" says, else what most of them are; ARPAbet
  /// in doubt (docs/formats/labels.md). A word in IPA may be written in one go with its stress: "Brücke ˈbʁʏkə".
  static Lexicon read(const std::filesystem::path& path, const Language& language = english());
  static Lexicon parseAnySet(std::string_view text, std::string_view name, const Language& language = english());
  /// `set`: how its phones are written. `name` stands for the file in messages.
  static Lexicon parse(std::string_view text, std::string_view name, PhoneSet set = PhoneSet::kArpabet,
                       const Language& language = english());

  /// All pronunciations, the first the usual one; empty when the word is unknown. Looks for the word as it is written,
  /// then in lower case, then (longer words only) in capitals: "A" is the letter, "a" the article.
  [[nodiscard]] const std::vector<Pronunciation>& find(std::string_view word) const;

  /// Says `word`, which is looked for as it is written, as `said`, whatever was known of it.
  void add(std::string word, Pronunciation said) { words_[std::move(word)] = {std::move(said)}; }

  /// Makes pronunciation `way` of a word the usual one; nothing happens for an unknown word or way.
  void putFirst(std::string_view word, std::size_t way);

  [[nodiscard]] std::size_t size() const { return words_.size(); }
  [[nodiscard]] const std::map<std::string, std::vector<Pronunciation>, std::less<>>& words() const { return words_; }

 private:
  [[nodiscard]] std::string keyOf(std::string_view word) const;

  std::map<std::string, std::vector<Pronunciation>, std::less<>> words_;
};

/// Which phones follow each other somewhere in a corpus.
class PhonePairs {
 public:
  void add(const SpeechLabels& labels);
  void add(Phone first, Phone second) {
    pairs_[static_cast<std::size_t>(first)][static_cast<std::size_t>(second)] = true;
  }
  [[nodiscard]] bool has(Phone first, Phone second) const {
    return pairs_[static_cast<std::size_t>(first)][static_cast<std::size_t>(second)];
  }

 private:
  std::array<std::array<bool, kPhoneCount>, kPhoneCount> pairs_{};
};

/// `lexicon` for saying `line`: of each word's pronunciations the one first with which the fewest phone pairs of the
/// line are missing in the corpus ("at" as AE T or AH T); where several do, the usual one. Within the words, between
/// neighbours, and around the silence at punctuation and at the ends; next to a word that the lexicon lacks nothing is
/// judged. A word that comes twice is said alike.
Lexicon lexiconForLine(const Lexicon& lexicon, std::string_view line, const PhonePairs& pairs);

}  // namespace mouthpiece
