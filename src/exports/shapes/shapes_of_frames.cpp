#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "base/errors.h"
#include "base/index.h"
#include "exports/shapes/principal_shapes.h"
#include "exports/shapes/stepped_frames.h"

namespace mouthpiece {
namespace {

constexpr Eigen::Index kMostKept = 1800;  ///< frames of a line that is held as a whole
constexpr Eigen::Index kSampledFrames = 900;
constexpr Eigen::Index kFramesAtOnce = 64;
/// What the sampled frames are held to, and what a shape of its own leaves away: shares of the tolerance.
constexpr double kSampledShare = 0.8;
constexpr float kLeftShare = 0.1F;

std::vector<Eigen::Index> evenlySpread(Eigen::Index frame_count, Eigen::Index count) {
  std::vector<Eigen::Index> frames(unsignedIndex(count));
  for (Eigen::Index i = 0; i < count; ++i) frames[unsignedIndex(i)] = i * frame_count / count;
  return frames;
}

float worstSquare(const Eigen::RowVectorXf& displacements) {
  return Eigen::Map<const Eigen::Matrix3Xf>(displacements.data(), 3, displacements.size() / 3)
      .colwise()
      .squaredNorm()
      .maxCoeff();
}

/// Weights of frame after frame on shapes that grow in number.
class FrameFitter {
 public:
  /// `offset`: what every frame has; `shapes`: what it has its share of; displacements from the rest, mesh unit.
  FrameFitter(Eigen::RowVectorXf offset, RowMajorMatrixF shapes, float tolerance)
      : offset_(std::move(offset)), shapes_(std::move(shapes)), tolerance_(tolerance) {
    factorise();
  }

  /// `displacements`: frames x (3 * vertices).
  void fit(RowMajorMatrixF displacements) {
    displacements.rowwise() -= offset_;
    std::vector<bool> has_own(unsignedIndex(displacements.rows()), false);
    while (true) {
      const RowMajorMatrixF weights = weightsOf(displacements);
      RowMajorMatrixF left = displacements;
      left.noalias() -= weights * shapes_;
      Eigen::Index worst = 0;
      float worst_square = -1;
      for (Eigen::Index f = 0; f < left.rows(); ++f) {
        const float square = worstSquare(left.row(f));
        MOUTHPIECE_EXPECT(std::isfinite(square));
        if (square > worst_square) std::tie(worst, worst_square) = std::pair(f, square);
      }
      if (worst_square <= tolerance_ * tolerance_) {
        largest_square_ = std::max(largest_square_, worst_square);
        for (Eigen::Index f = 0; f < weights.rows(); ++f)
          weights_.emplace_back(weights.row(f).data(), weights.row(f).data() + weights.cols());
        return;
      }
      addShape(left.row(worst), has_own[unsignedIndex(worst)] ? 0 : kLeftShare * tolerance_);
      has_own[unsignedIndex(worst)] = true;
    }
  }

  /// What has been fitted, every weight in [0, 1].
  void finish(PrincipalShapes& result) {
    std::vector<Eigen::Index> used;
    RowMajorMatrixF weights = RowMajorMatrixF::Zero(signedIndex(weights_.size()), shapes_.rows());
    for (std::size_t f = 0; f < weights_.size(); ++f)
      std::copy(weights_[f].begin(), weights_[f].end(), weights.row(signedIndex(f)).data());
    for (Eigen::Index k = 0; k < shapes_.rows(); ++k) {
      const float low = weights.col(k).minCoeff(), range = weights.col(k).maxCoeff() - low;
      offset_ += low * shapes_.row(k);
      if (!(range > 0)) continue;
      weights.col(k) = ((weights.col(k).array() - low) / range).cwiseMin(1.0F).cwiseMax(0.0F);
      shapes_.row(k) *= range;
      used.push_back(k);
    }
    const Eigen::Index count = signedIndex(used.size());
    result.shapes.resize(1 + count, shapes_.cols());
    result.weights.resize(weights.rows(), 1 + count);
    result.shapes.row(0) = offset_;
    result.weights.col(0).setOnes();
    for (Eigen::Index i = 0; i < count; ++i) {
      result.shapes.row(1 + i) = shapes_.row(used[unsignedIndex(i)]);
      result.weights.col(1 + i) = weights.col(used[unsignedIndex(i)]);
    }
  }

  [[nodiscard]] double largestError() const { return std::sqrt(static_cast<double>(largest_square_)); }

 private:
  void factorise() {
    Eigen::MatrixXd products = (shapes_ * shapes_.transpose()).cast<double>();
    products.diagonal().array() += 1e-9 * products.trace() + 1e-30;
    solver_.compute(products);
  }

  [[nodiscard]] RowMajorMatrixF weightsOf(const RowMajorMatrixF& displacements) const {
    if (shapes_.rows() == 0) return RowMajorMatrixF(displacements.rows(), 0);
    const Eigen::MatrixXd products = (shapes_ * displacements.transpose()).cast<double>();
    return solver_.solve(products).transpose().cast<float>();
  }

  void addShape(Eigen::RowVectorXf shape, float left) {
    for (Eigen::Index v = 0; v < shape.size(); v += 3) {
      if (shape.segment<3>(v).squaredNorm() < left * left) shape.segment<3>(v).setZero();
    }
    shapes_.conservativeResize(shapes_.rows() + 1, shape.size());
    shapes_.bottomRows<1>() = shape;
    factorise();
  }

  Eigen::RowVectorXf offset_;
  RowMajorMatrixF shapes_;
  float tolerance_;
  Eigen::LLT<Eigen::MatrixXd> solver_;       ///< of the shapes' products with each other
  std::vector<std::vector<float>> weights_;  ///< of each frame; of the shapes that came later it has nothing
  float largest_square_ = 0;
};

}  // namespace

PrincipalShapes principalShapes(const FrameMaker& frames, const VertexPositions& rest, double metres_per_unit,
                                const PrincipalShapesOptions& options) {
  const bool is_whole = frames.frame_count <= kMostKept;
  const std::vector<Eigen::Index> held =
      evenlySpread(frames.frame_count, is_whole ? frames.frame_count : kSampledFrames);
  if (is_whole) return principalShapesOf(frames, held, rest, metres_per_unit, options);
  PrincipalShapes result =
      principalShapesOf(frames, held, rest, metres_per_unit, {kSampledShare * options.tolerance_mm});
  Eigen::RowVectorXf moving_rest(frames.width);
  Eigen::Index column = 0;
  for (const std::uint32_t vertex : result.columnVertices()) {
    moving_rest.segment<3>(column) = rest.row(vertex);
    column += 3;
  }
  Eigen::RowVectorXf offset = Eigen::RowVectorXf::Zero(frames.width);
  if (result.shapes.rows() > 0) offset = result.shapes.row(0);
  const double mm_per_unit = 1000 * metres_per_unit;
  FrameFitter fitter(std::move(offset), result.shapes.bottomRows(std::max<Eigen::Index>(0, result.shapes.rows() - 1)),
                     asFloat(options.tolerance_mm / mm_per_unit));
  std::vector<Eigen::Index> block;
  for (Eigen::Index first = 0; first < frames.frame_count; first += kFramesAtOnce) {
    block.resize(unsignedIndex(std::min(kFramesAtOnce, frames.frame_count - first)));
    std::iota(block.begin(), block.end(), first);
    RowMajorMatrixF displacements = frames.frames(block).positions;
    displacements.rowwise() -= moving_rest;
    fitter.fit(std::move(displacements));
  }
  fitter.finish(result);
  result.max_error_mm = fitter.largestError() * mm_per_unit;
  return result;
}

}  // namespace mouthpiece
