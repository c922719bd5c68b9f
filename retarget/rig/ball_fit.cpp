#include "retarget/rig/ball_fit.h"

#include <Eigen/Geometry>
#include <Eigen/QR>
#include <cmath>

#include "base/errors.h"
#include "base/index.h"

namespace mouthpiece {
namespace {

constexpr double kRound = 0.12;       ///< of its radius: how far its vertices lie off the sphere, root mean square
constexpr double kLeastExtent = 1.2;  ///< of its radius: how wide and high it is
constexpr double kLeastDepth = 0.5;   ///< and how deep: a tear line is a ring

}  // namespace

Ball sphereThrough(std::span<const Eigen::Vector3d> places) {
  MOUTHPIECE_EXPECT(places.size() >= 4);
  Eigen::MatrixXd rows(signedIndex(places.size()), 4);
  Eigen::VectorXd squares(rows.rows());
  for (std::size_t i = 0; i < places.size(); ++i) {
    rows.row(signedIndex(i)) << 2 * places[i].transpose(), 1;
    squares(signedIndex(i)) = places[i].squaredNorm();
  }
  const Eigen::Vector4d solved = rows.colPivHouseholderQr().solve(squares);
  return {solved.head<3>(), std::sqrt(solved(3) + solved.head<3>().squaredNorm())};
}

std::optional<Ball> ballThrough(std::span<const Eigen::Vector3d> places) {
  const Ball ball = sphereThrough(places);
  if (!(ball.radius > 0) || !std::isfinite(ball.radius) || !ball.middle.allFinite()) return std::nullopt;
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& place : places) box.extend(place);
  double off = 0;
  for (const Eigen::Vector3d& place : places) off += std::pow((place - ball.middle).norm() - ball.radius, 2);
  const bool is_round = std::sqrt(off / asReal(std::ssize(places))) < kRound * ball.radius;
  const Eigen::Vector3d extent = box.sizes();
  const bool is_wide = extent.x() > kLeastExtent * ball.radius && extent.y() > kLeastExtent * ball.radius &&
                       extent.z() > kLeastDepth * ball.radius;
  return is_round && is_wide ? std::optional(ball) : std::nullopt;
}

}  // namespace mouthpiece
