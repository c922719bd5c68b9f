#pragma once

#include <string>
#include <vector>

#include "phonetics/labels/labels_builder.h"
#include "voices/voice.h"

namespace mouthpiece {

/// Letters that Flite and eSpeak are given at a time: their memory and time grow with the longest utterance.
inline constexpr std::size_t kLongestUtterance = 400;

/// `speakable` with its words in nothing but capitals, of two and more, in lower case: English voices take some of them
/// for abbreviations (HI: Hawaii, AM: in the morning). What is to be spelled stands as single letters.
std::string withoutLoudWords(std::string speakable);

/// Joins the utterances that a voice made of a line: sound after sound, labels on the common clock. Where sound and
/// labels of an utterance differ in length, the shorter is filled with silence.
class SpokenLineBuilder {
 public:
  explicit SpokenLineBuilder(const Language& language = english()) : language_(language) {}
  /// Utterances without phones are left out.
  void add(AudioClip audio, std::vector<PhoneSegment> phones, const std::vector<std::string>& words);
  /// Whether nothing was said so far.
  [[nodiscard]] bool isEmpty() const { return line_.labels.phones.empty(); }
  /// Words are spelled as `text`, which was said, has them: Flite's "mother" "'s" is one word. Throws InputError when
  /// nothing was said.
  SpokenLine build(std::string text, std::string voice);

 private:
  const Language& language_;
  SpokenLine line_;
};

}  // namespace mouthpiece
