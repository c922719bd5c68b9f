#include "units/selection/viseme_distance.h"

#include <array>
#include <cmath>
#include <limits>

namespace mouthpiece {
namespace {

/// Rough lip shape of a class (design page, section 8), on scales from 0 or -1 to 1.
struct LipShape {
  double open;      ///< jaw and lips: 0 closed, 1 as wide as Ah
  double round;     ///< -1 spread, 1 narrow and round
  int contact;      ///< 0 none, 1 lip to lip, 2 lip to teeth
  double sibilant;  ///< teeth together
};

constexpr std::array<LipShape, kVisemeCount> kShapes{{
    {0.0, 0.0, 0, 0},    // sil
    {1.0, 0.0, 0, 0},    // Ah
    {0.7, -0.5, 0, 0},   // Eh
    {0.35, -1.0, 0, 0},  // Ee
    {0.45, -0.4, 0, 0},  // Ih
    {0.7, 0.7, 0, 0},    // Oh
    {0.3, 1.0, 0, 0},    // Oo
    {0.5, 0.0, 0, 0},    // Uh
    {0.4, 0.4, 0, 0},    // Er
    {0.3, 0.5, 0, 0},    // R
    {0.2, 1.0, 0, 0},    // W
    {0.3, -0.7, 0, 0},   // Y
    {0.0, 0.0, 1, 0},    // MBP
    {0.1, 0.0, 2, 0},    // FV
    {0.3, -0.1, 0, 0},   // Th
    {0.3, -0.2, 0, 0},   // LNTD
    {0.15, -0.3, 0, 1},  // S
    {0.2, 0.7, 0, 1},    // ShChJ
    {0.35, -0.1, 0, 0},  // GK
    {0.5, -0.1, 0, 0},   // H
}};

}  // namespace

double visemeDistance(Phone a, Phone b, PhonePart part) {
  if (a == b) return 0;
  if ((a == Phone::kSil) != (b == Phone::kSil)) return std::numeric_limits<double>::infinity();
  const Viseme class_a = part == PhonePart::kBegin ? firstViseme(a) : lastViseme(a);
  const Viseme class_b = part == PhonePart::kBegin ? firstViseme(b) : lastViseme(b);
  const bool same_kind = isVowel(a) == isVowel(b);
  if (class_a == class_b) return same_kind ? 0.5 * kSameVisemeDistance : kSameVisemeDistance;
  const LipShape& shape_a = kShapes[static_cast<std::size_t>(class_a)];
  const LipShape& shape_b = kShapes[static_cast<std::size_t>(class_b)];
  const double lost = shape_a.contact != shape_b.contact ? kLostContactDistance : 0.0;
  return kSameVisemeDistance +
         std::hypot(shape_a.open - shape_b.open, shape_a.round - shape_b.round,
                    0.5 * (shape_a.sibilant - shape_b.sibilant)) +
         lost + (same_kind ? 0.0 : 0.25);
}

}  // namespace mouthpiece
