// How unlike two sounds of the IPA chart are.
#include <array>
#include <cmath>
#include <cstddef>

#include "phonetics/language/ipa.h"

namespace mouthpiece {
namespace {

/// Along the mouth, 0 at the lips and 1 at the glottis.
double depthOf(Place place) {
  constexpr std::array<double, 17> kDepth{0.5,  0,    0.05, 0.05, 0.08, 0.12, 0.25, 0.32, 0.4,
                                          0.42, 0.45, 0.55, 0.7,  0.8,  0.9,  0.95, 1.0};
  return kDepth.at(static_cast<std::size_t>(place));
}

/// A scale from shut to open.
double openness(SoundManner manner) {
  switch (manner) {
    case SoundManner::kPlosive:
    case SoundManner::kNasal:
      return 0;
    case SoundManner::kTrill:
    case SoundManner::kTap:
      return 0.2;
    case SoundManner::kFricative:
    case SoundManner::kLateralFricative:
      return 0.5;
    case SoundManner::kApproximant:
    case SoundManner::kLateral:
      return 0.8;
    case SoundManner::kVowel:
      return 1;
  }
  return 1;
}

double differs(bool a, bool b) { return a != b ? 1 : 0; }
bool isLateral(SoundManner manner) {
  return manner == SoundManner::kLateral || manner == SoundManner::kLateralFricative;
}

}  // namespace

double visibleDistance(const IpaSound& a, const IpaSound& b) {
  const double lips = 4 * differs(a.closesLips(), b.closesLips()) + 4 * differs(a.touchesTeeth(), b.touchesTeeth()) +
                      1.5 * std::abs(a.rounding - b.rounding);
  const double voice = 0.05 * differs(a.voiced, b.voiced) + 0.05 * differs(a.nasal, b.nasal);
  if (a.isVowel() != b.isVowel()) return 2 + lips + voice;
  if (a.isVowel()) {
    // Unrounded vowels are the more spread the further front they are.
    const double of_backness = a.rounding > 0.3 && b.rounding > 0.3 ? 0.1 : 0.6;
    return lips + voice + 1.5 * std::abs(a.height - b.height) + of_backness * std::abs(a.backness - b.backness) +
           0.3 * differs(a.rhotic, b.rhotic);
  }
  return lips + voice + 0.6 * std::abs(depthOf(a.place) - depthOf(b.place)) +
         0.3 * std::abs(openness(a.manner) - openness(b.manner)) + 0.5 * differs(a.sibilant, b.sibilant) +
         0.1 * differs(isLateral(a.manner), isLateral(b.manner)) + 0.3 * differs(a.rhotic, b.rhotic);
}

double audibleDistance(const IpaSound& a, const IpaSound& b) {
  const double voice = 0.4 * differs(a.voiced, b.voiced) + 0.1 * differs(a.rhotic, b.rhotic);
  if (a.isVowel() != b.isVowel()) return 3 + voice;
  if (a.isVowel()) {
    return voice + std::abs(a.height - b.height) + 0.8 * std::abs(a.backness - b.backness) +
           0.3 * std::abs(a.rounding - b.rounding) + 0.2 * differs(a.rhotic, b.rhotic);
  }
  return voice + std::abs(depthOf(a.place) - depthOf(b.place)) + std::abs(openness(a.manner) - openness(b.manner)) +
         differs(a.nasal, b.nasal) + differs(a.sibilant, b.sibilant) +
         0.5 * differs(isLateral(a.manner), isLateral(b.manner));
}

}  // namespace mouthpiece
