#include "exports/shapes/panel_fitter.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "base/errors.h"
#include "base/index.h"
#include "base/parallel_for.h"
#include "exports/shapes/trajectories.h"

namespace mouthpiece {
namespace {

using Eigen::MatrixXf;

constexpr float kStillShare = 0.1F;  ///< a vertex that never moves further rests
/// A shape that never moves a vertex further than this leaves it alone; tried in turn until the vertex is within the
/// tolerance. The first makes the file a fifth smaller, 0 keeps everything.
constexpr std::array<float, 3> kNegligibleShares{0.5F, 0.15F, 0.0F};
/// Tried before all shapes are, and what they must come within: below the tolerance, so that a face is not everywhere
/// as far off as it may be.
constexpr std::array<Eigen::Index, 6> kFewShapes{8, 16, 32, 48, 64, 96};
constexpr float kFewShare = 0.8F;

Eigen::Index paddedRows(Eigen::Index rows) { return (rows + kPanelRowBlock - 1) / kPanelRowBlock * kPanelRowBlock; }

/// Displacements of vertices [first, first + 8), zeros for those that there are not: fit.frames() x kPanelWidth;
/// squares of the largest.
void loadPanel(const Fit& fit, Eigen::Index first, float* displacements, float* largest_squared) {
  if (fit.stepped != nullptr) return fit.stepped->panel(first, displacements, largest_squared);
  const auto& positions = fit.animation->positions;
  const Eigen::Index count = std::min<Eigen::Index>(kPanelVertices, fit.vertices() - first);
  const PanelKernels& kernels = panelKernels();
  if (count == kPanelVertices)
    return kernels.load_displacements(positions.data() + 3 * first, positions.cols(), fit.frames(),
                                      fit.rest.data() + 3 * first, displacements, largest_squared);
  RowMajorMatrixF padded = RowMajorMatrixF::Zero(fit.frames(), kPanelWidth);
  Eigen::RowVectorXf rest = Eigen::RowVectorXf::Zero(kPanelWidth);
  padded.leftCols(3 * count) = positions.middleCols(3 * first, 3 * count);
  rest.head(3 * count) = fit.rest.segment(3 * first, 3 * count);
  kernels.load_displacements(padded.data(), kPanelWidth, fit.frames(), rest.data(), displacements, largest_squared);
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
    loadPanel(fit_, first, displacements_.data(), errors);
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

/// `work` for the vertices [begin, end) of one part after the other, whole panels each, on all cores.
void forParts(const Fit& fit, const std::function<void(Eigen::Index begin, Eigen::Index end)>& work) {
  constexpr Eigen::Index kVerticesAPart = 128 * kPanelVertices;
  parallelFor(unsignedIndex((fit.vertices() + kVerticesAPart - 1) / kVerticesAPart), [&](std::size_t part) {
    const Eigen::Index begin = kVerticesAPart * signedIndex(part);
    work(begin, std::min(begin + kVerticesAPart, fit.vertices()));
  });
}

}  // namespace

HeldFrames::HeldFrames(const FrameMaker& frames, std::span<const Eigen::Index> which,
                       const Eigen::RowVectorXf& moving_rest, double mm_per_unit, double tolerance_mm)
    : rest_(moving_rest), tolerance_(asFloat(tolerance_mm / mm_per_unit)) {
  // Of the tolerance: 0.7 micrometres of the usual one. A vertex that goes farther than 256 tolerances, 23 mm, is held
  // as it is.
  constexpr double kStep = 1.0 / 128;
  constexpr double kFarthestOff = 0.8661;  // half the diagonal of a cube
  const double step_mm = kStep * tolerance_mm;
  stepped_ = SteppedFrames::of(frames, which, moving_rest, asFloat(step_mm / mm_per_unit));
  if (stepped_) {
    off_mm = kFarthestOff * step_mm;
    tolerance_ = asFloat((tolerance_mm - off_mm) / mm_per_unit);
  } else {
    animation_ = frames.frames(which);
  }
}

Fit HeldFrames::fit(Eigen::Index telling) const {
  return {&animation_, stepped_ ? &*stepped_ : nullptr, rest_, tolerance_, telling};
}

Eigen::RowVectorXf movingRest(const PrincipalShapes& shapes, const VertexPositions& rest) {
  const std::vector<std::uint32_t> vertices = shapes.columnVertices();
  Eigen::RowVectorXf moving_rest(3 * signedIndex(vertices.size()));
  for (std::size_t i = 0; i < vertices.size(); ++i)
    moving_rest.segment<3>(3 * signedIndex(i)) = rest.row(signedIndex(std::size_t{vertices[i]}));
  return moving_rest;
}

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

Weights weightsFromBasis(const MatrixXf& basis, Eigen::Index telling) {
  Weights result;
  result.count = basis.cols();
  const Eigen::Index frames = paddedRows(basis.rows());
  result.weights = RowMajorMatrixF::Zero(frames, 1 + basis.cols());
  result.weights.col(0).head(basis.rows()).setOnes();
  result.inverse = RowMajorMatrixF::Zero(paddedRows(basis.cols()), paddedRows(telling));
  for (Eigen::Index k = 0; k < basis.cols(); ++k) {
    Eigen::Index strongest = 0;
    basis.col(k).cwiseAbs().maxCoeff(&strongest);
    const Eigen::VectorXf column = (basis(strongest, k) < 0 ? -1.0F : 1.0F) * basis.col(k);
    const float high = column.maxCoeff();
    const bool is_constant = high - column.minCoeff() < 1e-5F * high;
    const float low = is_constant ? 0.0F : column.minCoeff();
    result.weights.col(k + 1).head(basis.rows()) =
        ((column.array() - low) / (high - low)).cwiseMin(1.0F).cwiseMax(0.0F);
    result.inverse.row(k).head(telling) = (high - low) * column.head(telling).transpose();
    result.offset_shares.push_back(low / (high - low));
  }
  return result;
}

std::vector<float> fitAllVertices(const Fit& fit, const Weights& weights, RowMajorMatrixF& shapes) {
  std::vector<float> errors(unsignedIndex(fit.vertices() + kPanelVertices));
  forParts(fit, [&](Eigen::Index begin, Eigen::Index end) {
    PanelFitter fitter(fit, weights);
    for (Eigen::Index first = begin; first < end; first += kPanelVertices)
      fitter.fit(first, shapes, errors.data() + first);
  });
  errors.resize(unsignedIndex(fit.vertices()));
  return errors;
}

std::vector<float> errorsOfAllVertices(const Fit& fit, const RowMajorMatrixF& weights, const RowMajorMatrixF& shapes) {
  const PanelKernels& kernels = panelKernels();
  const Eigen::Index frames = paddedRows(fit.frames());
  RowMajorMatrixF padded = RowMajorMatrixF::Zero(frames, weights.cols());
  padded.topRows(fit.frames()) = weights.topRows(fit.frames());
  std::vector<float> errors(unsignedIndex(fit.vertices() + kPanelVertices));
  forParts(fit, [&](Eigen::Index begin, Eigen::Index end) {
    RowMajorMatrixF displacements = RowMajorMatrixF::Zero(frames, kPanelWidth), moving(shapes.rows(), kPanelWidth);
    std::vector<std::int32_t> which;  // of the shapes move the panel
    for (Eigen::Index first = begin; first < end; first += kPanelVertices) {
      loadPanel(fit, first, displacements.data(), errors.data() + first);
      const Eigen::Index count = std::min<Eigen::Index>(kPanelVertices, fit.vertices() - first);
      MOUTHPIECE_EXPECT(std::isfinite(errors[unsignedIndex(first)]));
      which.clear();
      for (Eigen::Index k = 0; k < shapes.rows(); ++k) {
        const auto own = shapes.row(k).segment(3 * first, 3 * count);
        if ((own.array() == 0).all()) continue;
        auto panel = moving.row(std::ssize(which)).setZero();
        for (Eigen::Index i = 0; i < 3 * count; ++i) panel(i % 3 * kPanelVertices + i / 3) = own(i);
        which.push_back(static_cast<std::int32_t>(k));
      }
      if (which.empty()) continue;
      kernels.largest_residual(padded.data(), padded.cols(), frames, which.data(), std::ssize(which),
                               displacements.data(), moving.data(), errors.data() + first);
    }
  });
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

MatrixXf residualOf(const Fit& fit, const RowMajorMatrixF& weights, const RowMajorMatrixF& shapes,
                    const std::vector<Eigen::Index>& vertices) {
  MatrixXf residual = displacementsOf(fit, vertices);
  MatrixXf own_shapes(shapes.rows(), residual.cols());
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    own_shapes.middleCols<3>(3 * signedIndex(i)) = shapes.middleCols<3>(3 * vertices[i]);
  }
  residual -= weights.topRows(fit.frames()) * own_shapes;
  return residual;
}

}  // namespace mouthpiece
