#pragma once

#include <array>

#include "phonetics/labels/speech_labels.h"

namespace mouthpiece {

/// How long phones usually are, by labelled lines. A phone that is rare in these is taken to be as long as its kind:
/// a consonant 70 ms, a vowel 1.4 and a diphthong 1.8 times as much.
class PhoneLengths {
 public:
  PhoneLengths();
  /// Learns from the phones of `labels`.
  void add(const SpeechLabels& labels);
  [[nodiscard]] Seconds of(Phone phone) const;

 private:
  struct Sum {
    Seconds length = 0;
    double count = 0;
  };
  std::array<Sum, kPhoneCount> sums_{};
};

}  // namespace mouthpiece
