#pragma once

#include <random>
#include <string>
#include <vector>

#include "phonetics/labels/labels_builder.h"

namespace mouthpiece {

/// What a label file or a voice could hand over: some pauses, words of one to four phones, times on a grid of 0.1 ms.
struct RandomLine {
  std::vector<PhoneSegment> phones;
  std::vector<std::string> words;
  Seconds duration = 0;
};

inline RandomLine randomLine(std::mt19937& random, int most_words = 8) {
  const auto draw = [&random](int low, int high) { return std::uniform_int_distribution<int>(low, high)(random); };
  RandomLine line;
  int time = draw(0, 1) * draw(1, 3000);  // in units of 0.1 ms
  const int words = draw(1, most_words);
  for (int w = 0; w < words; ++w) {
    line.words.push_back(std::string("w").append(std::to_string(w)));
    const int phones = draw(1, 4);
    for (int p = 0; p < phones; ++p) {
      const int end = time + draw(20, 2000);
      const auto phone = static_cast<Phone>(draw(1, static_cast<int>(kPhoneCount) - 1));
      line.phones.push_back({.phone = phone, .span = {1e-4 * time, 1e-4 * end}, .word = line.words.size() - 1});
      time = end;
    }
    if (draw(0, 3) == 0) time += draw(20, 4000);
  }
  line.duration = 1e-4 * (time + draw(0, 1) * draw(20, 3000));
  return line;
}

inline SpeechLabels randomLabels(std::mt19937& random) {
  const RandomLine line = randomLine(random);
  return buildSpeechLabels(line.phones, line.words, line.duration);
}

/// `bytes` with a few of them changed, taken out, doubled or cut off.
inline std::string damaged(std::string bytes, std::mt19937& random) {
  const auto draw = [&random](std::size_t high) { return std::uniform_int_distribution<std::size_t>(0, high)(random); };
  for (std::size_t edits = 1 + draw(3); edits > 0 && !bytes.empty(); --edits) {
    const std::size_t at = draw(bytes.size() - 1);
    switch (draw(4)) {
      case 0:
        bytes[at] = static_cast<char>(draw(255));
        break;
      case 1:
        bytes.erase(at, 1 + draw(20));
        break;
      case 2:
        bytes.insert(at, bytes.substr(draw(bytes.size() - 1), 1 + draw(20)));
        break;
      case 3:
        bytes.resize(at);
        break;
      default:
        bytes[at] = "0123456789.- \n\""[draw(14)];
    }
  }
  return bytes;
}

}  // namespace mouthpiece
