#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "deform/mesh/part_kind.h"

namespace mouthpiece {

/// Where the key light comes from; its shadows are looked up by the caller.
Eigen::Vector3f keyLightDirection();

/// A point of a surface that is lit. Directions are unit vectors.
struct LitPoint {
  Eigen::Vector3f normal, to_camera;
  Eigen::Vector3f color;  ///< linear
  float roughness = 0.6F;
  PartKind kind = PartKind::kSkin;
  float key_share = 1;   ///< of the key light that comes through, 0 to 1
  float open_share = 1;  ///< of the light from all around that comes through
};

/// What is seen of it: linear RGB, 1 is white. Light reaches round the edge of flesh, the red of it furthest; what
/// shines does so by Blinn and Phong with the roughness' exponent.
Eigen::Vector3f litColor(const LitPoint& point);

/// Linear light as a byte of the screen's, what is over white rolled off; what is no number is black.
std::uint8_t screenByte(float linear);

/// A corner of a triangle on the raster: where, in samples from the upper left, and what is interpolated.
template <std::size_t kChannels>
struct RasterPoint {
  float x = 0, y = 0;
  std::array<float, kChannels> channels{};
};

/// Calls `visit(row, begin, end, channels, step)` for the samples of each row in [first_row, end_row) whose centres the
/// triangle holds: those from `begin` to before `end`, in [0, width); `channels` at the first, and what the next adds.
/// Triangles that share an edge neither share samples nor leave some out. Corners may lie anywhere and be no numbers.
template <std::size_t kChannels, typename Visit>
void fillTriangle(const std::array<RasterPoint<kChannels>, 3>& corners, int width, int first_row, int end_row,
                  const Visit& visit) {
  std::array<const RasterPoint<kChannels>*, 3> by_row{&corners[0], &corners[1], &corners[2]};
  if (by_row[1]->y < by_row[0]->y) std::swap(by_row[0], by_row[1]);
  if (by_row[2]->y < by_row[1]->y) std::swap(by_row[1], by_row[2]);
  if (by_row[1]->y < by_row[0]->y) std::swap(by_row[0], by_row[1]);
  const RasterPoint<kChannels>&top = *by_row[0], &middle = *by_row[1], &bottom = *by_row[2];
  // Of the centres at or after an edge; what is no number counts as `low`, which std::clamp() would not see to.
  const auto firstAt = [](float edge, int low, int high) {
    return static_cast<int>(
        std::ceil(std::min(std::max(static_cast<float>(low), edge - 0.5F), static_cast<float>(high))));
  };
  const int first = firstAt(top.y, first_row, end_row), last = firstAt(bottom.y, first_row, end_row);
  if (first >= last) return;  // most of the small ones
  const auto& [a, b, c] = corners;
  const float area = (b.x - a.x) * (c.y - a.y) - (c.x - a.x) * (b.y - a.y);
  if (!(std::abs(area) > 1e-9F)) return;
  const float share = 1 / area;
  std::array<float, kChannels> step_x, step_y;
  for (std::size_t i = 0; i < kChannels; ++i) {
    const float ab = b.channels[i] - a.channels[i], ac = c.channels[i] - a.channels[i];
    step_x[i] = (ab * (c.y - a.y) - ac * (b.y - a.y)) * share;
    step_y[i] = (ac * (b.x - a.x) - ab * (c.x - a.x)) * share;
  }
  const auto slope = [](const auto& from, const auto& to) { return (to.x - from.x) / (to.y - from.y); };
  const float far_slope = slope(top, bottom), upper_slope = slope(top, middle), lower_slope = slope(middle, bottom);
  for (int row = first; row < last; ++row) {
    const float y = static_cast<float>(row) + 0.5F;
    const float far = top.x + far_slope * (y - top.y);
    const float near = y < middle.y ? top.x + upper_slope * (y - top.y) : middle.x + lower_slope * (y - middle.y);
    const int begin = firstAt(std::min(far, near), 0, width), end = firstAt(std::max(far, near), 0, width);
    if (begin >= end) continue;
    const float x = static_cast<float>(begin) + 0.5F;
    std::array<float, kChannels> channels;
    for (std::size_t i = 0; i < kChannels; ++i)
      channels[i] = a.channels[i] + step_x[i] * (x - a.x) + step_y[i] * (y - a.y);
    visit(row, begin, end, channels, step_x);
  }
}

}  // namespace mouthpiece
