#include "deform/mouth/teeth_shell.h"

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
    squares += std::pow(static_cast<double>(longest(triangle)), 2);
  }
  // The front of an arch is about half a circle.
  const float radius = 0.5F * (high.x() - low.x());
  const float around = 2 * kWidest * 1.57F * radius;
  cell_ = std::max({cell, static_cast<float>(std::sqrt(squares / kSamples)), around / kMostCells,
                    (high.y() - low.y()) / kMostCells});
  if (!(radius > 0 && cell_ > 0)) return;
  axis_x_ = 0.5F * (low.x() + high.x());
  axis_z_ = high.z() - radius;
  lowest_ = low.y();
  rows_per_height_ = 1 / cell_;
  columns_ = static_cast<int>(around / cell_) + 2;
  rows_ = static_cast<int>((high.y() - low.y()) / cell_) + 2;
  reach_.assign(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_), 0.0F);
  edge_.assign(static_cast<std::size_t>(columns_), std::numeric_limits<float>::quiet_NaN());
  for (const Triangle& triangle : triangles) {
    const int cuts = static_cast<int>(2 * longest(triangle) / cell_) + 1;
    for (int i = 0; i <= cuts; ++i) {
      for (int j = 0; i + j <= cuts; ++j) {
        const Vector3f p = (static_cast<float>(i) * at(triangle[0]) + static_cast<float>(j) * at(triangle[1]) +
                            static_cast<float>(cuts - i - j) * at(triangle[2])) /
                           static_cast<float>(cuts);
        const int column = static_cast<int>(std::floor(columnOf(p.x(), p.z()) + 0.5F));
        const int row = static_cast<int>((p.y() - lowest_) * rows_per_height_ + 0.5F);
        if (column < 0 || column >= columns_ || row < 0 || row >= rows_) continue;
        const auto c = static_cast<std::size_t>(column);
        float& reach = reach_[c * static_cast<std::size_t>(rows_) + static_cast<std::size_t>(row)];
        reach =
            std::max(reach, std::sqrt((p.x() - axis_x_) * (p.x() - axis_x_) + (p.z() - axis_z_) * (p.z() - axis_z_)));
        if (std::isnan(edge_[c]) || (hangs_ ? p.y() < edge_[c] : p.y() > edge_[c])) edge_[c] = p.y();
      }
    }
  }
  fillGrooves(static_cast<int>(kGroove * radius / cell_));
}

/// Lips lie on the teeth's crowns and not in the grooves between them.
void TeethShell::fillGrooves(int cells) {
  const auto widened = [&](int count, int others, int stride, int other_stride) {
    const std::vector<float> before = reach_;
    for (int o = 0; o < others; ++o) {
      for (int i = 0; i < count; ++i) {
        float& reach = reach_[static_cast<std::size_t>(i * stride + o * other_stride)];
        if (reach <= 0) continue;
        for (int k = std::max(i - cells, 0); k <= std::min(i + cells, count - 1); ++k)
          reach = std::max(reach, before[static_cast<std::size_t>(k * stride + o * other_stride)]);
        farthest_ = std::max(farthest_, reach);
      }
    }
  };
  widened(rows_, columns_, 1, rows_);
  widened(columns_, rows_, rows_, 1);
}

float TeethShell::columnOf(float x, float z) const {
  const float turns = quarterTurns(x - axis_x_, z - axis_z_);
  return (turns / kWidest + 1) * 0.5F * static_cast<float>(columns_ - 1);
}

TeethShell::Sample TeethShell::sampleAt(float column, float row) const {
  if (!(column >= 0 && row >= 0 && column < static_cast<float>(columns_ - 1) && row < static_cast<float>(rows_ - 1)))
    return {};
  const int c = static_cast<int>(column), r = static_cast<int>(row);
  const float x = column - static_cast<float>(c), y = row - static_cast<float>(r);
  const float* near = reach_.data() + static_cast<std::size_t>(c) * static_cast<std::size_t>(rows_) + r;
  const float* far = near + rows_;
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
  const float columns_per_length = 0.5F * static_cast<float>(columns_ - 1) / kWidest / (spread * spread * radius);
  const Vector3f outward(x / radius, 0, z / radius), beside(z / radius, 0, -x / radius);
  Vector3f way = outward - sample.per_column * columns_per_length * beside - sample.per_height * Vector3f::UnitY();
  way.normalize();
  const float straight = std::max(way.dot(outward), kSideways);
  const float fade = std::clamp(2 - 2 * behind / deepest, 0.0F, 1.0F);
  const float depth = sample.filled * fade * behind * straight;
  if (!around_edge) return {depth, way};
  const float edge = edge_[static_cast<std::size_t>(column + 0.5F)];
  const float past_edge = std::isnan(edge) ? depth : std::max(0.0F, hangs_ ? p.y() - edge : edge - p.y());
  if (past_edge >= depth) return {depth, way};
  return {past_edge, hangs_ ? Vector3f(-Vector3f::UnitY()) : Vector3f(Vector3f::UnitY())};
}

void TeethShell::bound(float margin) {
  const int around = static_cast<int>(margin / cell_) + 2;
  bounded_rows_ = static_cast<float>(around);
  // The highest of the cells around, first along the columns, then across them.
  std::vector<float> highest(reach_.size(), 0.0F);
  bounds_ = highest;
  for (int c = 0; c < columns_; ++c) {
    for (int r = 0; r < rows_; ++r) {
      for (int k = std::max(r - around, 0); k <= std::min(r + around, rows_ - 1); ++k) {
        highest[static_cast<std::size_t>(c * rows_ + r)] =
            std::max(highest[static_cast<std::size_t>(c * rows_ + r)], reach_[static_cast<std::size_t>(c * rows_ + k)]);
      }
    }
  }
  for (int c = 0; c < columns_; ++c) {
    for (int r = 0; r < rows_; ++r) {
      float reach = 0;
      for (int k = std::max(c - around, 0); k <= std::min(c + around, columns_ - 1); ++k)
        reach = std::max(reach, highest[static_cast<std::size_t>(k * rows_ + r)]);
      bounds_[static_cast<std::size_t>(c * rows_ + r)] = reach > 0 ? (reach + margin) * (reach + margin) : 0.0F;
    }
  }
  columns_per_turn_ = 0.5F * static_cast<float>(columns_ - 1) / kWidest;
  middle_column_ = 0.5F * static_cast<float>(columns_ - 1) + 0.5F;
}

bool TeethShell::isNear(const Vector3f& p, float distance) const {
  if (empty()) return false;
  const Sample sample = sampleAt(columnOf(p.x(), p.z()), (p.y() - lowest_) * rows_per_height_);
  return sample.filled > 0 && std::hypot(p.x() - axis_x_, p.z() - axis_z_) < sample.reach + distance;
}

}  // namespace mouthpiece
