#include "motion/blend.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "base/errors.h"
#include "base/index.h"

namespace mouthpiece {
namespace {

constexpr std::array<std::pair<BlendKind, std::string_view>, 4> kNames{{{BlendKind::kSmooth, "smooth"},
                                                                        {BlendKind::kLinear, "linear"},
                                                                        {BlendKind::kCosine, "cosine"},
                                                                        {BlendKind::kExponential, "exponential"}}};

/// Decay of the exponential over the blend: the first fragment weighs a half after a seventh of it.
constexpr double kExponentialDecay = 5.0;

}  // namespace

std::optional<BlendKind> blendKindFromName(std::string_view name) {
  for (const auto& [kind, kind_name] : kNames) {
    if (kind_name == name) return kind;
  }
  return std::nullopt;
}

std::string_view blendKindName(BlendKind kind) {
  for (const auto& [known, name] : kNames) {
    if (known == kind) return name;
  }
  return "";
}

double blendWeight(BlendKind kind, double u) {
  if (!(u > 0.0)) return 1.0;
  if (u >= 1.0) return 0.0;
  switch (kind) {
    case BlendKind::kSmooth:
      return 1.0 - u * u * u * (10.0 + u * (-15.0 + 6.0 * u));
    case BlendKind::kLinear:
      return 1.0 - u;
    case BlendKind::kCosine:
      return 0.5 + 0.5 * std::cos(std::numbers::pi * u);
    case BlendKind::kExponential: {
      // Taken off and divided by, so that the ends are 1 and 0.
      const double rest = std::exp(-kExponentialDecay);
      return (std::exp(-kExponentialDecay * u) - rest) / (1.0 - rest);
    }
  }
  return 0.0;
}

PositionMatrix blendRows(const Eigen::Ref<const PositionMatrix>& first, const Eigen::Ref<const PositionMatrix>& second,
                         std::span<const Seconds> times, TimeSpan span, BlendKind kind) {
  MOUTHPIECE_EXPECT(first.rows() == second.rows() && first.cols() == second.cols());
  MOUTHPIECE_EXPECT(unsignedIndex(first.rows()) == times.size());
  PositionMatrix blended(first.rows(), first.cols());
  for (Eigen::Index row = 0; row < first.rows(); ++row) {
    const Seconds time = times[unsignedIndex(row)];
    if (time < span.start) {
      blended.row(row) = first.row(row);
    } else if (time >= span.end) {
      blended.row(row) = second.row(row);
    } else {
      const double weight = blendWeight(kind, (time - span.start) / span.duration());
      blended.row(row) = weight * first.row(row) + (1.0 - weight) * second.row(row);
    }
  }
  return blended;
}

}  // namespace mouthpiece
