#include "deform/mouth/lip_guard.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace mouthpiece {
namespace {

using Eigen::Vector3f;

constexpr float kWidest = 1.3F;     ///< directions seen, in quarter turns to each side
constexpr double kSamples = 2e6;    ///< of all triangles together, about
constexpr float kMostCells = 1000;  ///< along one side of the net
constexpr float kGroove = 0.04F;    ///< of half the arch' width: lips do not dip into what is narrower
constexpr float kSideways = 0.2F;   ///< the least share of a way that is one of radius: flat ground is no way out

/// Direction of (x, z) from the axis in quarter turns, ahead: 0; a function of the angle that needs no arc tangent.
float quarterTurns(float x, float z) {
  const float around = std::abs(x) + std::abs(z);
  if (!(around > 0)) return 0;
  return z >= 0 ? x / around : std::copysign(2 - std::abs(x) / around, x);
}

using Net = Eigen::ArrayXXf;

/// The largest of the entries up to `cells` above and below each, column by column.
Net mostAround(const Net& net, Eigen::Index cells) {
  Net most(net.rows(), net.cols());
  for (Eigen::Index r = 0; r < net.rows(); ++r) {
    const Eigen::Index first = std::max<Eigen::Index>(r - cells, 0), last = std::min(r + cells, net.rows() - 1);
    most.row(r) = net.middleRows(first, last - first + 1).colwise().maxCoeff();
  }
  return most;
}

}  // namespace

TeethShell::TeethShell(const VertexPositions& vertices, const std::vector<Triangle>& triangles, bool hangs, float cell)
    : hangs_(hangs) {
  if (triangles.empty()) return;
  const auto at = [&](std::uint32_t v) -> Vector3f { return vertices.row(v).transpose(); };
  Vector3f low = at(triangles[0][0]), high = low;
  double squares = 0;
  const auto longest = [&](const Triangle& t) {
    return std::max({(at(t[1]) - at(t[0])).norm(), (at(t[2]) - at(t[1])).norm(), (at(t[0]) - at(t[2])).norm()});
  };
  for (const Triangle& triangle : triangles) {
    for (const std::uint32_t v : triangle) {
      low = low.cwiseMin(at(v));
      high = high.cwiseMax(at(v));
    }
    squares += std::pow(double{longest(triangle)}, 2);
  }
  // The front of an arch is about half a circle.
  const float radius = 0.5F * (high.x() - low.x());
  const float around = 2 * kWidest * 1.57F * radius;
  cell_ =
      std::max({cell, asFloat(std::sqrt(squares / kSamples)), around / kMostCells, (high.y() - low.y()) / kMostCells});
  if (!(radius > 0 && cell_ > 0)) return;
  axis_x_ = 0.5F * (low.x() + high.x());
  axis_z_ = high.z() - radius;
  lowest_ = low.y();
  rows_per_height_ = 1 / cell_;
  reach_ = Net::Zero(wholePart((high.y() - low.y()) / cell_) + 2, wholePart(around / cell_) + 2);
  edge_ = Eigen::ArrayXf::Constant(reach_.cols(), std::numeric_limits<float>::quiet_NaN());
  for (const Triangle& triangle : triangles)
    take(at(triangle[0]), at(triangle[1]), at(triangle[2]), wholePart(2 * longest(triangle) / cell_) + 1);
  reach_ = reach_.unaryExpr([](float square) { return std::sqrt(square); });  // Eigen has one that rounds
  fillGrooves(wholePart(kGroove * radius / cell_));
}

/// Samples a triangle's places, `cuts` on each side.
void TeethShell::take(const Vector3f& a, const Vector3f& b, const Vector3f& c, Eigen::Index cuts) {
  using Lanes = Eigen::Array<float, 8, 1>;
  const Lanes count = Lanes::LinSpaced(0, asFloat(Lanes::SizeAtCompileTime - 1));
  const float rows = asFloat(reach_.rows()), columns = asFloat(reach_.cols());
  for (Eigen::Index i = 0; i <= cuts; ++i) {
    for (Eigen::Index j = 0; i + j <= cuts; j += Lanes::SizeAtCompileTime) {
      const Lanes along = asFloat(j) + count, left = asFloat(cuts - i) - along;
      const auto place = [&](Eigen::Index axis) -> Lanes {
        return (asFloat(i) * a[axis] + along * b[axis] + left * c[axis]) / asFloat(cuts);
      };
      const Lanes x = place(0) - axis_x_, y = place(1), z = place(2) - axis_z_;
      const Lanes ahead = x / (x.abs() + z.abs()), square = x * x + z * z;
      const Lanes row = (y - lowest_) * rows_per_height_ + 0.5F;
      for (Eigen::Index lane = 0; lane < std::min<Eigen::Index>(Lanes::SizeAtCompileTime, cuts - i - j + 1); ++lane) {
        // As columnOf() has it; no number on the axis itself, where there are no teeth.
        const float turns = z[lane] >= 0 ? ahead[lane] : std::copysign(2 - std::abs(ahead[lane]), x[lane]);
        const float column = (turns / kWidest + 1) * 0.5F * (columns - 1) + 0.5F;
        if (!(column >= 0 && column < columns && row[lane] >= 0 && row[lane] < rows)) continue;
        float& reach = reach_(wholePart(row[lane]), wholePart(column));
        reach = std::max(reach, square[lane]);
        float& edge = edge_[wholePart(column)];
        if (std::isnan(edge) || (hangs_ ? y[lane] < edge : y[lane] > edge)) edge = y[lane];
      }
    }
  }
}

/// Lips lie on the teeth's crowns and not in the grooves between them.
void TeethShell::fillGrooves(Eigen::Index cells) {
  const auto widened = [cells](const Net& net) {
    const Net most = mostAround(net, cells);
    return Net((net > 0).select(most, net));
  };
  reach_ = widened(reach_);
  reach_ = widened(reach_.transpose()).transpose().eval();
  farthest_ = std::max(0.0F, reach_.maxCoeff());
}

float TeethShell::columnOf(float x, float z) const {
  const float turns = quarterTurns(x - axis_x_, z - axis_z_);
  return (turns / kWidest + 1) * 0.5F * asFloat(reach_.cols() - 1);
}

TeethShell::Sample TeethShell::sampleAt(float column, float row) const {
  if (!(column >= 0 && row >= 0 && column < asFloat(reach_.cols() - 1) && row < asFloat(reach_.rows() - 1))) return {};
  const Eigen::Index c = wholePart(column), r = wholePart(row);
  const float x = column - asFloat(c), y = row - asFloat(r);
  const float* near = &reach_(r, c);
  const float* far = near + reach_.rows();
  if (std::min({near[0], near[1], far[0], far[1]}) > 0) {
    const float low = near[0] + x * (far[0] - near[0]), high = near[1] + x * (far[1] - near[1]);
    return {low + y * (high - low), 1, (1 - y) * (far[0] - near[0]) + y * (far[1] - near[1]), (high - low) / cell_};
  }
  Sample sample;
  const std::array<float, 4> weights{(1 - x) * (1 - y), (1 - x) * y, x * (1 - y), x * y};
  const std::array<float, 4> values{near[0], near[1], far[0], far[1]};
  for (std::size_t k = 0; k < values.size(); ++k) {
    if (values[k] <= 0) continue;
    sample.filled += weights[k];
    sample.reach += weights[k] * values[k];
  }
  if (!(sample.filled > 0)) return {};
  sample.reach /= sample.filled;
  return sample;
}

TeethShell::Depth TeethShell::depthAt(const Vector3f& p, float deepest, bool around_edge) const {
  const float x = p.x() - axis_x_, z = p.z() - axis_z_;
  const float squared = x * x + z * z;
  if (squared >= farthest_ * farthest_ || !(squared > 0)) return {};
  const float column = columnOf(p.x(), p.z());
  const Sample sample = sampleAt(column, (p.y() - lowest_) * rows_per_height_);
  const float radius = std::sqrt(squared);
  const float behind = sample.reach - radius;
  if (behind <= 0 || !(sample.filled > 0) || behind >= deepest) return {};
  // Around the axis the columns lie (|sin| + |cos|)^2 / radius apart in quarter turns.
  const float spread = (std::abs(x) + std::abs(z)) / radius;
  const float columns_per_length = 0.5F * asFloat(reach_.cols() - 1) / kWidest / (spread * spread * radius);
  const Vector3f outward(x / radius, 0, z / radius), beside(z / radius, 0, -x / radius);
  Vector3f way = outward - sample.per_column * columns_per_length * beside - sample.per_height * Vector3f::UnitY();
  way.normalize();
  const float straight = std::max(way.dot(outward), kSideways);
  const float fade = std::clamp(2 - 2 * behind / deepest, 0.0F, 1.0F);
  const float depth = sample.filled * fade * behind * straight;
  if (!around_edge) return {depth, way};
  const float edge = edge_[wholePart(column + 0.5F)];
  const float past_edge = std::isnan(edge) ? depth : std::max(0.0F, hangs_ ? p.y() - edge : edge - p.y());
  if (past_edge >= depth) return {depth, way};
  return {past_edge, hangs_ ? Vector3f(-Vector3f::UnitY()) : Vector3f(Vector3f::UnitY())};
}

void TeethShell::bound(float margin) {
  const Eigen::Index around = wholePart(margin / cell_) + 2;
  bounded_rows_ = asFloat(around);
  // The highest of the cells around, first along the columns, then across them.
  const Net across = mostAround(mostAround(reach_, around).transpose(), around);
  bounds_ = (across > 0).select((across + margin).square(), 0.0F).transpose();
  columns_per_turn_ = 0.5F * asFloat(reach_.cols() - 1) / kWidest;
  middle_column_ = 0.5F * asFloat(reach_.cols() - 1) + 0.5F;
}

bool TeethShell::isNear(const Vector3f& p, float distance) const {
  if (empty()) return false;
  const Sample sample = sampleAt(columnOf(p.x(), p.z()), (p.y() - lowest_) * rows_per_height_);
  return sample.filled > 0 && std::hypot(p.x() - axis_x_, p.z() - axis_z_) < sample.reach + distance;
}

}  // namespace mouthpiece
