// Polygons into triangles, and what is drawn from both sides into one surface.
#include <Eigen/Geometry>
#include <algorithm>
#include <map>
#include <utility>

#include "base/index.h"
#include "deform/mesh/mesh_reader.h"

namespace mouthpiece {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

/// Ears of larger polygons are not looked for: they become a fan.
constexpr std::size_t kMostEars = 64;

/// A polygon that is cut into triangles; places in it are numbers of its corners.
class Polygon {
 public:
  Polygon(const MeshSoup& soup, std::span<const std::uint32_t> corners) {
    for (const std::uint32_t corner : corners) places_.emplace_back(&soup.positions[3 * std::size_t{corner}]);
    for (std::size_t k = 0; k < places_.size(); ++k)
      normal_ += (places_[k] - places_[0]).cross(places_[(k + 1) % places_.size()] - places_[0]);
  }

  [[nodiscard]] float diagonal(std::size_t a, std::size_t b) const { return (places_[a] - places_[b]).squaredNorm(); }
  /// Whether a triangle faces as the whole does.
  [[nodiscard]] bool faces(std::size_t a, std::size_t b, std::size_t c) const {
    return (places_[b] - places_[a]).cross(places_[c] - places_[a]).dot(normal_) > 0;
  }

  /// The ear with the shortest diagonal that may be cut off what is left: its place in `left`.
  [[nodiscard]] std::size_t bestEar(const std::vector<std::size_t>& left) const {
    std::size_t best = 0;
    bool best_is_ear = false;
    float least = 0;
    for (std::size_t k = 0; k < left.size(); ++k) {
      const std::size_t a = left[(k + left.size() - 1) % left.size()], b = left[k], c = left[(k + 1) % left.size()];
      const bool is_ear = faces(a, b, c) && std::none_of(left.begin(), left.end(), [&](std::size_t p) {
                            return p != a && p != b && p != c && faces(a, b, p) && faces(b, c, p) && faces(c, a, p);
                          });
      if (k > 0 && (is_ear == best_is_ear ? diagonal(a, c) >= least : best_is_ear)) continue;
      best = k;
      best_is_ear = is_ear;
      least = diagonal(a, c);
    }
    return best;
  }

 private:
  std::vector<Eigen::Map<const Vector3f>> places_;
  Vector3f normal_ = Vector3f::Zero();
};

}  // namespace

void appendPolygon(MeshSoup& soup, std::span<const std::uint32_t> corners, std::uint32_t part) {
  const auto add = [&](std::size_t i, std::size_t j, std::size_t k) {
    const std::uint32_t a = corners[i], b = corners[j], c = corners[k];
    if (a == b || b == c || c == a) return;
    soup.triangles.push_back({a, b, c});
    soup.part_of_triangle.push_back(part);
  };
  if (corners.size() == 4) {
    const Polygon polygon(soup, corners);
    const bool is_shorter = polygon.diagonal(1, 3) < polygon.diagonal(0, 2);
    // Of a quadrilateral with a corner that turns inwards one diagonal lies outside.
    const bool may_1_3 = polygon.faces(0, 1, 3) && polygon.faces(1, 2, 3),
               may_0_2 = polygon.faces(0, 1, 2) && polygon.faces(0, 2, 3);
    if (may_1_3 == may_0_2 ? is_shorter : may_1_3) {
      add(0, 1, 3);
      add(1, 2, 3);
      return;
    }
  } else if (corners.size() > 4 && corners.size() <= kMostEars) {
    const Polygon polygon(soup, corners);
    std::vector<std::size_t> left;
    for (std::size_t k = 0; k < corners.size(); ++k) left.push_back(k);
    while (left.size() > 3) {
      const std::size_t k = polygon.bestEar(left);
      add(left[(k + left.size() - 1) % left.size()], left[k], left[(k + 1) % left.size()]);
      left.erase(left.begin() + static_cast<std::ptrdiff_t>(k));
    }
    add(left[0], left[1], left[2]);
    return;
  }
  for (std::size_t k = 1; k + 1 < corners.size(); ++k) add(0, k, k + 1);
}

void dropBacks(MeshSoup& soup) {
  const auto placeOf = [&](std::uint32_t v) -> Vector3d {
    return Eigen::Map<const Vector3f>(&soup.positions[3 * std::size_t{v}]).cast<double>();
  };
  std::vector<std::pair<Triangle, std::size_t>> by_corners;
  Vector3d middle = Vector3d::Zero();
  for (std::size_t i = 0; i < soup.triangles.size(); ++i) {
    Triangle corners = soup.triangles[i];
    for (const std::uint32_t v : corners) middle += placeOf(v) / (3 * asReal(soup.triangles.size()));
    std::sort(corners.begin(), corners.end());
    by_corners.emplace_back(corners, i);
  }
  std::sort(by_corners.begin(), by_corners.end());

  /// Of a part: triangles and their backs, and six times the volume before the middle that the former enclose.
  struct Doubled {
    std::vector<std::size_t> firsts, backs;
    double volume = 0;
  };
  std::map<std::uint32_t, Doubled> doubled;
  std::vector<bool> is_dropped(soup.triangles.size(), false);
  bool has_back = false;
  for (std::size_t k = 1, first = 0; k < by_corners.size(); ++k) {
    if (by_corners[k].first != by_corners[first].first) {
      first = k;
      has_back = false;
      continue;
    }
    is_dropped[by_corners[k].second] = true;
    const std::size_t i = by_corners[first].second;
    const auto [a, b, c] = soup.triangles[i];
    Triangle other = soup.triangles[by_corners[k].second];
    std::rotate(other.begin(), std::find(other.begin(), other.end(), a), other.end());
    if (has_back || other[1] == b) continue;
    has_back = true;
    Doubled& part = doubled[soup.part_of_triangle[i]];
    part.firsts.push_back(i);
    part.backs.push_back(by_corners[k].second);
    part.volume += (placeOf(a) - middle).dot((placeOf(b) - middle).cross(placeOf(c) - middle));
  }
  for (const auto& [number, part] : doubled) {
    if (part.volume >= 0) continue;
    for (const std::size_t i : part.firsts) is_dropped[i] = true;
    for (const std::size_t i : part.backs) is_dropped[i] = false;
  }
  std::size_t kept = 0;
  for (std::size_t i = 0; i < soup.triangles.size(); ++i) {
    if (is_dropped[i]) continue;
    soup.triangles[kept] = soup.triangles[i];
    soup.part_of_triangle[kept++] = soup.part_of_triangle[i];
  }
  soup.triangles.resize(kept);
  soup.part_of_triangle.resize(kept);
}

}  // namespace mouthpiece
