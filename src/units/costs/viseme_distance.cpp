#include "units/costs/viseme_distance.h"

#include <cmath>
#include <limits>

namespace mouthpiece {

double visemeDistance(Phone a, Phone b, PhonePart part) {
  if (a == b) return 0;
  if ((a == Phone::kSil) != (b == Phone::kSil)) return std::numeric_limits<double>::infinity();
  const Viseme class_a = part == PhonePart::kBegin ? firstViseme(a) : lastViseme(a);
  const Viseme class_b = part == PhonePart::kBegin ? firstViseme(b) : lastViseme(b);
  const bool same_kind = isVowel(a) == isVowel(b);
  if (class_a == class_b) return same_kind ? 0.5 * kSameVisemeDistance : kSameVisemeDistance;
  const VisemeRow& shape_a = rowOf(class_a);
  const VisemeRow& shape_b = rowOf(class_b);
  const double lost = shape_a.closure != shape_b.closure ? kLostContactDistance : 0.0;
  return kSameVisemeDistance +
         std::hypot(shape_a.open - shape_b.open, shape_a.round - shape_b.round,
                    shape_a.sibilant != shape_b.sibilant ? 0.5 : 0.0) +
         lost + (same_kind ? 0.0 : 0.25);
}

}  // namespace mouthpiece
