#include "exports/shapes/principal_shapes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <numeric>
#include <vector>

#include "base/errors.h"
#include "base/index.h"
#include "exports/shapes/stepped_frames.h"
#include "exports/shapes/trajectories.h"

namespace mouthpiece {
namespace {

using Eigen::MatrixXf;

// Shares of the tolerance. Measured on the default face: with the sample at 0.7 under one vertex in 200 is left for the
// second round.
constexpr float kStillShare = 0.1F;    ///< a vertex that never moves further rests
constexpr float kSampleShare = 0.85F;  ///< what the sampled vertices are fitted to
/// A shape that never moves a vertex further than this leaves it alone; tried in turn until the vertex is within the
/// tolerance. The first makes the file a fifth smaller, 0 keeps everything.
constexpr std::array<float, 3> kNegligibleShares{0.5F, 0.15F, 0.0F};
/// Tried before all shapes are, and what they must come within: below the tolerance, so that a face is not everywhere
/// as far off as it may be.
constexpr std::array<Eigen::Index, 6> kFewShapes{8, 16, 32, 48, 64, 96};
constexpr float kFewShare = 0.8F;
constexpr Eigen::Index kSampledVertices = 500;
constexpr std::size_t kRefinedAtOnce = 400;

Eigen::Index paddedRows(Eigen::Index rows) { return (rows + kPanelRowBlock - 1) / kPanelRowBlock * kPanelRowBlock; }

/// What is to be fitted: frames as they are, or as steps.
struct Fit {
  const FaceAnimation* animation;
  const SteppedFrames* stepped;
  const Eigen::RowVectorXf& rest;
  float tolerance;  ///< mesh unit

  [[nodiscard]] Eigen::Index frames() const {
    return stepped != nullptr ? stepped->frameCount() : animation->positions.rows();
  }
  [[nodiscard]] Eigen::Index vertices() const { return rest.cols() / 3; }
};

/// Displacements of the given vertices, frames x (3 * count).
MatrixXf displacementsOf(const Fit& fit, const std::vector<Eigen::Index>& vertices) {
  MatrixXf displacements(fit.frames(), 3 * signedIndex(vertices.size()));
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      const Eigen::Index column = 3 * vertices[i] + axis;
      auto own = displacements.col(3 * signedIndex(i) + axis);
      if (fit.stepped != nullptr) {
        for (Eigen::Index f = 0; f < fit.frames(); ++f) own(f) = fit.stepped->at(f, column);
      } else {
        own = fit.animation->positions.col(column).array() - fit.rest(column);
      }
    }
  }
  return displacements;
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

/// Orthonormal trajectories b_k turned into weights in [0, 1] and the rows that take displacements D to shapes:
/// D = sum_k b_k (b_k^T D) = sum_k w_k s_k + offset with w_k = (b_k - low_k) / range_k, s_k = range_k b_k^T D and
/// offset = sum_k (low_k / range_k) s_k.
struct Weights {
  RowMajorMatrixF weights;           ///< padded frames x (1 + count); the first column, the offset's, is 1
  RowMajorMatrixF inverse;           ///< padded count x padded frames: s = inverse * D
  std::vector<float> offset_shares;  ///< low_k / range_k
  Eigen::Index count = 0;            ///< without the offset
};

Weights weightsFromBasis(const MatrixXf& basis) {
  Weights result;
  result.count = basis.cols();
  const Eigen::Index frames = paddedRows(basis.rows());
  result.weights = RowMajorMatrixF::Zero(frames, 1 + basis.cols());
  result.weights.col(0).head(basis.rows()).setOnes();
  result.inverse = RowMajorMatrixF::Zero(paddedRows(basis.cols()), frames);
  for (Eigen::Index k = 0; k < basis.cols(); ++k) {
    Eigen::Index strongest = 0;
    basis.col(k).cwiseAbs().maxCoeff(&strongest);
    const Eigen::VectorXf column = (basis(strongest, k) < 0 ? -1.0F : 1.0F) * basis.col(k);
    const float high = column.maxCoeff();
    const bool is_constant = high - column.minCoeff() < 1e-5F * high;
    const float low = is_constant ? 0.0F : column.minCoeff();
    result.weights.col(k + 1).head(basis.rows()) =
        ((column.array() - low) / (high - low)).cwiseMin(1.0F).cwiseMax(0.0F);
    result.inverse.row(k).head(basis.rows()) = (high - low) * column.transpose();
    result.offset_shares.push_back(low / (high - low));
  }
  return result;
}

/// Fits shapes to panels of eight vertices and measures what is left.
class PanelFitter {
 public:
  PanelFitter(const Fit& fit, const Weights& weights)
      : fit_(fit),
        weights_(weights),
        displacements_(RowMajorMatrixF::Zero(weights.weights.rows(), kPanelWidth)),
        shapes_(weights.inverse.rows(), kPanelWidth),
        thinned_(1 + weights.count, kPanelWidth) {}

  /// Shapes of vertices [first, first + 8) into columns of `shapes`, which hold zeros; the largest squared residuals
  /// into `errors`.
  void fit(Eigen::Index first, RowMajorMatrixF& shapes, float* errors) {
    const Eigen::Index count = std::min<Eigen::Index>(kPanelVertices, fit_.vertices() - first);
    loadPanel(first, count, errors);
    const float still = kStillShare * fit_.tolerance;
    if (std::all_of(errors, errors + count, [&](float square) { return square <= still * still; })) return;
    projected_ = 0;
    if (!fitFew(count, errors)) fitAll(count, errors);
    storePanel(first, count, shapes);
  }

 private:
  /// By the strongest shapes alone, which is enough for most of a face; whether it is.
  bool fitFew(Eigen::Index count, float* errors) {
    for (const Eigen::Index few : kFewShapes) {
      if (few >= weights_.count) break;
      projectOn(few);
      dropBelow(kNegligibleShares.front() * fit_.tolerance, few);
      if (measure(count, kFewShare * fit_.tolerance, false, errors)) return true;
    }
    return false;
  }

  void fitAll(Eigen::Index count, float* errors) {
    projectOn(weights_.count);
    for (const float share : kNegligibleShares) {
      dropBelow(share * fit_.tolerance, weights_.count);
      if (measure(count, fit_.tolerance, share == kNegligibleShares.back(), errors)) break;
    }
  }

  /// Rows [0, up_to) of shapes_.
  void projectOn(Eigen::Index up_to) {
    const Eigen::Index end = paddedRows(up_to);
    kernels_.multiply(weights_.inverse.row(projected_).data(), end - projected_, weights_.inverse.cols(),
                      displacements_.data(), shapes_.row(projected_).data());
    projected_ = end;
  }

  /// Largest squared residuals of thinned_ into `errors`; whether all are within `tolerance`. Unless `to_the_end`, no
  /// frame is looked at behind some that are not.
  bool measure(Eigen::Index count, float tolerance, bool to_the_end, float* errors) const {
    constexpr Eigen::Index kFramesAtOnce = 8 * kPanelRowBlock;
    const Eigen::Index frames = weights_.weights.rows(), stride = weights_.weights.cols();
    std::fill_n(errors, kPanelVertices, 0.0F);
    bool fits = true;
    for (Eigen::Index f = 0; f < frames && (fits || to_the_end); f += kFramesAtOnce) {
      std::array<float, kPanelVertices> squares;
      kernels_.largest_residual(weights_.weights.row(f).data(), stride, std::min(kFramesAtOnce, frames - f),
                                kept_.data(), std::ssize(kept_), displacements_.row(f).data(), thinned_.data(),
                                squares.data());
      for (std::size_t v = 0; v < squares.size(); ++v) errors[v] = std::max(errors[v], squares[v]);
      fits = std::all_of(errors, errors + count, [&](float square) { return square <= tolerance * tolerance; });
    }
    return fits;
  }

  void loadPanel(Eigen::Index first, Eigen::Index count, float* errors) {
    if (fit_.stepped != nullptr) {
      fit_.stepped->panel(first, displacements_.data(), errors);
      return;
    }
    const auto& positions = fit_.animation->positions;
    if (count == kPanelVertices) {
      kernels_.load_displacements(positions.data() + 3 * first, positions.cols(), fit_.frames(),
                                  fit_.rest.data() + 3 * first, displacements_.data(), errors);
      return;
    }
    RowMajorMatrixF padded = RowMajorMatrixF::Zero(fit_.frames(), kPanelWidth);
    Eigen::RowVectorXf rest = Eigen::RowVectorXf::Zero(kPanelWidth);
    padded.leftCols(3 * count) = positions.middleCols(3 * first, 3 * count);
    rest.head(3 * count) = fit_.rest.segment(3 * first, 3 * count);
    kernels_.load_displacements(padded.data(), kPanelWidth, fit_.frames(), rest.data(), displacements_.data(), errors);
  }

  /// thinned_: the offset, then of the first `count` shapes what is no shorter than `limit`; kept_: which rows of all
  /// these are.
  void dropBelow(float limit, Eigen::Index count) {
    Panel offset = Panel::Zero();
    kept_.assign(1, 0);
    for (Eigen::Index k = 0; k < count; ++k) {
      const float* from = shapes_.row(k).data();
      float* to = thinned_.row(std::ssize(kept_)).data();
      float any = 0;
      for (Eigen::Index v = 0; v < kPanelVertices; ++v) {
        const float x = from[v];
        const float y = from[v + kPanelVertices];
        const float z = from[v + 2 * kPanelVertices];
        const float kept = x * x + y * y + z * z < limit * limit ? 0.0F : 1.0F;
        any = std::max(any, kept);
        to[v] = kept * x;
        to[v + kPanelVertices] = kept * y;
        to[v + 2 * kPanelVertices] = kept * z;
      }
      if (any == 0) continue;
      offset += weights_.offset_shares[unsignedIndex(k)] * Eigen::Map<const Panel>(to);
      kept_.push_back(static_cast<std::int32_t>(1 + k));
    }
    thinned_.row(0) = offset.transpose();
  }

  void storePanel(Eigen::Index first, Eigen::Index count, RowMajorMatrixF& shapes) const {
    for (std::size_t i = 0; i < kept_.size(); ++i) {
      const float* from = thinned_.row(signedIndex(i)).data();
      float* to = shapes.row(kept_[i]).data() + 3 * first;
      for (Eigen::Index v = 0; v < count; ++v) {
        to[3 * v] = from[v];
        to[3 * v + 1] = from[v + kPanelVertices];
        to[3 * v + 2] = from[v + 2 * kPanelVertices];
      }
    }
  }

  using Panel = Eigen::Array<float, kPanelWidth, 1>;

  const Fit& fit_;
  const Weights& weights_;
  const PanelKernels& kernels_ = panelKernels();
  RowMajorMatrixF displacements_;   ///< padded frames x kPanelWidth
  RowMajorMatrixF shapes_;          ///< padded shapes x kPanelWidth
  Eigen::Index projected_ = 0;      ///< rows of shapes_ that are known
  RowMajorMatrixF thinned_;         ///< the offset, then what is kept of them
  std::vector<std::int32_t> kept_;  ///< which columns of the weights they belong to
};

/// Squared errors of all vertices (rounded up to whole panels) after the first fit of everything.
std::vector<float> fitAllVertices(const Fit& fit, const Weights& weights, RowMajorMatrixF& shapes) {
  std::vector<float> errors(unsignedIndex(fit.vertices() + kPanelVertices));
  PanelFitter fitter(fit, weights);
  for (Eigen::Index first = 0; first < fit.vertices(); first += kPanelVertices) {
    fitter.fit(first, shapes, errors.data() + first);
  }
  errors.resize(unsignedIndex(fit.vertices()));
  return errors;
}

std::vector<Eigen::Index> verticesBeyond(const std::vector<float>& errors, float allowed) {
  std::vector<Eigen::Index> beyond;
  for (std::size_t v = 0; v < errors.size(); ++v) {
    if (!(errors[v] <= allowed)) beyond.push_back(signedIndex(v));
  }
  return beyond;
}

/// At most kRefinedAtOnce of `vertices`, evenly spread, the worst among them.
std::vector<Eigen::Index> representatives(const std::vector<Eigen::Index>& vertices, const std::vector<float>& errors) {
  const std::size_t stride = vertices.size() / kRefinedAtOnce + 1;
  std::vector<Eigen::Index> chosen;
  for (std::size_t first = 0; first < vertices.size(); first += stride) {
    const auto end = vertices.begin() + signedIndex(std::min(first + stride, vertices.size()));
    chosen.push_back(*std::max_element(vertices.begin() + signedIndex(first), end, [&](Eigen::Index a, Eigen::Index b) {
      return errors[unsignedIndex(a)] < errors[unsignedIndex(b)];
    }));
  }
  return chosen;
}

/// What the shapes so far leave of the given vertices' trajectories, frames x (3 * count).
MatrixXf residualOf(const Fit& fit, const PrincipalShapes& result, const std::vector<Eigen::Index>& vertices) {
  MatrixXf residual = displacementsOf(fit, vertices);
  MatrixXf own_shapes(result.shapes.rows(), residual.cols());
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    own_shapes.middleCols<3>(3 * signedIndex(i)) = result.shapes.middleCols<3>(3 * vertices[i]);
  }
  residual -= result.weights.topRows(fit.frames()) * own_shapes;
  return residual;
}

/// Adds shapes that move only `beyond`, from what is left of those vertices' own trajectories; their offset joins the
/// first shape.
void refine(const Fit& fit, const std::vector<Eigen::Index>& beyond, PrincipalShapes& result,
            std::vector<float>& errors) {
  const Weights added = weightsFromBasis(
      trajectoryBasis(residualOf(fit, result, representatives(beyond, errors)), kSampleShare * fit.tolerance));
  const Eigen::Map<const Eigen::RowVectorXf> offset_shares(added.offset_shares.data(), added.count);
  const auto weights = added.weights.topRows(fit.frames());
  const Eigen::Index before = result.shapes.rows();
  RowMajorMatrixF added_shapes = RowMajorMatrixF::Zero(added.count, result.shapes.cols());
  for (std::size_t first = 0; first < beyond.size(); first += kRefinedAtOnce) {
    const std::size_t end = std::min(first + kRefinedAtOnce, beyond.size());
    const std::vector<Eigen::Index> vertices(beyond.begin() + signedIndex(first), beyond.begin() + signedIndex(end));
    MatrixXf residual = residualOf(fit, result, vertices);
    const MatrixXf shapes = added.inverse.topLeftCorner(added.count, fit.frames()) * residual;
    const Eigen::RowVectorXf offset = offset_shares * shapes;
    residual -= weights.rightCols(added.count) * shapes;
    residual.rowwise() -= offset;
    for (std::size_t i = 0; i < vertices.size(); ++i) {
      const Eigen::Index column = 3 * signedIndex(i);
      added_shapes.middleCols<3>(3 * vertices[i]) = shapes.middleCols<3>(column);
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

/// Where the vertices that the columns of `shapes` move are at rest.
Eigen::RowVectorXf movingRest(const PrincipalShapes& shapes, const VertexPositions& rest) {
  const std::vector<std::uint32_t> vertices = shapes.columnVertices();
  Eigen::RowVectorXf moving_rest(3 * signedIndex(vertices.size()));
  for (std::size_t i = 0; i < vertices.size(); ++i)
    moving_rest.segment<3>(3 * signedIndex(i)) = rest.row(signedIndex(std::size_t{vertices[i]}));
  return moving_rest;
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
  Weights weights = weightsFromBasis(trajectoryBasis(sample, kSampleShare * fit.tolerance));
  result.shapes.resize(1 + weights.count, fit.rest.cols());
  result.shapes.setZero();
  std::vector<float> errors = fitAllVertices(fit, weights, result.shapes);
  result.weights = std::move(weights.weights);
  MOUTHPIECE_EXPECT(result.shapes.allFinite());

  const float allowed = fit.tolerance * fit.tolerance;
  for (auto beyond = verticesBeyond(errors, allowed); !beyond.empty(); beyond = verticesBeyond(errors, allowed)) {
    refine(fit, beyond, result, errors);
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
  // Of the tolerance: 0.7 micrometres of the usual one. A vertex that goes farther than 256 tolerances, 23 mm, is held
  // as it is.
  constexpr double kStep = 1.0 / 128;
  constexpr double kFarthestOff = 0.8661;  // half the diagonal of a cube
  MOUTHPIECE_EXPECT(metres_per_unit > 0 && options.tolerance_mm > 0);
  PrincipalShapes result = shapesAtRest(frames.frame_rate_hz, frames.vertices, rest);
  const double mm_per_unit = 1000 * metres_per_unit, step_mm = kStep * options.tolerance_mm;
  const Eigen::RowVectorXf moving_rest = movingRest(result, rest);
  MOUTHPIECE_EXPECT(moving_rest.size() == frames.width);
  const auto stepped = SteppedFrames::of(frames, which, moving_rest, asFloat(step_mm / mm_per_unit));
  if (!stepped) return principalShapes(frames.frames(which), rest, metres_per_unit, options);
  const double off_mm = kFarthestOff * step_mm;
  fitShapes({nullptr, &*stepped, moving_rest, asFloat((options.tolerance_mm - off_mm) / mm_per_unit)}, result);
  if (result.shapeCount() > 0) result.max_error_mm = result.max_error_mm * mm_per_unit + off_mm;
  return result;
}

}  // namespace mouthpiece
