#pragma once

#include "phonetics/language/phone.h"

namespace mouthpiece {

/// A diphthong begins in one shape and ends in another.
enum class PhonePart { kBegin, kEnd };

/// How unlike the mouth looks in two phones: 0 for the same phone, under kSameVisemeDistance within a viseme class,
/// then by the opening and rounding of the lips, plus kLostContactDistance where one closes the lips (M B P) or puts
/// lip to teeth (F V) and the other does not. Infinite between silence and speech.
double visemeDistance(Phone a, Phone b, PhonePart part);

inline constexpr double kSameVisemeDistance = 0.25;
inline constexpr double kLostContactDistance = 4;

}  // namespace mouthpiece
