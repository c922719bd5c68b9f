#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <unordered_map>

#include "phonetics/labels/speech_labels.h"
#include "phonetics/language/language.h"

namespace mouthpiece {

/// Where words are likely to begin and which vowels are stressed among phones of which nobody said so, by what labelled
/// lines have in the same surroundings (docs/theory/phonetics/phones_and_visemes.md#phones-without-words). Knowing no
/// lines it stresses every full vowel and cuts no words.
class LikelyWords {
 public:
  explicit LikelyWords(const Language& language = english()) : language_(&language) {}

  /// Whether `labels` have phones without a word: else complete() gives back what it is given.
  [[nodiscard]] static bool areNeededFor(const SpeechLabels& labels);

  /// Learns from the words and the stress of `labels`.
  void add(const SpeechLabels& labels);

  /// `labels` whose phones are all in words: those that had none in likely ones, whose text is "". Times and phones are
  /// as they were.
  [[nodiscard]] SpeechLabels complete(const SpeechLabels& labels) const;

 private:
  struct Count {
    double yes = 0, all = 0;
  };
  /// How often something is so in surroundings that get wider from one to the next.
  using Surroundings = std::array<std::uint32_t, 3>;
  using Counts = std::unordered_map<std::uint32_t, Count>;
  static void count(Counts& counts, const Surroundings& surroundings, bool is_so);
  [[nodiscard]] static double chance(const Counts& counts, const Surroundings& surroundings, double usual);
  /// Which of the phones [first, end), a run without words, begin a word.
  [[nodiscard]] std::vector<bool> wordStarts(const SpeechLabels& labels, std::size_t first, std::size_t end) const;
  [[nodiscard]] bool isStressed(const SpeechLabels& labels, std::size_t vowel) const;

  const Language* language_;
  Counts edges_, stresses_;
  Count all_edges_;
};

}  // namespace mouthpiece
