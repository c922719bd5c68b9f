#pragma once

#include <array>
#include <cstddef>
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
  double lips_held_ms = 15;      ///< to each side of a closure's tightest moment its correction stays whole
  double lips_fall_ms = 60;      ///< beyond that it comes and goes
  double teeth_fall_ms = 40;     ///< likewise of F V, whose correction is held 5 ms
  bool operator==(const MotionSettings&) const = default;
};

/// A setting, its unit for people, and between what it is learnt.
struct MotionSetting {
  std::string_view name, unit;
  double MotionSettings::*value;
  double least, largest;
};
/// In the order of files, which may end after any from the fifth on: what came later is the usual one there.
inline constexpr std::array<MotionSetting, 8> kMotionSettings{{
    {"detail within", "ms", &MotionSettings::detail_within_ms, 20, 150},
    {"first detail", "", &MotionSettings::first_detail, 0, 2},
    {"other detail", "", &MotionSettings::other_detail, 0, 1.5},
    {"slow captured", "", &MotionSettings::slow_captured, 0, 1},
    {"teeth contact", "", &MotionSettings::teeth_contact, 0, 1},
    {"lips held", "ms", &MotionSettings::lips_held_ms, 5, 40},
    {"lips fall", "ms", &MotionSettings::lips_fall_ms, 20, 120},
    {"teeth fall", "ms", &MotionSettings::teeth_fall_ms, 20, 100},
}};
inline constexpr std::size_t kLeastMotionSettings = 5;
/// From there on settings are of contacts.
inline constexpr std::size_t kFirstContactSetting = 4;

}  // namespace mouthpiece
