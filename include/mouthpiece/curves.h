#pragma once

#include <string>
#include <vector>

#include "mouthpiece/labels.h"

namespace mouthpiece {

/// A viseme or action unit over time as an animator edits it: sparse keys, a cubic (Hermite) between each and the next,
/// held before the first and after the last.
struct Curve {
  struct Key {
    Seconds time = 0;
    double value = 0;
    double in = 0;   ///< the slope just before the key, per second
    double out = 0;  ///< just after it
  };
  std::string name;
  std::vector<Key> keys;  ///< in time order
};

}  // namespace mouthpiece
