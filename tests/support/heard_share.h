#pragma once

#include <algorithm>
#include <vector>

#include "phonetics/labels/speech_labels.h"

namespace mouthpiece::test {

/// Of the time in which `labels` have phones, the share in which they are among `heard`.
template <typename Segment>
double heardShare(const std::vector<Segment>& heard, const SpeechLabels& labels) {
  Seconds right = 0, said = 0;
  for (const LabelledPhone& phone : labels.phones) {
    if (phone.phone == Phone::kSil) continue;
    said += phone.span.duration();
    for (const Segment& segment : heard) {
      const Seconds both = std::min(segment.span.end, phone.span.end) - std::max(segment.span.start, phone.span.start);
      if (segment.phone == phone.phone) right += std::max(0.0, both);
    }
  }
  return right / said;
}

}  // namespace mouthpiece::test
