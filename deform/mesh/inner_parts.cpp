// What lies in a head whose names tell nothing of it: eyes, teeth and tongue by their shape and place.
#include <Eigen/Geometry>
#include <Eigen/QR>
#include <algorithm>
#include <boost/pending/disjoint_sets.hpp>
#include <cmath>
#include <map>
#include <numeric>

#include "deform/mesh/mesh_reader.h"
#include "deform/mesh/triangle_tree.h"

namespace mouthpiece {
namespace {

using Eigen::Vector3d;

/// Triangles that hang together; vertices in one place count as one.
struct Island {
  std::vector<Triangle> triangles;
  Eigen::AlignedBox3d box;
  Vector3d middle = Vector3d::Zero();  ///< weighed by area
  double area = 0;
};

Vector3d pointOf(const FaceMesh& mesh, std::uint32_t vertex) {
  return mesh.vertices.row(vertex).transpose().cast<double>();
}

/// Half of the cross product of two edges.
Vector3d areaOf(const FaceMesh& mesh, const Triangle& t) {
  const Vector3d a = pointOf(mesh, t[0]);
  return 0.5 * (pointOf(mesh, t[1]) - a).cross(pointOf(mesh, t[2]) - a);
}

/// The islands of some triangles, and which one each is of.
std::vector<Island> islandsOf(const FaceMesh& mesh, const std::vector<Triangle>& triangles,
                              std::vector<std::size_t>& of_triangle) {
  boost::disjoint_sets_with_storage<> sets(mesh.vertexCount());
  std::vector<std::uint32_t> by_place(mesh.vertexCount());
  std::iota(by_place.begin(), by_place.end(), 0U);
  const auto place = [&](std::uint32_t v) {
    return std::array{mesh.vertices(v, 0), mesh.vertices(v, 1), mesh.vertices(v, 2)};
  };
  std::sort(by_place.begin(), by_place.end(), [&](auto a, auto b) { return place(a) < place(b); });
  for (std::size_t i = 1; i < by_place.size(); ++i) {
    if (place(by_place[i - 1]) == place(by_place[i])) sets.union_set(by_place[i - 1], by_place[i]);
  }
  for (const Triangle& triangle : triangles) {
    sets.union_set(triangle[0], triangle[1]);
    sets.union_set(triangle[0], triangle[2]);
  }
  std::vector<Island> islands;
  std::map<std::size_t, std::size_t> numbers;
  for (const Triangle& triangle : triangles) {
    const std::size_t number = numbers.try_emplace(sets.find_set(triangle[0]), islands.size()).first->second;
    if (number == islands.size()) islands.emplace_back();
    of_triangle.push_back(number);
    Island& island = islands[number];
    island.triangles.push_back(triangle);
    for (const std::uint32_t vertex : triangle) island.box.extend(pointOf(mesh, vertex));
    const double area = areaOf(mesh, triangle).norm();
    island.area += area;
    island.middle += area * centroid(mesh, triangle).cast<double>();
  }
  for (Island& island : islands) {
    if (island.area > 0) island.middle /= island.area;
  }
  return islands;
}

struct Ball {
  Vector3d middle;
  double radius = 0;
};

/// The sphere through an island's corners by least squares, where they lie on it and around at least half of it; of an
/// eye the cornea stands out a little.
std::optional<Ball> ballOf(const FaceMesh& mesh, const Island& island) {
  constexpr std::size_t kFewest = 24, kMost = 20'000;  // triangles
  constexpr double kOff = 0.06, kAround = 1.6;         // of the radius: mean distance from it; how wide the island is
  if (island.triangles.size() < kFewest || island.triangles.size() > kMost) return std::nullopt;
  Eigen::MatrixX4d rows(3 * signedIndex(island.triangles.size()), 4);
  Eigen::VectorXd squares(rows.rows());
  Eigen::Index at = 0;
  for (const Triangle& triangle : island.triangles) {
    for (const std::uint32_t vertex : triangle) {
      const Vector3d p = pointOf(mesh, vertex) - island.middle;
      rows.row(at) << 2 * p.transpose(), 1;
      squares(at++) = p.squaredNorm();
    }
  }
  const Eigen::Vector4d found = rows.colPivHouseholderQr().solve(squares);
  const Vector3d middle = found.head<3>();
  const double radius = std::sqrt(std::max(0.0, found(3) + middle.squaredNorm()));
  if (!(radius > 0) || island.box.sizes().head<2>().minCoeff() < kAround * radius) return std::nullopt;
  double off = 0;
  for (Eigen::Index i = 0; i < rows.rows(); ++i)
    off += std::pow((0.5 * rows.row(i).head<3>().transpose() - middle).norm() - radius, 2);
  if (std::sqrt(off / asReal(rows.rows())) > kOff * radius) return std::nullopt;
  return Ball{island.middle + middle, radius};
}

/// Two balls of one size side by side, the largest ones; nullopt where there is none, or many such balls (beads).
std::optional<std::array<Ball, 2>> eyesAmong(const std::vector<Ball>& balls) {
  constexpr double kSameSize = 0.15, kSameHeight = 0.7, kNearest = 2, kFarthest = 9;  // of the radius
  constexpr std::ptrdiff_t kMostAlike = 8;                                            // an eye may have several layers
  constexpr std::size_t kMostBalls = 64;
  if (balls.size() > kMostBalls) return std::nullopt;
  std::optional<std::array<Ball, 2>> best;
  for (const Ball& a : balls) {
    for (const Ball& b : balls) {
      const Vector3d way = b.middle - a.middle;
      const bool is_pair = way.x() > kNearest * a.radius && way.x() < kFarthest * a.radius &&
                           way.tail<2>().cwiseAbs().maxCoeff() < kSameHeight * a.radius &&
                           std::abs(b.radius - a.radius) < kSameSize * a.radius;
      if (is_pair && (!best || a.radius > best->front().radius)) best = {a, b};
    }
  }
  if (!best) return std::nullopt;
  const auto alike = std::count_if(balls.begin(), balls.end(), [&](const Ball& ball) {
    return std::abs(ball.radius - best->front().radius) < kSameSize * best->front().radius;
  });
  return alike > kMostAlike ? std::nullopt : best;
}

/// Iris, cornea and what else lies around an eye's ball; lashes reach farther.
bool isOf(const Ball& ball, const FaceMesh& mesh, const Island& island) {
  constexpr double kReach = 1.35;  // of the radius
  return std::all_of(island.triangles.begin(), island.triangles.end(), [&](const Triangle& triangle) {
    return std::all_of(triangle.begin(), triangle.end(), [&](std::uint32_t vertex) {
      return (pointOf(mesh, vertex) - ball.middle).norm() < kReach * ball.radius;
    });
  });
}

/// Of an island's faces in its back half the share that lies at the head's middle: a tongue's, not a row of teeth's.
double middleShare(const FaceMesh& mesh, const Island& island, double middle_x, double reach) {
  double all = 0, near = 0;
  for (const Triangle& triangle : island.triangles) {
    const Vector3d at = centroid(mesh, triangle).cast<double>();
    if (at.z() > island.box.center().z()) continue;
    const double area = areaOf(mesh, triangle).norm();
    all += area;
    if (std::abs(at.x() - middle_x) < reach) near += area;
  }
  return all > 0 ? near / all : 0;
}

/// What an island encloses, seen from its middle, as a share of its box; negative where its faces look inward, as a
/// mouth's bag has them.
double fullness(const FaceMesh& mesh, const Island& island) {
  double volume = 0;
  for (const Triangle& triangle : island.triangles)
    volume += (centroid(mesh, triangle).cast<double>() - island.middle).dot(areaOf(mesh, triangle)) / 3;
  return volume / std::max(island.box.volume(), 1e-30);
}

/// Islands of the mouth: what lies under the eyes, near the head's middle, with skin in front of it.
class Mouth {
 public:
  Mouth(const FaceMesh& mesh, const std::vector<Island>& islands, const std::vector<bool>& is_eye,
        const std::array<Vector3d, 2>& eyes)
      : mesh_(mesh), apart_((eyes[1] - eyes[0]).norm()), middle_(0.5 * (eyes[0] + eyes[1])) {
    // Eyes are 63 mm apart; the lips meet 65 to 75 below them, teeth reach 60 behind the lips.
    const Eigen::AlignedBox3d room(middle_ + apart_ * Vector3d(-0.65, -2.1, -1.4),
                                   middle_ + apart_ * Vector3d(0.65, -0.5, 0.9));
    std::vector<Triangle> outside;
    for (std::size_t i = 0; i < islands.size(); ++i) {
      if (is_eye[i]) continue;
      if (room.contains(islands[i].box)) {
        inside_.push_back(i);
      } else {
        outside.insert(outside.end(), islands[i].triangles.begin(), islands[i].triangles.end());
      }
    }
    if (outside.empty()) inside_.clear();
    if (inside_.empty()) return;
    const TriangleTree skin(mesh.vertices, outside, TriangleTree::Use::kWithoutStarts);
    std::erase_if(inside_,
                  [&](std::size_t i) { return !isBehind(skin, islands[i]) || fullness(mesh, islands[i]) <= 0; });
    for (const std::size_t i : inside_) box_.extend(islands[i].box);
  }

  /// Of the islands, in their order: teeth and tongue; what is neither keeps what it was.
  void tell(const std::vector<Island>& islands, std::vector<InnerKind>& kinds) const {
    constexpr double kLong = 0.3, kWide = 0.25, kReach = 0.1;  // of the eyes' distance
    constexpr double kCentral = 0.08;
    constexpr double kWithGums = 0.85;  // as wide as the rows of teeth: gums and tongue in one
    std::optional<std::size_t> tongue;
    for (const std::size_t i : inside_) {
      kinds[i] = InnerKind::kTeeth;
      const Vector3d size = islands[i].box.sizes();
      const bool is_large = size.z() > kLong * apart_ && size.x() > kWide * apart_;
      if (!is_large || middleShare(mesh_, islands[i], middle_.x(), kReach * apart_) < kCentral) continue;
      if (!tongue || fullness(mesh_, islands[i]) > fullness(mesh_, islands[*tongue])) tongue = i;
    }
    if (!tongue) return;
    const bool has_gums = inside_.size() > 1 && islands[*tongue].box.sizes().x() > kWithGums * box_.sizes().x();
    kinds[*tongue] = has_gums ? InnerKind::kGumsAndTongue : InnerKind::kTongue;
  }

 private:
  [[nodiscard]] bool isBehind(const TriangleTree& skin, const Island& island) const {
    constexpr std::size_t kAsked = 40;
    constexpr double kMost = 0.6;
    std::size_t asked = 0, behind = 0;
    const std::size_t every = island.triangles.size() / kAsked + 1;
    for (std::size_t i = 0; i < island.triangles.size(); i += every, ++asked) {
      const Vector3d at = centroid(mesh_, island.triangles[i]).cast<double>();
      if (skin.isBetween(at, at + 3 * apart_ * Vector3d::UnitZ())) ++behind;
    }
    return asReal(behind) >= kMost * asReal(asked);
  }

  const FaceMesh& mesh_;
  double apart_;
  Vector3d middle_;
  std::vector<std::size_t> inside_;
  Eigen::AlignedBox3d box_;
};

/// The middles of eyes that are known by name: right of x, left of x.
std::optional<std::array<Vector3d, 2>> middlesOf(const FaceMesh& mesh, const std::vector<MeshPart>& parts) {
  Eigen::AlignedBox3d both;
  const auto each = [&](auto&& take) {
    for (const MeshPart& part : parts) {
      if (part.kind != PartKind::kEye) continue;
      for (const Triangle& triangle : trianglesOf(mesh, part)) take(centroid(mesh, triangle).cast<double>());
    }
  };
  each([&](const Vector3d& at) { both.extend(at); });
  if (both.isEmpty()) return std::nullopt;
  std::array<Eigen::AlignedBox3d, 2> sides;
  each([&](const Vector3d& at) { sides[at.x() < both.center().x() ? 0 : 1].extend(at); });
  if (sides[0].isEmpty() || sides[1].isEmpty()) return std::nullopt;
  return std::array<Vector3d, 2>{sides[0].center(), sides[1].center()};
}

}  // namespace

std::vector<std::vector<InnerKind>> innerKinds(const FaceMesh& mesh, const std::vector<MeshPart>& parts) {
  const auto isKnown = [&](auto&& matches) { return std::any_of(parts.begin(), parts.end(), matches); };
  const bool has_eyes = isKnown([](const MeshPart& part) { return part.kind == PartKind::kEye; });
  const bool has_mouth = isKnown([](const MeshPart& part) {
    return part.kind == PartKind::kUpperTeeth || part.kind == PartKind::kLowerTeeth || part.kind == PartKind::kTongue ||
           part.kind == PartKind::kMouthInside;
  });
  if (has_eyes && has_mouth) return {};
  std::vector<Triangle> triangles;
  for (const MeshPart& part : parts) {
    if (part.kind != PartKind::kSkin || part.stands_off) continue;
    const std::span<const Triangle> own = trianglesOf(mesh, part);
    triangles.insert(triangles.end(), own.begin(), own.end());
  }
  std::vector<std::size_t> of_triangle;
  const std::vector<Island> islands = islandsOf(mesh, triangles, of_triangle);
  std::vector<InnerKind> kinds(islands.size(), InnerKind::kNone);
  std::vector<bool> is_eye(islands.size(), false);
  std::optional<std::array<Vector3d, 2>> eyes = middlesOf(mesh, parts);
  if (!has_eyes) {
    std::vector<Ball> balls;
    for (const Island& island : islands) {
      if (const auto ball = ballOf(mesh, island)) balls.push_back(*ball);
    }
    const auto pair = eyesAmong(balls);
    if (!pair) return {};
    for (std::size_t i = 0; i < islands.size(); ++i) {
      is_eye[i] = isOf((*pair)[0], mesh, islands[i]) || isOf((*pair)[1], mesh, islands[i]);
      if (is_eye[i]) kinds[i] = InnerKind::kEye;
    }
    eyes = {(*pair)[0].middle, (*pair)[1].middle};
  }
  if (!has_mouth && eyes) Mouth(mesh, islands, is_eye, *eyes).tell(islands, kinds);

  std::vector<std::vector<InnerKind>> of_parts;
  auto next = of_triangle.begin();
  for (const MeshPart& part : parts) {
    of_parts.emplace_back();
    if (part.kind != PartKind::kSkin || part.stands_off) continue;
    for (std::size_t i = 0; i < part.triangle_count; ++i) of_parts.back().push_back(kinds[*next++]);
  }
  return of_parts;
}

}  // namespace mouthpiece
