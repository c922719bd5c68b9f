#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "base/index.h"
#include "synthesis/join.h"

namespace mouthpiece {
namespace {

constexpr Seconds kSpacing = 0.010;  ///< of the times at which the fragments are compared
constexpr Seconds kStep = 0.020;     ///< over which a velocity is read

/// Lips and chin of two fragments at even times.
class SharedLips {
 public:
  SharedLips(const Fragment& before, const Fragment& after, const TimeSpan& span) : start_(span.start) {
    std::vector<Seconds> times;
    const auto count = static_cast<int>(std::ceil(span.duration() / kSpacing)) + 2;
    for (int i = 0; i < count; ++i) times.push_back(span.start + i * kSpacing);
    difference_ = after.lipsAt(times) - before.lipsAt(times);
    captured_before_ = before.capturedLipsAt(times);
    captured_after_ = after.capturedLipsAt(times);
  }

  [[nodiscard]] double markers() const { return std::max(1.0, asReal(difference_.cols()) / 3); }

  /// after - before, mm.
  [[nodiscard]] Eigen::RowVectorXd differenceAt(Seconds time) const { return at(difference_, time); }

  /// Its change over a second.
  [[nodiscard]] Eigen::RowVectorXd velocityAt(Seconds time) const {
    return (differenceAt(time + kStep) - differenceAt(time - kStep)) / (2 * kStep);
  }

  /// How far the captured lips move in 20 ms, mm, squared, mean over the markers: of the faster one.
  [[nodiscard]] double haste(Seconds time) const {
    const auto moved = [&](const PositionMatrix& lips) {
      return (at(lips, time + kStep / 2) - at(lips, time - kStep / 2)).squaredNorm() / markers();
    };
    return std::max(moved(captured_before_), moved(captured_after_));
  }

 private:
  [[nodiscard]] Eigen::RowVectorXd at(const PositionMatrix& rows, Seconds time) const {
    const double place = std::clamp((time - start_) / kSpacing, 0.0, asReal(rows.rows() - 1));
    const auto first = static_cast<Eigen::Index>(place);
    const Eigen::Index second = std::min(first + 1, rows.rows() - 1);
    const double part = place - asReal(first);
    return (1 - part) * rows.row(first) + part * rows.row(second);
  }

  Seconds start_;
  PositionMatrix difference_, captured_before_, captured_after_;
};

/// mm^2 a marker. With d = after - before eq. (2) gives theta'' = g before'' + (1 - g) after'' - 2 g' d' - g'' d: the
/// last two terms are the join's own. The constant part of d is led away over longer than the blend (JoinOffset).
double mismatch(const SharedLips& lips, const TimeSpan& blend) {
  constexpr Seconds kComesTo =
      0.030;  // velocities count as what they come to in that time, accelerations in its square
  constexpr double kApartPerSecond = 3;  // two poses that differ are shown as their mean for that long
  constexpr int kPoints = 7;
  const Seconds length = blend.duration();
  const Eigen::RowVectorXd at_middle = lips.differenceAt(blend.middle());
  double apart = 0, added = 0;
  for (int i = 1; i <= kPoints; ++i) {
    const double u = asReal(i) / (kPoints + 1);
    const Seconds time = blend.start + u * length;
    const double g = blendWeight(BlendKind::kSmooth, u);
    const double slope = 30 * u * u * (1 - u) * (1 - u) / length;
    const double bend = 60 * u * (1 - u) * (1 - 2 * u) / (length * length);
    const Eigen::RowVectorXd difference = lips.differenceAt(time);
    apart += 4 * g * (1 - g) * difference.squaredNorm() / kPoints;
    added += (2 * slope * lips.velocityAt(time) + bend * (difference - at_middle)).squaredNorm() / kPoints;
  }
  constexpr double kSquare = kComesTo * kComesTo;
  const double velocity = kSquare * lips.velocityAt(blend.middle()).squaredNorm();
  return (kApartPerSecond * length * apart + velocity + kSquare * kSquare * added) / lips.markers() +
         lips.haste(blend.middle());
}

}  // namespace

TimeSpan cheapestCoupling(const Fragment& before, const Fragment& after, const CouplingSearch& search) {
  constexpr double kOffCentre = 1.1;  // a place off the middle must be that much better
  const Seconds longest = *std::max_element(search.lengths.begin(), search.lengths.end());
  const SharedLips lips(before, after,
                        {search.middles.start - longest / 2 - kStep, search.middles.end + longest / 2 + kStep});
  TimeSpan best;
  double least = std::numeric_limits<double>::infinity();
  for (const double u : {0.5, 0.375, 0.625, 0.25, 0.75, 0.125, 0.875, 0.0, 1.0}) {
    const Seconds middle = std::lerp(search.middles.start, search.middles.end, u);
    for (const Seconds length : search.lengths) {
      const TimeSpan blend{middle - length / 2, middle + length / 2};
      const double cost = (u == 0.5 ? 1 : kOffCentre) * mismatch(lips, blend);
      if (cost < least) {
        least = cost;
        best = blend;
      }
    }
  }
  return best;
}

}  // namespace mouthpiece
