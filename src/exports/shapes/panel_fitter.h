#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "exports/shapes/principal_shapes.h"
#include "exports/shapes/stepped_frames.h"

namespace mouthpiece {

/// Of the tolerance: what sampled vertices are fitted to. Measured on the default face: at 0.7 of 500 sampled vertices
/// under one vertex in 200 is left for the second round.
inline constexpr float kSampleShare = 0.85F;
/// Vertices whose residuals are held at a time.
inline constexpr std::size_t kRefinedAtOnce = 400;

/// What is to be fitted: frames as they are, or as steps.
struct Fit {
  const FaceAnimation* animation;
  const SteppedFrames* stepped;
  const Eigen::RowVectorXf& rest;
  float tolerance;            ///< mesh unit
  Eigen::Index telling = -1;  ///< as many of the first frames tell the shapes; negative: all

  /// The frames by which the shapes are found; all are measured.
  [[nodiscard]] Eigen::Index tellingFrames() const { return telling < 0 ? frames() : telling; }
  [[nodiscard]] Eigen::Index frames() const {
    return stepped != nullptr ? stepped->frameCount() : animation->positions.rows();
  }
  [[nodiscard]] Eigen::Index vertices() const { return rest.cols() / 3; }
};

/// Frames as steps, or as they are where a vertex goes too far for these: the tolerance makes up for the steps.
class HeldFrames {
 public:
  /// `moving_rest`: where the vertices of `frames` rest; it has to outlive this.
  HeldFrames(const FrameMaker& frames, std::span<const Eigen::Index> which, const Eigen::RowVectorXf& moving_rest,
             double mm_per_unit, double tolerance_mm);

  /// `telling`: as Fit's.
  [[nodiscard]] Fit fit(Eigen::Index telling = -1) const;
  double off_mm = 0;  ///< a vertex at most

 private:
  std::optional<SteppedFrames> stepped_;
  FaceAnimation animation_;
  const Eigen::RowVectorXf& rest_;
  float tolerance_;
};

/// Where the vertices that the columns of `shapes` move are at rest.
Eigen::RowVectorXf movingRest(const PrincipalShapes& shapes, const VertexPositions& rest);

/// Displacements of the given vertices, frames x (3 * count).
Eigen::MatrixXf displacementsOf(const Fit& fit, const std::vector<Eigen::Index>& vertices);

/// Trajectories b_k, orthonormal over the frames that tell the shapes, turned into weights in [0, 1] and the rows that
/// take these frames' displacements D to shapes: D = sum_k b_k (b_k^T D) = sum_k w_k s_k + offset with
/// w_k = (b_k - low_k) / range_k, s_k = range_k b_k^T D and offset = sum_k (low_k / range_k) s_k.
struct Weights {
  RowMajorMatrixF weights;           ///< padded frames x (1 + count); the first column, the offset's, is 1
  RowMajorMatrixF inverse;           ///< padded count x padded telling frames: s = inverse * D
  std::vector<float> offset_shares;  ///< low_k / range_k
  Eigen::Index count = 0;            ///< without the offset
};

/// `telling`: of the first rows of `basis`, over which its columns are orthonormal.
Weights weightsFromBasis(const Eigen::MatrixXf& basis, Eigen::Index telling);

/// Shapes of all vertices by `weights` into `shapes`, which holds zeros; squares of their largest errors.
std::vector<float> fitAllVertices(const Fit& fit, const Weights& weights, RowMajorMatrixF& shapes);

/// Squares of the largest distances that `weights` (frames x shapes) times `shapes` leaves of each vertex.
std::vector<float> errorsOfAllVertices(const Fit& fit, const RowMajorMatrixF& weights, const RowMajorMatrixF& shapes);

/// The vertices whose square in `errors` is above `allowed`, rising.
std::vector<Eigen::Index> verticesBeyond(const std::vector<float>& errors, float allowed);

/// At most kRefinedAtOnce of `vertices`, evenly spread, the worst among them.
std::vector<Eigen::Index> representatives(const std::vector<Eigen::Index>& vertices, const std::vector<float>& errors);

/// What `weights` (at least as many rows as there are frames) times `shapes` leaves of the given vertices'
/// trajectories, frames x (3 * count).
Eigen::MatrixXf residualOf(const Fit& fit, const RowMajorMatrixF& weights, const RowMajorMatrixF& shapes,
                           const std::vector<Eigen::Index>& vertices);

}  // namespace mouthpiece
