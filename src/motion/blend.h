#pragma once

#include <optional>
#include <span>
#include <string_view>

#include "motion/motion_clip.h"

namespace mouthpiece {

/// The weight functions g of eq. (2) (EDGE figure 3); all fall from g(0) = 1 to g(1) = 0.
enum class BlendKind {
  kSmooth,       ///< 1 - u^3 (10 - 15 u + 6 u^2): no jump in velocity or acceleration at either end
  kLinear,       ///< 1 - u
  kCosine,       ///< (1 + cos pi u) / 2: no jump in velocity
  kExponential,  ///< (e^-5u - e^-5) / (1 - e^-5): the second fragment comes in fast
};

/// "smooth" "linear" "cosine" "exponential"; nullopt for another name.
std::optional<BlendKind> blendKindFromName(std::string_view name);
std::string_view blendKindName(BlendKind kind);

/// g(u); u below 0 counts as 0, above 1 as 1.
double blendWeight(BlendKind kind, double u);

/// Eq. (2) for all rows: g(u) first + (1 - g(u)) second, u = (time - span.start) / span.duration(). Both are
/// times x channels. Outside the span a row is that fragment's own, to the bit, even where the other is NaN; an empty
/// span switches at its start.
PositionMatrix blendRows(const Eigen::Ref<const PositionMatrix>& first, const Eigen::Ref<const PositionMatrix>& second,
                         std::span<const Seconds> times, TimeSpan span, BlendKind kind = BlendKind::kSmooth);

}  // namespace mouthpiece
