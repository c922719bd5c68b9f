#pragma once

#include <utility>
#include <vector>

#include "phonetics/labels/speech_labels.h"

namespace mouthpiece::samples {

/// Phones of given lengths between two silences of 0.5 s, in no word.
inline SpeechLabels spokenPhones(const std::vector<std::pair<Phone, Seconds>>& phones) {
  SpeechLabels labels;
  Seconds at = 0.5;
  labels.phones.push_back({Phone::kSil, {0, at}, {}, {}});
  for (const auto& [phone, length] : phones) {
    labels.phones.push_back({phone, {at, at + length}, {}, {}});
    at += length;
  }
  labels.phones.push_back({Phone::kSil, {at, at + 0.5}, {}, {}});
  return labels;
}

}  // namespace mouthpiece::samples
