#include "retarget/placing/upright_head.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace mouthpiece {
namespace {

using Eigen::Matrix3f;
using Eigen::Vector3f;

/// The angle within which the file's axes are right: what shapes tell of up and forward is off by up to 30 degrees.
constexpr float kOffAxes = std::numbers::pi_v<float> / 180 * 40;

/// So many times as far as what the jaw moves is from its middle (root mean square) the head is looked at.
constexpr float kAround = 3;

/// The middle of what a shape moves, and the mean way there, each vertex by how far it goes; no weight: nothing moves.
struct Moved {
  Vector3f middle = Vector3f::Zero(), way = Vector3f::Zero();
  float weight = 0;
};

Moved movedBy(const VertexPositions& moves, const FaceMesh& mesh, const std::vector<std::uint32_t>& skin) {
  Moved moved;
  if (moves.rows() == 0) return moved;
  for (const std::uint32_t v : skin) {
    const float far = moves.row(v).norm();
    moved.middle += far * mesh.vertices.row(v).transpose();
    moved.way += far * moves.row(v).transpose();
    moved.weight += far;
  }
  if (moved.weight > 0) {
    moved.middle /= moved.weight;
    moved.way /= moved.weight;
  }
  return moved;
}

/// From the middle of the skin around what the jaw moves to the middle of that: forwards and downwards. A body, further
/// off, says nothing of where its head looks.
Vector3f toFront(const Moved& jaw, const FaceMesh& mesh, const std::vector<std::uint32_t>& skin,
                 const VertexPositions& jaw_open) {
  const auto squaredWay = [&](std::uint32_t v) {
    return (mesh.vertices.row(v).transpose() - jaw.middle).squaredNorm();
  };
  float squares = 0;
  for (const std::uint32_t v : skin) squares += jaw_open.row(v).norm() / jaw.weight * squaredWay(v);
  Vector3f middle = Vector3f::Zero();
  float count = 0;
  for (const std::uint32_t v : skin) {
    if (squaredWay(v) > kAround * kAround * squares) continue;
    middle += mesh.vertices.row(v).transpose();
    ++count;
  }
  return jaw.middle - middle / std::max(count, 1.0F);
}

/// Rows: the directions that `up` and `forward` make, the latter at right angles to the former.
Matrix3f rowsOf(const Vector3f& up, const Vector3f& forward) {
  Matrix3f turn;
  turn.row(1) = up.normalized();
  turn.row(2) = (forward - forward.dot(turn.row(1)) * turn.row(1).transpose()).normalized();
  turn.row(0) = turn.row(1).cross(turn.row(2));
  return turn;
}

/// The turn by right angles that is nearest to `turn`.
Matrix3f onAxes(const Matrix3f& turn) {
  Matrix3f nearest = Matrix3f::Identity();
  float most = -std::numeric_limits<float>::infinity();
  for (int up = 0; up < 6; ++up) {
    for (int forward = 0; forward < 6; ++forward) {
      if (up % 3 == forward % 3) continue;
      const auto axis = [](int number) -> Vector3f { return (number < 3 ? 1 : -1) * Vector3f::Unit(number % 3); };
      const Matrix3f tried = rowsOf(axis(up), axis(forward));
      const float alike = (tried.transpose() * turn).trace();
      if (alike <= most) continue;
      most = alike;
      nearest = tried;
    }
  }
  return nearest;
}

}  // namespace

Matrix3f uprightFromGiven(const FaceMesh& mesh, const std::vector<std::uint32_t>& skin, const TellingShapes& shapes) {
  const Moved jaw = movedBy(shapes.jaw_open, mesh, skin), right = movedBy(shapes.blink_right, mesh, skin),
              left = movedBy(shapes.blink_left, mesh, skin);
  if (jaw.weight <= 0 || jaw.way.norm() <= 0) return Matrix3f::Identity();
  Vector3f forward = toFront(jaw, mesh, skin, shapes.jaw_open);
  // A jaw turns about a hinge behind it: it goes as far back as what it moves lies forward of that.
  Vector3f up = -(jaw.way.normalized() + forward.normalized()).normalized();
  const bool blinks = right.weight > 0 && left.weight > 0;
  if (blinks) {
    up += (0.5F * (right.middle + left.middle) - jaw.middle).normalized();
    const Vector3f straight = (left.middle - right.middle).cross(up);
    forward = (straight.dot(forward) < 0 ? -1 : 1) * straight;
  }
  const Matrix3f told = rowsOf(up, forward);
  if (!told.allFinite()) return Matrix3f::Identity();
  const Matrix3f right_angles = onAxes(told);
  const float off = Eigen::AngleAxisf(Matrix3f(told * right_angles.transpose())).angle();
  return !blinks || off < kOffAxes ? right_angles : told;
}

}  // namespace mouthpiece
