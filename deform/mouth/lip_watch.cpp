#include "deform/mouth/lip_guard.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "base/smooth_step.h"

namespace mouthpiece {
namespace {

using Eigen::Vector3f;

constexpr float kTips = 0.85F;      ///< cosine to the way it faced when the mouth closed: below, a triangle tips over
constexpr float kTipsOver = 0.25F;  ///< within this
constexpr double kBendHeldFlat = 0.02;  ///< a little, where few vertices tell
constexpr float kSameSide = 0.2F;       ///< cosine between surfaces that are one

/// The plane of the watched triangle: origin, axes along it and away from it.
struct Frame {
  Vector3f origin, x, y, away;
};

Frame frameOf(const LipWatch& watch, const float* vertices) {
  const auto at = [vertices](std::uint32_t v) { return Eigen::Map<const Vector3f>(vertices + 3 * std::size_t{v}); };
  const Vector3f a = at(watch.corners[0]), ab = at(watch.corners[1]) - a, ac = at(watch.corners[2]) - a;
  const Vector3f across = ab.cross(ac);
  Frame frame;
  frame.origin = a + watch.weights[0] * ab + watch.weights[1] * ac;
  frame.x = ab / std::max(ab.norm(), kLeastLength);
  frame.away = across / std::max(across.norm(), kLeastLength);
  frame.y = frame.away.cross(frame.x);
  return frame;
}

}  // namespace

LipWatch::Sight LipWatch::look(const float* vertices, float reach) const {
  const Frame frame = frameOf(*this, vertices);
  const Vector3f p = own.in(vertices)-frame.origin;
  const float x = p.dot(frame.x) / reach, y = p.dot(frame.y) / reach;
  const float* b = bend;
  const float height = b[0] * x + b[1] * y + b[2] * x * x + b[3] * x * y + b[4] * y * y;
  const float slope_x = b[0] + 2 * b[2] * x + b[3] * y, slope_y = b[1] + b[3] * x + 2 * b[4] * y;
  const float aside = x * x + y * y;
  // What is behind the lip is out of it sideways, too, once out of sight: no deeper than that is far, or a place that
  // comes into sight deep behind a lip that may end before it would be pushed all at once.
  const float distance =
      std::max((p.dot(frame.away) - reach * height) / std::sqrt(1 + slope_x * slope_x + slope_y * slope_y),
               reach * (std::sqrt(aside) - 1));
  // So deep behind the lip a place is elsewhere: findNearLips() leaves it out beyond that, all at once.
  const float off = std::max(2 * aside, 2 * -p.dot(frame.away) / reach) - 1;
  const float tipped = (kTips - frame.away.dot(Eigen::Map<const Vector3f>(away))) / kTipsOver;
  const float blind = asFloat(smoothStep(double{std::max(off, tipped)}));
  return {distance + blind * std::max(0.0F, reach - distance), reach * aside, frame.away};
}

/// Least squares over the vertices within `reach`.
void LipWatch::takeShape(const VertexPositions& closed, const VertexPositions& normals,
                         const std::vector<std::uint32_t>& lip, float reach) {
  using Terms = Eigen::Matrix<double, 5, 1>;
  const Frame frame = frameOf(*this, closed.data());
  Eigen::Matrix<double, 5, 5> squares = kBendHeldFlat * Eigen::Matrix<double, 5, 5>::Identity();
  Terms sums = Terms::Zero();
  const auto first = std::lower_bound(lip.begin(), lip.end(), frame.origin.x() - reach,
                                      [&](std::uint32_t v, float x) { return closed(v, 0) < x; });
  for (auto next = first; next != lip.end() && closed(*next, 0) <= frame.origin.x() + reach; ++next) {
    const std::uint32_t v = *next;
    const Vector3f off = closed.row(v).transpose() - frame.origin;
    if (std::abs(off.x()) >= reach || std::abs(off.y()) >= reach) continue;
    const Vector3f q = off / reach;
    if (q.squaredNorm() >= 1 || normals.row(v).dot(frame.away) < kSameSide) continue;
    const double x{q.dot(frame.x)}, y{q.dot(frame.y)};
    const Terms terms{x, y, x * x, x * y, y * y};
    const double weight = 1 - double{q.squaredNorm()};
    squares += weight * terms * terms.transpose();
    sums += weight * double{q.dot(frame.away)} * terms;
  }
  const Terms solved = squares.ldlt().solve(sums);
  for (Eigen::Index i = 0; i < 5; ++i) bend[i] = asFloat(solved[i]);
  Eigen::Map<Vector3f>(this->away) = frame.away;
}

}  // namespace mouthpiece
