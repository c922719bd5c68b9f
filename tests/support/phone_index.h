#pragma once

#include <memory>
#include <vector>

#include "units/phones/phone_span_index.h"

namespace mouthpiece::samples {

/// Of takes of which nothing but the phones is known, each a tenth of a second long.
inline PhoneSpanIndex phoneIndexOf(const std::vector<std::vector<Phone>>& takes) {
  auto columns = std::make_shared<PhoneColumns>();
  for (const std::vector<Phone>& take : takes) {
    SpeechLabels labels;
    for (const Phone phone : take) {
      const Seconds start = labels.duration();
      labels.phones.push_back({phone, {start, start + 0.1}, {}, {}});
    }
    columns->add(labels, false);
  }
  return PhoneSpanIndex(std::move(columns));
}

}  // namespace mouthpiece::samples
