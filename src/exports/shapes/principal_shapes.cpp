#include "exports/shapes/principal_shapes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <numeric>
#include <vector>

#include "base/errors.h"
#include "base/index.h"
#include "exports/shapes/panel_fitter.h"
#include "exports/shapes/stepped_frames.h"
#include "exports/shapes/trajectories.h"

namespace mouthpiece {
namespace {

using Eigen::MatrixXf;

constexpr Eigen::Index kSampledVertices = 250;
/// Frames that tell the shapes: as many of a line and as many a second at least.
constexpr double kFewestTelling = 200, kFewestTellingHz = 20;

/// One of how many evenly spread frames, `rate_hz` of them a second, tells the shapes.
std::size_t thinningOf(std::size_t frames, double rate_hz) {
  return static_cast<std::size_t>(std::max(1.0, std::min(asReal(frames) / kFewestTelling, rate_hz / kFewestTellingHz)));
}

/// Places of all frames, those that tell the shapes first.
std::vector<std::size_t> tellingFirst(std::size_t frames, std::size_t thinning) {
  std::vector<std::size_t> order(frames);
  std::iota(order.begin(), order.end(), 0U);
  std::stable_partition(order.begin(), order.end(), [=](std::size_t frame) { return frame % thinning == 0; });
  return order;
}

/// Displacements of evenly spread vertices that move, frames x (3 * count).
MatrixXf sampledDisplacements(const Fit& fit) {
  const Eigen::Index stride = std::max<Eigen::Index>(1, fit.vertices() / kSampledVertices);
  std::vector<Eigen::Index> vertices;
  for (Eigen::Index v = 0; v < fit.vertices(); v += stride) vertices.push_back(v);
  MatrixXf displacements = displacementsOf(fit, vertices);
  Eigen::Index kept = 0;
  for (Eigen::Index i = 0; i < signedIndex(vertices.size()); ++i) {
    const auto own = displacements.middleCols<3>(3 * i);
    if (own.rowwise().squaredNorm().maxCoeff() <= fit.tolerance * fit.tolerance) continue;
    if (kept != i) displacements.middleCols<3>(3 * kept) = own;
    ++kept;
  }
  displacements.conservativeResize(Eigen::NoChange, 3 * kept);
  return displacements;
}

/// Weights of the fewest shapes that hold `trajectories` (fit.frames() x channels) in the first `telling` frames.
Weights weightsOf(const Fit& fit, const MatrixXf& trajectories, Eigen::Index telling) {
  const MatrixXf basis = trajectoryBasis(trajectories.topRows(telling), kSampleShare * fit.tolerance);
  return weightsFromBasis(basisInAllFrames(basis, trajectories), telling);
}

/// Adds shapes that move only `beyond`, from what is left of those vertices' own trajectories in the first `telling`
/// frames; their offset joins the first shape.
void refine(const Fit& fit, const std::vector<Eigen::Index>& beyond, Eigen::Index telling, PrincipalShapes& result,
            std::vector<float>& errors) {
  const Weights added =
      weightsOf(fit, residualOf(fit, result.weights, result.shapes, representatives(beyond, errors)), telling);
  const Eigen::Map<const Eigen::RowVectorXf> offset_shares(added.offset_shares.data(), added.count);
  const auto weights = added.weights.topRows(fit.frames());
  const Eigen::Index before = result.shapes.rows();
  RowMajorMatrixF added_shapes = RowMajorMatrixF::Zero(added.count, result.shapes.cols());
  for (std::size_t first = 0; first < beyond.size(); first += kRefinedAtOnce) {
    const std::size_t end = std::min(first + kRefinedAtOnce, beyond.size());
    const std::vector<Eigen::Index> vertices(beyond.begin() + signedIndex(first), beyond.begin() + signedIndex(end));
    MatrixXf residual = residualOf(fit, result.weights, result.shapes, vertices);
    const MatrixXf shapes = added.inverse.topLeftCorner(added.count, telling) * residual.topRows(telling);
    const Eigen::RowVectorXf offset = offset_shares * shapes;
    residual -= weights.rightCols(added.count) * shapes;
    residual.rowwise() -= offset;
    for (std::size_t i = 0; i < vertices.size(); ++i) {
      const Eigen::Index column = 3 * signedIndex(i);
      if (added.count > 0) added_shapes.middleCols<3>(3 * vertices[i]) = shapes.middleCols<3>(column);
      result.shapes.block<1, 3>(0, 3 * vertices[i]) += offset.segment<3>(column);
      errors[unsignedIndex(vertices[i])] = residual.middleCols<3>(column).rowwise().squaredNorm().maxCoeff();
    }
  }
  result.shapes.conservativeResize(before + added.count, Eigen::NoChange);
  result.shapes.bottomRows(added.count) = added_shapes;
  result.weights.conservativeResize(Eigen::NoChange, before + added.count);
  result.weights.rightCols(added.count) = added.weights.rightCols(added.count);
}

PrincipalShapes shapesAtRest(double frame_rate_hz, const std::vector<std::uint32_t>& vertices,
                             const VertexPositions& rest) {
  MOUTHPIECE_EXPECT(vertices.empty() || signedIndex(vertices.back()) < rest.rows());
  PrincipalShapes result;
  result.frame_rate_hz = frame_rate_hz;
  result.rest = Eigen::Map<const Eigen::RowVectorXf>(rest.data(), rest.size());
  result.vertices = vertices;
  return result;
}

/// A face that never moves needs no shape, not even the first.
void dropShapesOfAStillFace(PrincipalShapes& result) {
  if (result.shapes.rows() != 1) return;
  result.shapes.resize(0, Eigen::NoChange);
  result.weights.resize(Eigen::NoChange, 0);
}

/// The shapes and weights of `fit`, and as max_error_mm the largest error in the mesh's unit.
void fitShapes(const Fit& fit, PrincipalShapes& result) {
  const MatrixXf sample = sampledDisplacements(fit);
  MOUTHPIECE_EXPECT(sample.allFinite());
  Weights weights = weightsOf(fit, sample, fit.tellingFrames());
  result.shapes.resize(1 + weights.count, fit.rest.cols());
  result.shapes.setZero();
  std::vector<float> errors = fitAllVertices(fit, weights, result.shapes);
  result.weights = std::move(weights.weights);
  MOUTHPIECE_EXPECT(result.shapes.allFinite());

  const float allowed = fit.tolerance * fit.tolerance;
  Eigen::Index telling = fit.tellingFrames();
  for (auto beyond = verticesBeyond(errors, allowed); !beyond.empty(); beyond = verticesBeyond(errors, allowed)) {
    refine(fit, beyond, telling, result, errors);
    telling = fit.frames();  // what is left in the others is told by themselves
  }
  result.weights.conservativeResize(fit.frames(), Eigen::NoChange);
  dropShapesOfAStillFace(result);
  const float largest = errors.empty() ? 0.0F : *std::max_element(errors.begin(), errors.end());
  result.max_error_mm = std::sqrt(static_cast<double>(largest));
}

}  // namespace

std::vector<std::uint32_t> PrincipalShapes::columnVertices() const {
  if (!vertices.empty()) return vertices;
  std::vector<std::uint32_t> all(unsignedIndex(rest.cols() / 3));
  std::iota(all.begin(), all.end(), 0U);
  return all;
}

PrincipalShapes principalShapes(const FaceAnimation& animation, const VertexPositions& rest, double metres_per_unit,
                                const PrincipalShapesOptions& options) {
  MOUTHPIECE_EXPECT(animation.positions.cols() ==
                    3 * (animation.vertices.empty() ? rest.rows() : signedIndex(animation.vertices.size())));
  MOUTHPIECE_EXPECT(metres_per_unit > 0 && options.tolerance_mm > 0);
  PrincipalShapes result = shapesAtRest(animation.frame_rate_hz, animation.vertices, rest);
  const double mm_per_unit = 1000 * metres_per_unit;
  const Eigen::RowVectorXf moving_rest = movingRest(result, rest);
  fitShapes({&animation, nullptr, moving_rest, asFloat(options.tolerance_mm / mm_per_unit)}, result);
  result.max_error_mm *= mm_per_unit;
  return result;
}

PrincipalShapes principalShapesOf(const FrameMaker& frames, std::span<const Eigen::Index> which,
                                  const VertexPositions& rest, double metres_per_unit,
                                  const PrincipalShapesOptions& options) {
  MOUTHPIECE_EXPECT(metres_per_unit > 0 && options.tolerance_mm > 0);
  PrincipalShapes result = shapesAtRest(frames.frame_rate_hz, frames.vertices, rest);
  const Eigen::RowVectorXf moving_rest = movingRest(result, rest);
  MOUTHPIECE_EXPECT(moving_rest.size() == frames.width);
  const double mm_per_unit = 1000 * metres_per_unit;
  const double rate_hz = frames.frame_rate_hz * asReal(which.size()) / std::max(1.0, asReal(frames.frame_count));
  const std::size_t thinning = thinningOf(which.size(), rate_hz);
  const std::vector<std::size_t> order = tellingFirst(which.size(), thinning);
  std::vector<Eigen::Index> ordered;
  for (const std::size_t place : order) ordered.push_back(which[place]);
  const HeldFrames held(frames, ordered, moving_rest, mm_per_unit, options.tolerance_mm);
  fitShapes(held.fit(signedIndex((which.size() + thinning - 1) / thinning)), result);
  RowMajorMatrixF weights(result.weights.rows(), result.weights.cols());
  for (std::size_t i = 0; i < order.size(); ++i)
    weights.row(signedIndex(order[i])) = result.weights.row(signedIndex(i));
  result.weights = std::move(weights);
  if (result.shapeCount() > 0) result.max_error_mm = result.max_error_mm * mm_per_unit + held.off_mm;
  return result;
}

}  // namespace mouthpiece
