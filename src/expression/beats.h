#pragma once

#include <cstdint>
#include <random>
#include <vector>

#include "phonetics/labels/speech_labels.h"

namespace mouthpiece {

/// A word, or a pause or a part of a long one: what the upper face and the head go by.
struct Beat {
  TimeSpan span;
  bool is_silence = false;
  bool starts_phrase = false, ends_phrase = false;  ///< a pause is before, after it; of a pause: the line's first, last
  bool is_accented = false;
  Seconds accent = 0;  ///< the middle of its stressed vowel
};

/// A word bears an accent when it ends its phrase or its stressed vowel is longer than is usual in the line.
std::vector<Beat> beatsOf(const SpeechLabels& labels);

/// Numbers that are the same on every machine.
class Dice {
 public:
  explicit Dice(std::uint32_t seed) : random_(seed) {}
  /// In [0, 1).
  double share() { return static_cast<double>(random_()) / 4294967296.0; }
  double between(double least, double most) { return least + (most - least) * share(); }
  bool falls(double probability) { return share() < probability; }

 private:
  std::mt19937 random_;
};

}  // namespace mouthpiece
