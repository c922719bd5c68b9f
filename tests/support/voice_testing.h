#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <string>

#include "support/error_of.h"
#include "voices/voice.h"

namespace mouthpiece {

inline std::string namesOf(const SpeechLabels& labels) {
  std::string names;
  for (const auto& phone : labels.phones) {
    if (!names.empty()) names += ' ';
    names += phoneName(phone.phone);
  }
  return names;
}

inline std::string wordsOf(const SpeechLabels& labels) {
  std::string words;
  for (const auto& word : labels.words) {
    if (!words.empty()) words += ' ';
    words += word.text;
  }
  return words;
}

/// What wordsOf() tells where every written word is said: `text` without the marks around its words.
inline std::string plainWordsOf(std::string_view text) {
  std::string words;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool is_inside = text[i] == '\'' && i > 0 && text[i - 1] != ' ' && i + 1 < text.size() && text[i + 1] != ' ';
    const bool is_mark = std::string_view(".,;:!?-\"()' ").find(text[i]) != std::string_view::npos && !is_inside;
    if (!is_mark) words += text[i];
    if (is_mark && !words.empty() && words.back() != ' ') words += ' ';
  }
  while (words.ends_with(' ')) words.pop_back();
  return words;
}

/// Mean square of the samples in phones that are (or are not) silence.
inline double meanPower(const SpokenLine& line, bool in_silence) {
  double sum = 0;
  std::size_t count = 0;
  for (const auto& phone : line.labels.phones) {
    if ((phone.phone == Phone::kSil) != in_silence) continue;
    const auto first = static_cast<std::size_t>(phone.span.start * line.audio.sample_rate_hz);
    const auto end = static_cast<std::size_t>(phone.span.end * line.audio.sample_rate_hz);
    for (std::size_t i = first; i < end && i < line.audio.samples.size(); ++i, ++count) {
      sum += static_cast<double>(line.audio.samples[i]) * line.audio.samples[i];
    }
  }
  return count == 0 ? 0 : sum / static_cast<double>(count);
}

/// What every voice owes for every line.
inline void expectGoodLine(const SpokenLine& line) {
  EXPECT_NO_THROW(expectConsistent(line.labels));
  EXPECT_NEAR(line.labels.duration(), line.audio.duration(), 1e-3);
  EXPECT_GT(line.audio.sample_rate_hz, 0);
  // Labels that lag behind the sound would count speech as silence: a tenth of a second costs far more than 20 dB.
  EXPECT_LT(meanPower(line, true), 0.01 * meanPower(line, false));
}

}  // namespace mouthpiece

#define MOUTHPIECE_NEED_FESTIVAL() \
  if (!festivalAvailable())        \
  GTEST_SKIP() << "needs Festival: sudo apt-get install festival festvox-us-slt-hts festvox-kallpc16k"
