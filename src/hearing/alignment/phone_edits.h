#pragma once

#include <span>
#include <vector>

#include "phonetics/language/phone.h"

namespace mouthpiece {

/// The cheapest way to make one row of phones from another.
struct PhoneEdits {
  static constexpr double kLeftOut = 0.7;                  ///< a phone of either row
  static constexpr double kOfItsKind = 0.6, kOther = 1.0;  ///< a vowel for another or a consonant for another; else

  double price = 0;
  std::vector<double> of_first, of_second;  ///< what each phone costs
};

PhoneEdits cheapestEdits(std::span<const Phone> first, std::span<const Phone> second);

}  // namespace mouthpiece
