#include "retarget/rig/eyeballs.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <boost/pending/disjoint_sets.hpp>
#include <map>
#include <optional>
#include <set>

#include "base/errors.h"
#include "base/index.h"
#include "retarget/rig/ball_fit.h"

namespace mouthpiece {
namespace {

constexpr std::size_t kFewest = 12;  ///< vertices of a ball
constexpr double kOnBall = 1.3;      ///< radii from its middle: what lies on it
constexpr double kFront = 0.6;       ///< cosine: within 53 degrees of straight ahead

/// Pieces of the eyes' triangles, vertices at one place being one.
std::vector<std::vector<std::uint32_t>> piecesOf(const FaceMesh& mesh) {
  const std::vector<Triangle> triangles = trianglesOf(mesh, {PartKind::kEye});
  std::map<std::array<float, 3>, std::uint32_t> first_at;
  std::set<std::uint32_t> used;
  boost::disjoint_sets_with_storage<> sets(mesh.vertexCount());
  for (const Triangle& triangle : triangles) {
    for (const std::uint32_t vertex : triangle) {
      const auto row = mesh.vertices.row(vertex);
      sets.union_set(vertex, first_at.try_emplace({row(0), row(1), row(2)}, vertex).first->second);
      sets.union_set(vertex, triangle[0]);
      used.insert(vertex);
    }
  }
  std::map<std::size_t, std::vector<std::uint32_t>> by_set;
  for (const std::uint32_t vertex : used) by_set[sets.find_set(vertex)].push_back(vertex);
  std::vector<std::vector<std::uint32_t>> pieces;
  for (auto& [unused, vertices] : by_set) pieces.push_back(std::move(vertices));
  return pieces;
}

std::optional<Ball> ballOf(const FaceMesh& mesh, const std::vector<std::uint32_t>& vertices) {
  if (vertices.size() < kFewest) return std::nullopt;
  std::vector<Eigen::Vector3d> places;
  for (const std::uint32_t vertex : vertices) places.emplace_back(mesh.vertices.row(vertex).transpose().cast<double>());
  return ballThrough(places);
}

}  // namespace

Eyeballs::Eyeballs(const FaceMesh& mesh) {
  const std::vector<std::vector<std::uint32_t>> pieces = piecesOf(mesh);
  std::vector<Ball> balls;
  const auto ballAt = [&](const Eigen::Vector3d& middle, double radius) {
    return std::find_if(balls.begin(), balls.end(),
                        [&](const Ball& ball) { return (ball.middle - middle).norm() < 0.5 * (ball.radius + radius); });
  };
  std::vector<std::pair<std::uint32_t, std::size_t>> turning;
  std::vector<const std::vector<std::uint32_t>*> others;
  for (const std::vector<std::uint32_t>& piece : pieces) {
    const std::optional<Ball> ball = ballOf(mesh, piece);
    if (!ball) {
      others.push_back(&piece);
      continue;
    }
    auto known = ballAt(ball->middle, ball->radius);
    if (known == balls.end()) known = balls.insert(balls.end(), *ball);
    for (const std::uint32_t vertex : piece) turning.emplace_back(vertex, unsignedIndex(known - balls.begin()));
  }
  for (const std::vector<std::uint32_t>* piece : others) {
    for (std::size_t b = 0; b < balls.size(); ++b) {
      const bool lies_on = std::all_of(piece->begin(), piece->end(), [&](std::uint32_t vertex) {
        const Eigen::Vector3d off = mesh.vertices.row(vertex).transpose().cast<double>() - balls[b].middle;
        return off.norm() < kOnBall * balls[b].radius && off.z() > kFront * off.norm();
      });
      if (!lies_on) continue;
      for (const std::uint32_t vertex : *piece) turning.emplace_back(vertex, b);
      break;
    }
  }
  std::sort(turning.begin(), turning.end());
  for (const auto& [vertex, ball] : turning) {
    vertices_.push_back(vertex);
    ball_.push_back(ball);
  }
  for (const Ball& ball : balls) middles_.push_back(ball.middle.cast<float>());
}

void Eyeballs::places(const FaceMesh& mesh, const GazeTurn& gaze, std::span<float> out) const {
  MOUTHPIECE_EXPECT(out.size() == 3 * vertices_.size());
  const Eigen::Matrix3f turn =
      (Eigen::AngleAxisf(gaze.yaw, Eigen::Vector3f::UnitY()) * Eigen::AngleAxisf(-gaze.pitch, Eigen::Vector3f::UnitX()))
          .toRotationMatrix();
  for (std::size_t i = 0; i < vertices_.size(); ++i) {
    const Eigen::Vector3f& middle = middles_[ball_[i]];
    Eigen::Vector3f::Map(&out[3 * i]) = middle + turn * (mesh.vertices.row(vertices_[i]).transpose() - middle);
  }
}

}  // namespace mouthpiece
