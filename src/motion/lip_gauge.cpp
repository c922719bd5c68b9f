#include "motion/lip_gauge.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/errors.h"
#include "base/index.h"

namespace mouthpiece {
namespace {

double distance(const LipGauge::Pose& pose, Eigen::Index a, Eigen::Index b) {
  const Eigen::Vector3d apart = pose.segment<3>(a) - pose.segment<3>(b);
  return apart.norm();
}

}  // namespace

LipGauge::LipGauge(const MarkerLayout& layout) {
  for (const MarkerRole role : kMarkerRoles) {
    if (const auto marker = layout.findRole(role)) columns_[static_cast<std::size_t>(role)] = 3 * marker->row();
  }
}

LipGauge::LipGauge(const std::vector<std::string>& marker_names) {
  for (const MarkerRole role : kMarkerRoles) {
    const auto found = findRole(role, marker_names);
    if (found) columns_[static_cast<std::size_t>(role)] = 3 * found->row();
  }
}

LipGauge LipGauge::whole(const MarkerLayout& layout) {
  const LipGauge gauge(layout);
  for (const MarkerRole role :
       {MarkerRole::kUpperLip, MarkerRole::kLowerLip, MarkerRole::kRightLipCorner, MarkerRole::kLeftLipCorner}) {
    if (gauge.has(role)) continue;
    throw InputError(fmt::format("found no marker of role \"{}\" in layout {}; expected one, as {} is by its name",
                                 wordOf(role), printable(layout.name), usualName(role)));
  }
  return gauge;
}

double LipGauge::opening(const Pose& pose) const {
  return distance(pose, column(MarkerRole::kUpperLip), column(MarkerRole::kLowerLip));
}

double LipGauge::verticalOpening(const Pose& pose) const {
  return pose(column(MarkerRole::kUpperLip) + 1) - pose(column(MarkerRole::kLowerLip) + 1);
}

double LipGauge::width(const Pose& pose) const {
  return distance(pose, column(MarkerRole::kRightLipCorner), column(MarkerRole::kLeftLipCorner));
}

double LipGauge::protrusion(const Pose& pose) const {
  return (pose(column(MarkerRole::kUpperLip) + 2) + pose(column(MarkerRole::kLowerLip) + 2)) / 2;
}

double LipGauge::lowerLipDrop(const Pose& pose) const { return -pose(column(MarkerRole::kLowerLip) + 1); }

double LipGauge::chinDrop(const Pose& pose) const { return -pose(column(MarkerRole::kChin) + 1); }

std::vector<double> LipGauge::overFrames(Measure measure, const PositionMatrix& positions_mm) const {
  std::vector<double> values;
  values.reserve(unsignedIndex(positions_mm.rows()));
  for (Eigen::Index frame = 0; frame < positions_mm.rows(); ++frame)
    values.push_back((this->*measure)(positions_mm.row(frame)));
  return values;
}

std::pair<Eigen::Index, Eigen::Index> LipGauge::framesAround(const TimeSpan& span, double frame_rate_hz,
                                                             Eigen::Index frame_count) {
  constexpr Seconds kAround = 0.020;
  const double last = asReal(frame_count - 1);
  const auto frameAt = [&](double frame) { return static_cast<Eigen::Index>(std::clamp(frame, 0.0, last)); };
  return {frameAt(std::floor((span.start - kAround) * frame_rate_hz)),
          frameAt(std::ceil((span.end + kAround) * frame_rate_hz))};
}

double LipGauge::tightest(const MotionClip& motion, const TimeSpan& span) const {
  const auto [first, last] = framesAround(span, motion.frame_rate_hz, motion.positions_mm.rows());
  double least = std::numeric_limits<double>::infinity();
  for (Eigen::Index frame = first; frame <= last; ++frame) {
    const double own = opening(motion.positions_mm.row(frame));
    if (own < least) least = own;  // NaN is not
  }
  return std::isfinite(least) ? least : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace mouthpiece
