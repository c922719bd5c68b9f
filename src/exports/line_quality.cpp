#include "exports/line_quality.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/errors.h"
#include "base/index.h"
#include "motion/lip_gauge.h"

namespace mouthpiece {
namespace {

double jitterOf(const MotionClip& motion, const LipGauge& lips) {
  double sum = 0, count = 0;
  for (const MarkerRole role : kMarkerRoles) {
    const Eigen::Index column = lips.column(role);
    if (column < 0) continue;
    const auto path = motion.positions_mm.middleCols<3>(column);
    for (Eigen::Index t = 1; t + 1 < path.rows(); ++t) {
      sum += (path.row(t) - 0.5 * (path.row(t - 1) + path.row(t + 1))).squaredNorm();
      count += 1;
    }
  }
  return count > 0 ? std::sqrt(sum / count) : 0;
}

}  // namespace

double backoffShare(const UtteranceAnimation& animation) {
  const std::size_t phones = animation.labels.phones.size();
  double pairs = 0;
  for (const PlacedUnit& unit : animation.units) {
    if (unit.is_backoff) pairs += asReal(unit.phones.last.value - unit.phones.first.value);
  }
  return phones > 1 ? pairs / asReal(phones - 1) : 0;
}

LineQuality judgeLine(const UtteranceAnimation& animation, const MotionClip& motion, double closed_lips_mm,
                      std::span<const double> confidence) {
  MOUTHPIECE_EXPECT(motion.positions_mm.cols() == 3 * signedIndex(motion.marker_names.size()));
  LineQuality quality;
  quality.backoff_share = backoffShare(animation);
  const LipGauge lips(motion.marker_names);
  quality.jitter_mm = jitterOf(motion, lips);
  if (lips.hasLips() && closed_lips_mm > 0) {
    for (const LabelledPhone& phone : animation.labels.phones) {
      if (!isBilabial(phone.phone)) continue;
      ++quality.closures;
      if (lips.tightest(motion, phone.span) <= closed_lips_mm + kClosureMm) ++quality.closures_made;
    }
  }
  double good = 1 - quality.backoff_share;
  if (quality.closures > 0) good *= asReal(quality.closures_made) / asReal(quality.closures);
  if (!confidence.empty())
    good *= std::accumulate(confidence.begin(), confidence.end(), 0.0) / asReal(confidence.size());
  good *= std::pow(0.8, asReal(animation.warnings.size()));
  quality.doubt = 1 - std::clamp(good, 0.0, 1.0);
  return quality;
}

}  // namespace mouthpiece
