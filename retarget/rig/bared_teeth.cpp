#include "retarget/rig/bared_teeth.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <set>
#include <utility>

#include "base/index.h"

namespace mouthpiece {
namespace {

constexpr double kFaces = 0.3;  ///< how far a normal looks ahead: skin that does less is a lip's rim, which teeth pass

Eigen::Vector3d acrossOf(const Triangle& t, const VertexPositions& vertices) {
  const Eigen::Vector3d a = pointAt(vertices, t[0]);
  return (pointAt(vertices, t[1]) - a).cross(pointAt(vertices, t[2]) - a);
}

}  // namespace

BaredTeeth::BaredTeeth(const VertexPositions& rest, std::vector<Triangle> lip, const std::vector<Triangle>& teeth,
                       double deepest)
    : lip_(std::move(lip)), deepest_(deepest) {
  // The backs of teeth come out after their fronts.
  std::set<std::uint32_t> corners;
  for (const Triangle& t : teeth) {
    if (acrossOf(t, rest).z() > 0) corners.insert(t.begin(), t.end());
  }
  teeth_.assign(corners.begin(), corners.end());
  at_rest_ = standOut(rest);
}

double BaredTeeth::measure(const VertexPositions& vertices) const {
  const std::vector<double> out = standOut(vertices);
  double most = 0;
  for (std::size_t i = 0; i < out.size(); ++i) most = std::max(most, out[i] - at_rest_[i]);
  return most;
}

/// Of each tooth's vertex how far it is before the foremost skin in front or behind it, as one looks from the front.
std::vector<double> BaredTeeth::standOut(const VertexPositions& vertices) const {
  struct Place {
    Eigen::Vector3d at;
    std::size_t tooth;
  };
  std::vector<Place> places;
  for (std::size_t i = 0; i < teeth_.size(); ++i) places.push_back({pointAt(vertices, teeth_[i]), i});
  std::sort(places.begin(), places.end(), [](const Place& a, const Place& b) { return a.at.x() < b.at.x(); });
  std::vector<double> skin(teeth_.size(), -std::numeric_limits<double>::infinity()), out(teeth_.size(), 0.0);
  for (const Triangle& t : lip_) {
    const Eigen::Vector3d a = pointAt(vertices, t[0]), b = pointAt(vertices, t[1]), c = pointAt(vertices, t[2]);
    const Eigen::Vector3d normal = acrossOf(t, vertices).normalized();
    if (!(normal.z() > kFaces)) continue;
    const auto [left, right] = std::minmax({a.x(), b.x(), c.x()});
    const auto [low, high] = std::minmax({a.y(), b.y(), c.y()});
    auto place =
        std::lower_bound(places.begin(), places.end(), left, [](const Place& p, double x) { return p.at.x() < x; });
    for (; place != places.end() && place->at.x() <= right; ++place) {
      const Eigen::Vector3d& p = place->at;
      if (p.y() < low || p.y() > high) continue;
      const auto isLeftOf = [&](const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
        return (to.x() - from.x()) * (p.y() - from.y()) >= (to.y() - from.y()) * (p.x() - from.x());
      };
      if (!isLeftOf(a, b) || !isLeftOf(b, c) || !isLeftOf(c, a)) continue;
      const double before = (p - a).dot(normal), front = p.z() - before / normal.z();
      if (front <= skin[place->tooth]) continue;
      skin[place->tooth] = front;
      out[place->tooth] = before > 0 && before < deepest_ ? before : 0;
    }
  }
  return out;
}

}  // namespace mouthpiece
