#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <set>
#include <vector>

#include "base/errors.h"
#include "base/index.h"
#include "exports/shapes/panel_fitter.h"
#include "exports/shapes/principal_shapes.h"
#include "exports/shapes/stepped_frames.h"
#include "exports/shapes/trajectories.h"

namespace mouthpiece {
namespace {

using Eigen::MatrixXf;

constexpr Eigen::Index kMostKept = 1800;  ///< frames of a line that is held as a whole
constexpr Eigen::Index kSampledFrames = 900;
constexpr Eigen::Index kFramesAtOnce = 600;
constexpr Eigen::Index kWeighedVertices = 1000;
/// What the sampled frames are held to: a share of the tolerance.
constexpr double kSampledShare = 0.8;

std::vector<Eigen::Index> evenlySpread(Eigen::Index frame_count, Eigen::Index count) {
  std::vector<Eigen::Index> frames(unsignedIndex(count));
  for (Eigen::Index i = 0; i < count; ++i) frames[unsignedIndex(i)] = i * frame_count / count;
  return frames;
}

/// Zero where a frame has every point of `residual` (frames x (3 * points)) within `tolerance`.
void keepFramesBeyond(float tolerance, MatrixXf& residual) {
  Eigen::VectorXf worst = Eigen::VectorXf::Zero(residual.rows());
  for (Eigen::Index column = 0; column < residual.cols(); column += 3)
    worst = worst.cwiseMax(residual.middleCols<3>(column).rowwise().squaredNorm());
  for (Eigen::Index f = 0; f < residual.rows(); ++f) {
    if (worst(f) <= tolerance * tolerance) residual.row(f).setZero();
  }
}

/// Weights of stretch after stretch of a line on shapes that grow in number.
class LineFitter {
 public:
  /// `shapes`: the first is the offset, which every frame has; displacements from the rest, mesh unit.
  explicit LineFitter(RowMajorMatrixF shapes) : shapes_(std::move(shapes)) { weighSome(); }

  /// Each frame's weights by least squares over some vertices; what is then beyond the tolerance gets shapes.
  void fit(const Fit& stretch) {
    RowMajorMatrixF weights = weightsOf(stretch);
    const float allowed = stretch.tolerance * stretch.tolerance;
    std::vector<float> errors = errorsOfAllVertices(stretch, weights, shapes_);
    const Eigen::Index before = shapes_.rows();
    for (auto beyond = verticesBeyond(errors, allowed); !beyond.empty(); beyond = verticesBeyond(errors, allowed))
      addShapes(stretch, beyond, weights, errors);
    if (shapes_.rows() > before) weighSome();
    weights_.push_back(std::move(weights));
    largest_square_ = std::max(largest_square_, *std::max_element(errors.begin(), errors.end()));
  }

  /// What has been fitted, every weight in [0, 1].
  void finish(PrincipalShapes& result) {
    Eigen::Index frames = 0, used = 1;
    for (const RowMajorMatrixF& weights : weights_) frames += weights.rows();
    result.weights = RowMajorMatrixF::Zero(frames, shapes_.rows());
    frames = 0;
    for (const RowMajorMatrixF& weights : weights_) {
      result.weights.block(frames, 0, weights.rows(), weights.cols()) = weights;
      frames += weights.rows();
    }
    for (Eigen::Index k = 1; k < shapes_.rows(); ++k) {
      auto weights = result.weights.col(k);
      const float low = weights.minCoeff(), range = weights.maxCoeff() - low;
      shapes_.row(0) += low * shapes_.row(k);
      if (!(range > 0)) continue;
      result.weights.col(used) = ((weights.array() - low) / range).cwiseMin(1.0F).cwiseMax(0.0F);
      shapes_.row(used) = range * shapes_.row(k);
      ++used;
    }
    result.weights.conservativeResize(Eigen::NoChange, used);
    shapes_.conservativeResize(used, Eigen::NoChange);
    result.shapes = std::move(shapes_);
  }

  [[nodiscard]] double largestError() const { return std::sqrt(static_cast<double>(largest_square_)); }

 private:
  /// Vertices whose displacements tell the weights: evenly spread ones and what each shape moves farthest.
  void weighSome() {
    const Eigen::Index vertices = shapes_.cols() / 3;
    std::set<Eigen::Index> chosen;
    for (const Eigen::Index v : evenlySpread(vertices, std::min(vertices, kWeighedVertices))) chosen.insert(v);
    for (Eigen::Index k = 1; k < shapes_.rows(); ++k) {
      Eigen::Index farthest = 0;
      Eigen::Map<const Eigen::Matrix3Xf>(shapes_.row(k).data(), 3, vertices)
          .colwise()
          .squaredNorm()
          .maxCoeff(&farthest);
      chosen.insert(farthest);
    }
    weighed_.assign(chosen.begin(), chosen.end());
    MatrixXf own(shapes_.rows(), 3 * signedIndex(weighed_.size()));
    for (std::size_t i = 0; i < weighed_.size(); ++i)
      own.middleCols<3>(3 * signedIndex(i)) = shapes_.middleCols<3>(3 * weighed_[i]);
    weighed_offset_ = own.row(0);
    weighed_shapes_ = own.bottomRows(own.rows() - 1);
    Eigen::MatrixXd products = (weighed_shapes_ * weighed_shapes_.transpose()).cast<double>();
    products.diagonal().array() += 1e-9 * products.trace() + 1e-30;
    solver_.compute(products);
  }

  [[nodiscard]] RowMajorMatrixF weightsOf(const Fit& stretch) const {
    RowMajorMatrixF weights = RowMajorMatrixF::Ones(stretch.frames(), shapes_.rows());
    if (shapes_.rows() == 1) return weights;
    MatrixXf displacements = displacementsOf(stretch, weighed_);
    displacements.rowwise() -= weighed_offset_;
    const Eigen::MatrixXd products = (weighed_shapes_ * displacements.transpose()).cast<double>();
    weights.rightCols(weighed_shapes_.rows()) = solver_.solve(products).transpose().cast<float>();
    return weights;
  }

  /// Shapes that move `beyond` alone, in the frames in which the worst of them are beyond the tolerance.
  void addShapes(const Fit& stretch, const std::vector<Eigen::Index>& beyond, RowMajorMatrixF& weights,
                 std::vector<float>& errors) {
    MatrixXf residual = residualOf(stretch, weights, shapes_, representatives(beyond, errors));
    keepFramesBeyond(stretch.tolerance, residual);
    const MatrixXf basis = trajectoryBasis(residual, kSampleShare * stretch.tolerance);
    const Eigen::Index before = shapes_.rows();
    RowMajorMatrixF added = RowMajorMatrixF::Zero(basis.cols(), shapes_.cols());
    for (std::size_t first = 0; first < beyond.size(); first += kRefinedAtOnce) {
      const std::size_t end = std::min(first + kRefinedAtOnce, beyond.size());
      const std::vector<Eigen::Index> vertices(beyond.begin() + signedIndex(first), beyond.begin() + signedIndex(end));
      residual = residualOf(stretch, weights, shapes_, vertices);
      const MatrixXf shapes = basis.transpose() * residual;
      residual -= basis * shapes;
      for (std::size_t i = 0; i < vertices.size(); ++i) {
        const Eigen::Index column = 3 * signedIndex(i);
        added.middleCols<3>(3 * vertices[i]) = shapes.middleCols<3>(column);
        errors[unsignedIndex(vertices[i])] = residual.middleCols<3>(column).rowwise().squaredNorm().maxCoeff();
      }
    }
    shapes_.conservativeResize(before + basis.cols(), Eigen::NoChange);
    shapes_.bottomRows(basis.cols()) = added;
    weights.conservativeResize(Eigen::NoChange, before + basis.cols());
    weights.rightCols(basis.cols()) = basis;
  }

  RowMajorMatrixF shapes_;
  std::vector<RowMajorMatrixF> weights_;  ///< of each stretch; of the shapes that came later it has nothing
  std::vector<Eigen::Index> weighed_;     ///< vertices
  MatrixXf weighed_shapes_;               ///< of them, without the offset
  Eigen::RowVectorXf weighed_offset_;
  Eigen::LLT<Eigen::MatrixXd> solver_;  ///< of weighed_shapes_' products with each other
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
  const Eigen::RowVectorXf moving_rest = movingRest(result, rest);
  if (result.shapes.rows() == 0) result.shapes = RowMajorMatrixF::Zero(1, frames.width);
  const double mm_per_unit = 1000 * metres_per_unit;
  LineFitter fitter(std::move(result.shapes));
  double off_mm = 0;
  for (Eigen::Index first = 0; first < frames.frame_count; first += kFramesAtOnce) {
    std::vector<Eigen::Index> stretch(unsignedIndex(std::min(kFramesAtOnce, frames.frame_count - first)));
    std::iota(stretch.begin(), stretch.end(), first);
    const HeldFrames held_stretch(frames, stretch, moving_rest, mm_per_unit, options.tolerance_mm);
    off_mm = std::max(off_mm, held_stretch.off_mm);
    fitter.fit(held_stretch.fit());
  }
  fitter.finish(result);
  result.max_error_mm = fitter.largestError() * mm_per_unit + off_mm;
  return result;
}

}  // namespace mouthpiece
