#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>

namespace mouthpiece {

/// The `count` (or fewer) orthonormal columns that span `trajectories` (frames x channels) best in the least-squares
/// sense, strongest first: randomised range finder with one power iteration (Halko, Martinsson, Tropp 2011, alg. 4.4),
/// O(frames * channels * count). Deterministic.
Eigen::MatrixXf leadingTrajectories(const Eigen::MatrixXf& trajectories, Eigen::Index count);

/// The fewest leading trajectories after which no point of `trajectories` (frames x (3 * points)) is further than
/// `tolerance` from its projection in any frame. Columns orthonormal.
Eigen::MatrixXf trajectoryBasis(const Eigen::MatrixXf& trajectories, float tolerance);

/// `basis`, trajectoryBasis() of the first rows of `trajectories`, in all of them: in the others by least squares.
Eigen::MatrixXf basisInAllFrames(const Eigen::MatrixXf& basis, const Eigen::MatrixXf& trajectories);

/// Eight vertices over all frames, the unit that principalShapes() works in: it stays in the first cache.
/// A row holds x of the eight, then y, then z. Row counts are padded to a multiple of kPanelRowBlock with zero rows.
inline constexpr std::ptrdiff_t kPanelVertices = 8;
inline constexpr std::ptrdiff_t kPanelWidth = 3 * kPanelVertices;
inline constexpr std::ptrdiff_t kPanelRowBlock = 4;

/// The inner loops, for the processor at hand. Wide and narrow versions give the same bits: each sum keeps its order
/// and multiply-adds are not contracted.
struct PanelKernels {
  /// panel[f] = positions[f * row_stride] - rest, for eight vertices stored x y z x y z ...;
  /// largest_squared[v]: the square of v's largest displacement, NaN when a position of v is not finite.
  void (*load_displacements)(const float* positions, std::ptrdiff_t row_stride, std::ptrdiff_t frames,
                             const float* rest, float* panel, float* largest_squared);
  /// The same in whole steps, to be held: steps[f] = (positions[f * row_stride] - rest) * steps_a_unit, rounded, no
  /// further than 32,767. farthest (x y z of each vertex): the most steps so far, NaN once a position was not finite.
  void (*store_steps)(const float* positions, std::ptrdiff_t row_stride, std::ptrdiff_t frames, const float* rest,
                      float steps_a_unit, std::int16_t* steps, float* farthest);
  /// panel = step * steps; largest_squared[v] as of load_displacements.
  void (*load_steps)(const std::int16_t* steps, std::ptrdiff_t frames, float step, float* panel,
                     float* largest_squared);
  /// product (rows x kPanelWidth) = factors (rows x inner, row-major) * panel (inner x kPanelWidth).
  void (*multiply)(const float* factors, std::ptrdiff_t rows, std::ptrdiff_t inner, const float* panel, float* product);
  /// largest_squared[v] = max over frames of |panel - weights(:, columns) * shapes|^2, a row of weights every
  /// `row_stride` floats, shape_count rows of shapes and as many columns.
  void (*largest_residual)(const float* weights, std::ptrdiff_t row_stride, std::ptrdiff_t frames,
                           const std::int32_t* columns, std::ptrdiff_t shape_count, const float* panel,
                           const float* shapes, float* largest_squared);
};

const PanelKernels& panelKernels();
/// The version every processor has; for tests.
const PanelKernels& portablePanelKernels();

}  // namespace mouthpiece
