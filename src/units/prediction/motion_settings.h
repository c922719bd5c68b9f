#pragma once

#include <array>
#include <string_view>

#include "base/time.h"

namespace mouthpiece {

/// How much of a line's movement its fragments bring, beside the prediction. `corpus build` learns these on the corpus'
/// own takes (corpus_tools/building/settings_fit.h); the values here are where it begins, and what a corpus keeps that
/// has too little to learn from.
struct MotionSettings {
  double detail_within_ms = 50;  ///< slower than this Gaussian (standard deviation) is predicted, faster is captured
  double first_detail = 1.33;    ///< share of captured detail along the first component, which opens the mouth
  double other_detail = 0.7;     ///< along all others: there a tracker's noise may be as large
  double slow_captured = 0;      ///< share of the fragments' own slow difference to the prediction
  double teeth_contact = 0.7;    ///< in F V, share of what the lower lip lacks to its captured contact
  bool operator==(const MotionSettings&) const = default;
};

/// A setting, its unit for people, and between what it is learnt.
struct MotionSetting {
  std::string_view name, unit;
  double MotionSettings::*value;
  double least, largest;
};
inline constexpr std::array<MotionSetting, 5> kMotionSettings{{
    {"detail within", "ms", &MotionSettings::detail_within_ms, 20, 150},
    {"first detail", "", &MotionSettings::first_detail, 0, 2},
    {"other detail", "", &MotionSettings::other_detail, 0, 1.5},
    {"slow captured", "", &MotionSettings::slow_captured, 0, 1},
    {"teeth contact", "", &MotionSettings::teeth_contact, 0, 1},
}};

}  // namespace mouthpiece
