#pragma once

#include <Eigen/Core>

namespace mouthpiece {

/// The `count` (or fewer) orthonormal columns that span `trajectories` (frames x channels) best in the least-squares
/// sense, strongest first: randomised range finder with one power iteration (Halko, Martinsson, Tropp 2011, alg. 4.4),
/// O(frames * channels * count). Deterministic.
Eigen::MatrixXf leadingTrajectories(const Eigen::MatrixXf& trajectories, Eigen::Index count);

/// The fewest leading trajectories after which no point of `trajectories` (frames x (3 * points)) is further than
/// `tolerance` from its projection in any frame. Columns orthonormal.
Eigen::MatrixXf trajectoryBasis(const Eigen::MatrixXf& trajectories, float tolerance);

}  // namespace mouthpiece
