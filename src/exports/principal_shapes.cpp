#include "exports/principal_shapes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <numeric>
#include <vector>

#include "base/errors.h"
#include "exports/trajectory_basis.h"
#include "exports/trajectory_panel.h"

namespace mouthpiece {
namespace {

using Eigen::Index;
using Eigen::MatrixXf;

// Shares of the tolerance. Measured on the default face: with the sample at 0.7 under one vertex in 200 is left for the
// second round.
constexpr float kStillShare = 0.1F;      ///< a vertex that never moves further rests
constexpr float kSampleShare = 0.85F;     ///< what the sampled vertices are fitted to
/// A shape that never moves a vertex further than this leaves it alone; tried in turn until the vertex is within the
/// tolerance. The first makes the file a fifth smaller, 0 keeps everything.
constexpr std::array<float, 3> kNegligibleShares{0.3F, 0.1F, 0.0F};
constexpr Index kSampledVertices = 500;
constexpr std::size_t kRefinedAtOnce = 400;

Index paddedRows(Index rows) { return (rows + kPanelRowBlock - 1) / kPanelRowBlock * kPanelRowBlock; }

struct Fit {
  const FaceAnimation& animation;
  const Eigen::RowVectorXf& rest;
  float tolerance;  ///< mesh unit

  [[nodiscard]] Index frames() const { return animation.positions.rows(); }
  [[nodiscard]] Index vertices() const { return rest.cols() / 3; }
};

/// Displacements of the given vertices, frames x (3 * count).
MatrixXf displacementsOf(const Fit& fit, const std::vector<Index>& vertices) {
  MatrixXf displacements(fit.frames(), 3 * static_cast<Index>(vertices.size()));
  for (Index f = 0; f < fit.frames(); ++f) {
    const float* row = fit.animation.positions.row(f).data();
    for (std::size_t i = 0; i < vertices.size(); ++i) {
      for (Index axis = 0; axis < 3; ++axis) {
        const Index column = 3 * vertices[i] + axis;
        displacements(f, 3 * static_cast<Index>(i) + axis) = row[column] - fit.rest(column);
      }
    }
  }
  return displacements;
}

/// Displacements of evenly spread vertices that move, frames x (3 * count).
MatrixXf sampledDisplacements(const Fit& fit) {
  const Index stride = std::max<Index>(1, fit.vertices() / kSampledVertices);
  std::vector<Index> vertices;
  for (Index v = 0; v < fit.vertices(); v += stride) vertices.push_back(v);
  MatrixXf displacements = displacementsOf(fit, vertices);
  Index kept = 0;
  for (Index i = 0; i < static_cast<Index>(vertices.size()); ++i) {
    const auto own = displacements.middleCols<3>(3 * i);
    if (own.rowwise().squaredNorm().maxCoeff() <= fit.tolerance * fit.tolerance) continue;
    if (kept != i) displacements.middleCols<3>(3 * kept) = own;
    ++kept;
  }
  displacements.conservativeResize(Eigen::NoChange, 3 * kept);
  return displacements;
}

/// Weights with largest magnitude 1 and the rows that take displacements to shapes: shapes = inverse * displacements.
struct Weights {
  RowMajorMatrixF weights;  ///< padded frames x shapes
  RowMajorMatrixF inverse;  ///< padded shapes x padded frames
  Index count = 0;
};

Weights weightsFromBasis(const MatrixXf& basis) {
  Weights result;
  result.count = basis.cols();
  const Index frames = paddedRows(basis.rows());
  result.weights = RowMajorMatrixF::Zero(frames, basis.cols());
  result.inverse = RowMajorMatrixF::Zero(paddedRows(basis.cols()), frames);
  for (Index k = 0; k < basis.cols(); ++k) {
    Index strongest = 0;
    basis.col(k).cwiseAbs().maxCoeff(&strongest);
    const float scale = basis(strongest, k);
    if (scale == 0) continue;
    result.weights.col(k).head(basis.rows()) = basis.col(k) / scale;
    result.inverse.row(k).head(basis.rows()) = basis.col(k).transpose() * scale;
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
        shapes_(weights.inverse.rows(), kPanelWidth) {}

  /// Shapes of vertices [first, first + 8) into columns of `shapes`; the largest squared residuals into `errors`.
  void fit(Index first, RowMajorMatrixF& shapes, float* errors) {
    const Index count = std::min<Index>(kPanelVertices, fit_.vertices() - first);
    loadPanel(first, count, errors);
    const float still = kStillShare * fit_.tolerance;
    if (std::all_of(errors, errors + count, [&](float square) { return square <= still * still; })) return;
    kernels_.multiply(weights_.inverse.data(), weights_.inverse.rows(), weights_.inverse.cols(), displacements_.data(),
                      shapes_.data());
    thinned_ = shapes_;
    for (const float share : kNegligibleShares) {
      dropBelow(share * fit_.tolerance);
      kernels_.largestResidual(weights_.weights.data(), weights_.weights.rows(), weights_.count, displacements_.data(),
                               thinned_.data(), errors);
      if (std::all_of(errors, errors + count, [&](float square) { return square <= fit_.tolerance * fit_.tolerance; })) {
        break;
      }
    }
    storePanel(first, count, shapes);
  }

 private:
  void loadPanel(Index first, Index count, float* errors) {
    const auto& positions = fit_.animation.positions;
    if (count == kPanelVertices) {
      kernels_.loadDisplacements(positions.data() + 3 * first, positions.cols(), fit_.frames(),
                                 fit_.rest.data() + 3 * first, displacements_.data(), errors);
      return;
    }
    RowMajorMatrixF padded = RowMajorMatrixF::Zero(fit_.frames(), kPanelWidth);
    Eigen::RowVectorXf rest = Eigen::RowVectorXf::Zero(kPanelWidth);
    padded.leftCols(3 * count) = positions.middleCols(3 * first, 3 * count);
    rest.head(3 * count) = fit_.rest.segment(3 * first, 3 * count);
    kernels_.loadDisplacements(padded.data(), kPanelWidth, fit_.frames(), rest.data(), displacements_.data(), errors);
  }

  /// thinned_ = shapes_ without displacements shorter than `limit`.
  void dropBelow(float limit) {
    for (Index k = 0; k < weights_.count; ++k) {
      const float* from = shapes_.row(k).data();
      float* to = thinned_.row(k).data();
      for (Index v = 0; v < kPanelVertices; ++v) {
        const float x = from[v];
        const float y = from[v + kPanelVertices];
        const float z = from[v + 2 * kPanelVertices];
        const float kept = x * x + y * y + z * z < limit * limit ? 0.0F : 1.0F;
        to[v] = kept * x;
        to[v + kPanelVertices] = kept * y;
        to[v + 2 * kPanelVertices] = kept * z;
      }
    }
  }

  void storePanel(Index first, Index count, RowMajorMatrixF& shapes) const {
    for (Index k = 0; k < weights_.count; ++k) {
      const float* from = thinned_.row(k).data();
      float* to = shapes.row(k).data() + 3 * first;
      for (Index v = 0; v < count; ++v) {
        to[3 * v] = from[v];
        to[3 * v + 1] = from[v + kPanelVertices];
        to[3 * v + 2] = from[v + 2 * kPanelVertices];
      }
    }
  }

  const Fit& fit_;
  const Weights& weights_;
  const PanelKernels& kernels_ = panelKernels();
  RowMajorMatrixF displacements_;  ///< padded frames x kPanelWidth
  RowMajorMatrixF shapes_;         ///< padded shapes x kPanelWidth
  RowMajorMatrixF thinned_;        ///< what is kept of them
};

/// Squared errors of all vertices (rounded up to whole panels) after the first fit of everything.
std::vector<float> fitAllVertices(const Fit& fit, const Weights& weights, RowMajorMatrixF& shapes) {
  std::vector<float> errors(static_cast<std::size_t>(fit.vertices() + kPanelVertices));
  PanelFitter fitter(fit, weights);
  for (Index first = 0; first < fit.vertices(); first += kPanelVertices) {
    fitter.fit(first, shapes, errors.data() + first);
  }
  errors.resize(static_cast<std::size_t>(fit.vertices()));
  return errors;
}

std::vector<Index> verticesBeyond(const std::vector<float>& errors, float allowed) {
  std::vector<Index> beyond;
  for (std::size_t v = 0; v < errors.size(); ++v) {
    if (!(errors[v] <= allowed)) beyond.push_back(static_cast<Index>(v));
  }
  return beyond;
}

/// At most kRefinedAtOnce of `vertices`, evenly spread, the worst among them.
std::vector<Index> representatives(const std::vector<Index>& vertices, const std::vector<float>& errors) {
  const std::size_t stride = vertices.size() / kRefinedAtOnce + 1;
  std::vector<Index> chosen;
  for (std::size_t first = 0; first < vertices.size(); first += stride) {
    const auto end = vertices.begin() + static_cast<std::ptrdiff_t>(std::min(first + stride, vertices.size()));
    chosen.push_back(*std::max_element(vertices.begin() + static_cast<std::ptrdiff_t>(first), end, [&](Index a, Index b) {
      return errors[static_cast<std::size_t>(a)] < errors[static_cast<std::size_t>(b)];
    }));
  }
  return chosen;
}

/// What the shapes so far leave of the given vertices' trajectories, frames x (3 * count).
MatrixXf residualOf(const Fit& fit, const PrincipalShapes& result, const std::vector<Index>& vertices) {
  MatrixXf residual = displacementsOf(fit, vertices);
  MatrixXf own_shapes(result.shapes.rows(), residual.cols());
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    own_shapes.middleCols<3>(3 * static_cast<Index>(i)) = result.shapes.middleCols<3>(3 * vertices[i]);
  }
  residual -= result.weights.topRows(fit.frames()) * own_shapes;
  return residual;
}

/// Adds shapes that move only `beyond`, from what is left of those vertices' own trajectories.
void refine(const Fit& fit, const std::vector<Index>& beyond, PrincipalShapes& result, std::vector<float>& errors) {
  const Weights added = weightsFromBasis(
      trajectoryBasis(residualOf(fit, result, representatives(beyond, errors)), kSampleShare * fit.tolerance));
  const Index before = result.shapes.rows();
  RowMajorMatrixF added_shapes = RowMajorMatrixF::Zero(added.count, result.shapes.cols());
  for (std::size_t first = 0; first < beyond.size(); first += kRefinedAtOnce) {
    const std::size_t end = std::min(first + kRefinedAtOnce, beyond.size());
    const std::vector<Index> vertices(beyond.begin() + static_cast<std::ptrdiff_t>(first),
                                      beyond.begin() + static_cast<std::ptrdiff_t>(end));
    MatrixXf residual = residualOf(fit, result, vertices);
    const MatrixXf shapes = added.inverse.topLeftCorner(added.count, fit.frames()) * residual;
    residual -= added.weights.topRows(fit.frames()) * shapes;
    for (std::size_t i = 0; i < vertices.size(); ++i) {
      const Index column = 3 * static_cast<Index>(i);
      added_shapes.middleCols<3>(3 * vertices[i]) = shapes.middleCols<3>(column);
      errors[static_cast<std::size_t>(vertices[i])] = residual.middleCols<3>(column).rowwise().squaredNorm().maxCoeff();
    }
  }
  result.shapes.conservativeResize(before + added.count, Eigen::NoChange);
  result.shapes.bottomRows(added.count) = added_shapes;
  result.weights.conservativeResize(Eigen::NoChange, before + added.count);
  result.weights.rightCols(added.count) = added.weights;
}

}  // namespace

PrincipalShapes principalShapes(const FaceAnimation& animation, const VertexPositions& rest, double metres_per_unit,
                                const PrincipalShapesOptions& options) {
  MOUTHPIECE_EXPECT(animation.positions.cols() == 3 * rest.rows());
  MOUTHPIECE_EXPECT(metres_per_unit > 0 && options.tolerance_mm > 0);
  const double mm_per_unit = 1000 * metres_per_unit;
  PrincipalShapes result;
  result.frame_rate_hz = animation.frame_rate_hz;
  result.rest = Eigen::Map<const Eigen::RowVectorXf>(rest.data(), rest.size());
  const Fit fit{animation, result.rest, static_cast<float>(options.tolerance_mm / mm_per_unit)};

  const MatrixXf sample = sampledDisplacements(fit);
  MOUTHPIECE_EXPECT(sample.allFinite());
  Weights weights = weightsFromBasis(trajectoryBasis(sample, kSampleShare * fit.tolerance));
  result.shapes = RowMajorMatrixF::Zero(weights.count, result.rest.cols());
  std::vector<float> errors = fitAllVertices(fit, weights, result.shapes);
  result.weights = std::move(weights.weights);
  MOUTHPIECE_EXPECT(result.shapes.allFinite());

  const float allowed = fit.tolerance * fit.tolerance;
  for (auto beyond = verticesBeyond(errors, allowed); !beyond.empty(); beyond = verticesBeyond(errors, allowed)) {
    refine(fit, beyond, result, errors);
  }
  result.weights.conservativeResize(fit.frames(), Eigen::NoChange);
  const float largest = errors.empty() ? 0.0F : *std::max_element(errors.begin(), errors.end());
  result.max_error_mm = std::sqrt(static_cast<double>(largest)) * mm_per_unit;
  return result;
}

}  // namespace mouthpiece
