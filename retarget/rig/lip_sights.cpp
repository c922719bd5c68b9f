#include "retarget/rig/lip_sights.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace mouthpiece {

template <typename Take>
void LipSights::cut(const Triangle& triangle, const Take& take) const {
  std::array<Eigen::Vector3d, 3> p;
  for (std::size_t k = 0; k < 3; ++k) {
    const Eigen::Vector3d at = pointAt(vertices_, triangle[k]);
    const double way = (at - from_).dot(along_) / along_.squaredNorm();
    p[k] = {(way - kFrom) / (1 - 2 * kFrom) * asReal(kSections) - 0.5, at.y(), at.z()};
  }
  std::sort(p.begin(), p.end(), [](const auto& a, const auto& b) { return a.x() < b.x(); });
  const double last = std::min(std::floor(p[2].x()), asReal(kSections - 1));
  for (double s = std::max(0.0, std::ceil(p[0].x())); s <= last; ++s) {
    const auto between = [s](const Eigen::Vector3d& a, const Eigen::Vector3d& b) -> Eigen::Vector3d {
      return a + (b.x() > a.x() ? (s - a.x()) / (b.x() - a.x()) : 0) * (b - a);
    };
    take(unsignedIndex(wholePart(s)), between(p[0], p[2]), s < p[1].x() ? between(p[0], p[1]) : between(p[1], p[2]));
  }
}

LipSights::Fronts LipSights::fronts(const MeasuredLip& lip) const {
  const auto foremostOf = [&](const std::vector<Triangle>& triangles) {
    Fronts fronts;
    for (const Triangle& t : triangles) {
      cut(t, [&](std::size_t section, const Eigen::Vector3d& one, const Eigen::Vector3d& other) {
        std::optional<Eigen::Vector3d>& front = fronts[section];
        const Eigen::Vector3d& foremost = other.z() > one.z() ? other : one;
        if (!front || foremost.z() > front->z()) front = foremost;
      });
    }
    return fronts;
  };
  Fronts fronts = foremostOf(lip.near);
  if (std::all_of(fronts.begin(), fronts.end(), [](const auto& front) { return front.has_value(); })) return fronts;
  const Fronts of_large = foremostOf(lip.surface.triangles);
  for (std::size_t s = 0; s < kSections; ++s) {
    if (!fronts[s]) fronts[s] = of_large[s];
  }
  return fronts;
}

std::array<double, LipSights::kSections> LipSights::slits(const Fronts& upper, const Fronts& lower, double deep,
                                                          const std::vector<Triangle>& skin) const {
  struct Covered {
    std::size_t section;
    double from, to;
  };
  thread_local std::vector<Covered> covered;
  covered.clear();
  for (const Triangle& t : skin) {
    cut(t, [&](std::size_t section, Eigen::Vector3d behind, Eigen::Vector3d before) {
      if (!upper[section] || !lower[section]) return;
      const double depth = std::min(upper[section]->z(), lower[section]->z()) - deep;
      if (behind.z() > before.z()) std::swap(behind, before);
      if (before.z() < depth) return;
      if (behind.z() < depth) behind += (depth - behind.z()) / (before.z() - behind.z()) * (before - behind);
      const auto [from, to] = std::minmax(behind.y(), before.y());
      if (to > lower[section]->y() && from < upper[section]->y()) covered.push_back({section, from, to});
    });
  }
  std::sort(covered.begin(), covered.end(), [](const Covered& a, const Covered& b) {
    return a.section != b.section ? a.section < b.section : a.from < b.from;
  });
  std::array<double, kSections> tallest{};
  auto next = covered.begin();
  for (std::size_t s = 0; s < kSections; ++s) {
    if (!upper[s] || !lower[s]) continue;
    double up_to = lower[s]->y();
    for (; next != covered.end() && next->section == s; ++next) {
      tallest[s] = std::max(tallest[s], next->from - up_to);
      up_to = std::max(up_to, next->to);
    }
    tallest[s] = std::max(tallest[s], upper[s]->y() - up_to);
  }
  return tallest;
}

}  // namespace mouthpiece
