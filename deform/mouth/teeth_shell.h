#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <vector>

#include "deform/mesh/face_mesh.h"

namespace mouthpiece {

/// A row of teeth with its gum as lips meet it: how far it reaches from an upright axis inside the dental arch, over
/// direction and height. Whatever the teeth look like, a point is looked up in a few operations, wherever the lips have
/// slid to.
class TeethShell {
 public:
  /// How far behind the shell a point is, and the way out.
  struct Depth {
    float depth = 0;  ///< 0 outside
    Eigen::Vector3f out = Eigen::Vector3f::Zero();
  };

  TeethShell() = default;
  /// `triangles` of `vertices`: one row of teeth; `hangs`: the upper one, whose edge is its lower end. `cell`: width of
  /// the net over direction and height; coarser where teeth of that size would need millions of samples.
  TeethShell(const VertexPositions& vertices, const std::vector<Triangle>& triangles, bool hangs, float cell);

  [[nodiscard]] bool empty() const { return reach_.empty(); }

  /// What is deeper than `deepest` is in the mouth, not at the lips, and counts as outside; from half of that on the
  /// depth fades. `around_edge`: where it is nearer, the way out is around the edge of the teeth.
  [[nodiscard]] Depth depthAt(const Eigen::Vector3f& p, float deepest, bool around_edge) const;
  /// False where depthAt() is 0 for certain, all around as far as bound() was told; a few operations.
  [[nodiscard]] bool mayTouch(const Eigen::Vector3f& p) const {
    const float x = p.x() - axis_x_, z = p.z() - axis_z_;
    const float around = std::abs(x) + std::abs(z);
    const float turns = z >= 0 ? x / around : std::copysign(2 - std::abs(x) / around, x);
    const float column = turns * columns_per_turn_ + middle_column_, row = (p.y() - lowest_) * rows_per_height_ + 0.5F;
    if (!(column >= 0 && column < static_cast<float>(columns_) && row > -bounded_rows_ &&
          row < static_cast<float>(rows_) + bounded_rows_))
      return false;
    const auto nearest_row = static_cast<std::size_t>(std::min(std::max(row, 0.0F), static_cast<float>(rows_ - 1)));
    return x * x + z * z < bounds_[static_cast<std::size_t>(column) * static_cast<std::size_t>(rows_) + nearest_row];
  }
  /// Prepares mayTouch(): points that are moved by less than `margin` afterwards are counted in.
  void bound(float margin);

  /// Whether a tooth is at the height of `p`, at most `distance` further in.
  [[nodiscard]] bool isNear(const Eigen::Vector3f& p, float distance) const;

 private:
  struct Sample {
    float reach = 0, filled = 0;           ///< mean over the filled corners of the net's cell, and their weight
    float per_column = 0, per_height = 0;  ///< slopes
  };
  void fillGrooves(int cells);
  [[nodiscard]] float columnOf(float x, float z) const;
  [[nodiscard]] Sample sampleAt(float column, float row) const;

  std::vector<float> reach_;   ///< columns of directions, each of `rows_` heights; 0: no tooth
  std::vector<float> edge_;    ///< height of the teeth's edge by direction; NaN: no tooth
  std::vector<float> bounds_;  ///< of `reach_`, squared
  int columns_ = 0, rows_ = 0;
  float columns_per_turn_ = 0, middle_column_ = 0, rows_per_height_ = 1, bounded_rows_ = 0;
  float axis_x_ = 0, axis_z_ = 0, lowest_ = 0, cell_ = 1, farthest_ = 0;
  bool hangs_ = false;
};

}  // namespace mouthpiece
