#include "exports/arkit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <concepts>
#include <numeric>

#include "base/errors.h"
#include "base/index.h"
#include "deform/mesh/face_mesh.h"
#include "deform/mesh/lip_slit.h"

namespace mouthpiece {
namespace {

constexpr Eigen::Index kShapes = signedIndex(kArkitNames.size());

/// Vertices of skin and lips but for what stands off them, as lashes do: those turn about their roots, so that their
/// tips go twice as far as a lid's edge in a blink of the head's own, and not at all as far in a pose of markers.
std::vector<bool> bareSkin(const FaceMesh& mesh) {
  std::vector<bool> is_bare(mesh.vertexCount(), false);
  for (const MeshPart& part : mesh.parts) {
    if (!isSkin(part.kind) || part.stands_off) continue;
    for (const Triangle& t : trianglesOf(mesh, part)) {
      for (const std::uint32_t v : t) is_bare[v] = true;
    }
  }
  return is_bare;
}

/// A shape that is one of ARKit's, with its number there. What it moves is compared with motion on bare skin, elsewhere
/// only if it moves none, as shapes of brows do that are meshes of their own.
struct DrivenShape {
  Eigen::Index number;
  const VertexPositions& moves;
  bool moves_skin;
  float most;  ///< how far it moves a vertex that it is compared on; the mesh's unit
  [[nodiscard]] bool isSeenIn(std::integral auto vertex, const std::vector<bool>& is_bare) const {
    return is_bare[unsignedIndex(vertex)] || !moves_skin;
  }
};

DrivenShape drivenShape(int number, const VertexPositions& moves, const std::vector<bool>& is_bare) {
  constexpr float kMovesSkin = 0.1F;  // of its most
  float most = 0, of_skin = 0;
  for (Eigen::Index v = 0; v < moves.rows(); ++v) {
    const float way = moves.row(v).norm();
    most = std::max(most, way);
    if (is_bare[unsignedIndex(v)]) of_skin = std::max(of_skin, way);
  }
  const bool moves_skin = of_skin > kMovesSkin * most;
  return {number, moves, moves_skin, moves_skin ? of_skin : most};
}

/// Not those that turn the eyes: what markers do to the lids says nothing about where they look.
std::vector<DrivenShape> drivenShapes(const FaceShapes& shapes, const std::vector<bool>& is_bare) {
  std::vector<DrivenShape> driven;
  for (std::size_t s = 0; s < shapes.moves.size(); ++s) {
    const int number = arkitIndex(shapes.names[s]);
    if (number >= 0 && !kArkitNames[unsignedIndex(number)].starts_with("EyeLook"))
      driven.push_back(drivenShape(number, shapes.moves[s], is_bare));
  }
  return driven;
}

/// Vertices of skin and lips.
std::vector<Eigen::Index> skinVertices(const FaceMesh& mesh) {
  std::vector<bool> is_skin(unsignedIndex(mesh.vertices.rows()), false);
  for (const MeshPart& part : mesh.parts) {
    if (part.kind != PartKind::kSkin && part.kind != PartKind::kLips) continue;
    for (std::size_t t = part.first_triangle; t < part.first_triangle + part.triangle_count; ++t) {
      for (const std::uint32_t v : mesh.triangles[t]) is_skin[v] = true;
    }
  }
  std::vector<Eigen::Index> vertices;
  for (std::size_t v = 0; v < is_skin.size(); ++v) {
    if (is_skin[v]) vertices.push_back(signedIndex(v));
  }
  return vertices;
}

/// Skin that the animation or a shape moves; shapes of one ARKit name are one.
struct Problem {
  std::vector<Eigen::Index> vertices;
  Eigen::MatrixXf shapes;  ///< (3 * vertices) x 52
  Eigen::MatrixXf motion;  ///< (3 * vertices) x frames
  std::vector<bool> has_shape = std::vector<bool>(kArkitNames.size(), false);
};

Problem problemOf(const FaceAnimation& animation, const FaceMesh& mesh, const std::vector<DrivenShape>& driven,
                  const std::vector<bool>& is_bare) {
  Problem problem;
  for (const DrivenShape& shape : driven) problem.has_shape[unsignedIndex(shape.number)] = true;
  const Eigen::Map<const Eigen::RowVectorXf> rest(mesh.vertices.data(), mesh.vertices.size());
  const float still = asFloat(1e-6 / mesh.metres_per_unit);
  for (const Eigen::Index v : skinVertices(mesh)) {
    bool moves =
        is_bare[unsignedIndex(v)] &&
        (animation.positions.middleCols<3>(3 * v).rowwise() - rest.segment<3>(3 * v)).cwiseAbs().maxCoeff() > still;
    for (std::size_t s = 0; s < driven.size() && !moves; ++s)
      moves = driven[s].isSeenIn(v, is_bare) && driven[s].moves.row(v).cwiseAbs().maxCoeff() > still;
    if (moves) problem.vertices.push_back(v);
  }
  const auto rows = 3 * signedIndex(problem.vertices.size());
  problem.shapes = Eigen::MatrixXf::Zero(rows, kShapes);
  problem.motion.resize(rows, animation.positions.rows());
  for (std::size_t i = 0; i < problem.vertices.size(); ++i) {
    const Eigen::Index v = problem.vertices[i];
    const Eigen::Index row = 3 * signedIndex(i);
    problem.motion.middleRows<3>(row) =
        (animation.positions.middleCols<3>(3 * v).rowwise() - rest.segment<3>(3 * v)).transpose();
    for (const DrivenShape& shape : driven) {
      if (shape.isSeenIn(v, is_bare)) problem.shapes.block<3, 1>(row, shape.number) += shape.moves.row(v).transpose();
    }
  }
  return problem;
}

/// The middle half of the slit of the mouth (its corners always touch): of each step across it the pair of vertices
/// that comes nearest in the motion. What counts is how much higher the upper one is, in mesh units: lips that roll
/// pass each other in depth.
struct Slit {
  Eigen::MatrixXf shapes;   ///< pairs x 52: what the shapes part them by
  Eigen::MatrixXf heights;  ///< pairs x frames: of the motion
  Eigen::VectorXf at_rest;  ///< pairs
};

Slit slitOf(const FaceAnimation& animation, const FaceMesh& mesh, const std::vector<DrivenShape>& driven) {
  VertexPositions jaw = VertexPositions::Zero(mesh.vertices.rows(), 3);
  for (const DrivenShape& shape : driven) {
    if (kArkitNames[unsignedIndex(shape.number)] == "JawOpen") jaw += shape.moves;
  }
  const auto heightsOf = [&](const SlitPair& pair) -> Eigen::RowVectorXf {
    return animation.positions.col(3 * signedIndex(pair.upper) + 1) -
           animation.positions.col(3 * signedIndex(pair.lower) + 1);
  };
  std::vector<SlitPair> pairs;
  for (const SlitPair& pair : lipSlit(mesh, jaw)) {
    if (pair.step < kSlitSteps / 4 || pair.step >= kSlitSteps - kSlitSteps / 4 || animation.positions.rows() == 0)
      continue;
    if (pairs.empty() || pairs.back().step != pair.step)
      pairs.push_back(pair);
    else if (heightsOf(pair).minCoeff() < heightsOf(pairs.back()).minCoeff())
      pairs.back() = pair;
  }
  const auto rows = signedIndex(pairs.size());
  Slit slit{Eigen::MatrixXf::Zero(rows, kShapes), Eigen::MatrixXf(rows, animation.positions.rows()),
            Eigen::VectorXf(rows)};
  for (Eigen::Index row = 0; row < rows; ++row) {
    const Eigen::Index upper = pairs[unsignedIndex(row)].upper, lower = pairs[unsignedIndex(row)].lower;
    for (const DrivenShape& shape : driven)
      slit.shapes(row, shape.number) += shape.moves(upper, 1) - shape.moves(lower, 1);
    slit.at_rest(row) = mesh.vertices(upper, 1) - mesh.vertices(lower, 1);
    slit.heights.row(row) = heightsOf(pairs[unsignedIndex(row)]);
  }
  return slit;
}

/// The median of the pairs of each frame: on coarse lips some have no vertex across from them, and gape while the lips
/// touch beside them.
std::vector<double> gapesOf(const Eigen::MatrixXf& heights, double mm_per_unit) {
  std::vector<double> gapes;
  for (Eigen::Index t = 0; heights.rows() > 0 && t < heights.cols(); ++t) {
    Eigen::VectorXf column = heights.col(t);
    const auto middle = column.begin() + column.size() / 2;
    std::nth_element(column.begin(), middle, column.end());
    gapes.push_back(mm_per_unit * static_cast<double>(*middle));
  }
  return gapes;
}

constexpr double kTightMm = 0.15;
constexpr double kOpenMm = 1.5;   ///< no closed lips gape so far
constexpr double kMeetMm = 0.35;  ///< lips meet that gape by no more than this beyond closed ones
constexpr double kLeftMm = 0.25;  ///< what shapes may leave open of lips that meet
constexpr double kKeptMm = 0.25;  ///< lips count as kept that are left open by no more than this beyond that

/// The frames in which lips gape no more than closed ones, whose vertices stay some tenths of a millimetre apart where
/// rims are round: as far as at rest and in the motion's tightest frame, as long as these are of closed lips. There
/// each pair comes no nearer than in the motion, and gapes by no more than kLeftMm, or than at rest where that is less,
/// unless the motion's does.
ShapeClosures closuresOf(const Slit& slit, double mm_per_unit) {
  ShapeClosures closures{.shapes = slit.shapes};
  const std::vector<double> gapes = gapesOf(slit.heights, mm_per_unit);
  if (gapes.empty()) return closures;
  const double rest = gapesOf(slit.at_rest, mm_per_unit).front();
  double closed = kTightMm;
  for (const double gape : {rest, *std::min_element(gapes.begin(), gapes.end())}) {
    if (gape < kOpenMm) closed = std::max(closed, gape);
  }
  for (const double gape : gapes) closures.in_frame.push_back(gape < closed + kMeetMm);
  closures.least = slit.heights.colwise() - slit.at_rest;
  const Eigen::VectorXf left = (asFloat(kLeftMm / mm_per_unit) - slit.at_rest.array()).cwiseMin(0);
  closures.most = closures.least.cwiseMax(left.replicate(1, closures.least.cols()));
  return closures;
}

/// A blink takes the lid's edge as far as `motion` does: least squares over all of the lid, and what smooths and spares
/// weights, leave an eye open that has closed. `shapes`: (3 * vertices) x 52; `motion`: the same x frames.
void closeLids(const Eigen::MatrixXf& shapes, const Eigen::MatrixXf& motion, RowMajorMatrixF& weights) {
  constexpr float kEdge = 0.85F;   // of what the shape moves most
  constexpr float kWhole = 0.25F;  // weights below are left to fade out
  for (const std::string_view name : {"EyeBlinkLeft", "EyeBlinkRight"}) {
    const Eigen::Index blink = arkitIndex(name);
    const auto lid = shapes.col(blink);
    float most = 0;
    for (Eigen::Index row = 0; row < lid.size(); row += 3) most = std::max(most, lid.segment<3>(row).norm());
    if (!(most > 0)) continue;
    std::vector<Eigen::Index> edge;
    for (Eigen::Index row = 0; row < lid.size(); row += 3) {
      if (lid.segment<3>(row).norm() >= kEdge * most) edge.insert(edge.end(), {row, row + 1, row + 2});
    }
    const Eigen::VectorXf moves = lid(edge);
    const Eigen::RowVectorXf left =
        moves.transpose() * (motion(edge, Eigen::all) - shapes(edge, Eigen::all) * weights.transpose());
    for (Eigen::Index t = 0; t < weights.rows(); ++t) {
      float& weight = weights(t, blink);
      weight = std::clamp(weight + std::min(weight / kWhole, 1.0F) * left(t) / moves.squaredNorm(), 0.0F, 1.0F);
    }
  }
}

}  // namespace

ArkitCurves fitArkit(const FaceAnimation& animation, const FaceMesh& mesh, const FaceShapes& shapes,
                     const ArkitOptions& options) {
  MOUTHPIECE_EXPECT(animation.positions.cols() == mesh.vertices.size());
  if (std::none_of(shapes.names.begin(), shapes.names.end(),
                   [](const std::string& name) { return arkitIndex(name) >= 0; })) {
    throw InputError("found no shape with an ARKit name (jawOpen, mouthSmile_L ...)");
  }
  // A face keeps its mesh: what its file says need not be what the head's has.
  for (const VertexPositions& moves : shapes.moves) {
    if (moves.rows() != mesh.vertices.rows())
      throw InputError(
          fmt::format("found shapes of {} vertices; expected {}, as many as the fitted mesh has: fit the head again",
                      moves.rows(), mesh.vertices.rows()));
  }
  const std::vector<bool> is_bare = bareSkin(mesh);
  const std::vector<DrivenShape> driven = drivenShapes(shapes, is_bare);
  const Problem problem = problemOf(animation, mesh, driven, is_bare);
  const double mm_per_unit = 1000 * mesh.metres_per_unit;
  ArkitCurves curves;
  curves.frame_rate_hz = animation.frame_rate_hz;
  curves.has_shape = problem.has_shape;
  const auto present = std::count(problem.has_shape.begin(), problem.has_shape.end(), true);
  ShapeClosures closures = closuresOf(slitOf(animation, mesh, driven), mm_per_unit);
  curves.closures = unsignedIndex(std::count(closures.in_frame.begin(), closures.in_frame.end(), true));
  // Where the weights leave lips apart that meet, they are asked for as much more all over: the
  // place that gapes alone is too little to be heard.
  constexpr int kRounds = 5;
  const Eigen::MatrixXf meant = closures.most;
  for (int round = 0; round < kRounds; ++round) {
    RowMajorMatrixF weights =
        fitShapeWeights(problem.shapes, problem.motion, unsignedIndex(present), options, &closures);
    const Eigen::MatrixXf beyond = closures.shapes * weights.transpose() - meant;
    std::size_t kept = 0;
    for (Eigen::Index t = 0; t < std::ssize(closures.in_frame); ++t) {
      if (!closures.in_frame[unsignedIndex(t)]) continue;
      const float apart = beyond.col(t).maxCoeff();
      if (mm_per_unit * static_cast<double>(apart) < kKeptMm)
        ++kept;
      else
        closures.most.col(t).array() -= apart;
    }
    closures.least = closures.least.cwiseMin(closures.most);
    if (round == 0 || kept > curves.closures_kept) {
      curves.weights = std::move(weights);
      curves.closures_kept = kept;
    }
    if (curves.closures_kept == curves.closures) break;
  }
  closeLids(problem.shapes, problem.motion, curves.weights);
  double squares = 0, motion_squares = 0;
  for (Eigen::Index t = 0; t < problem.motion.cols(); ++t) {
    const Eigen::VectorXf miss = problem.motion.col(t) - problem.shapes * curves.weights.row(t).transpose();
    for (Eigen::Index row = 0; row < miss.size(); row += 3) {
      const double square = static_cast<double>(miss.segment<3>(row).squaredNorm());
      curves.largest_error_mm = std::max(curves.largest_error_mm, mm_per_unit * std::sqrt(square));
      squares += square;
    }
    motion_squares += static_cast<double>(problem.motion.col(t).squaredNorm());
  }
  const double count = std::max(1.0, asReal(problem.vertices.size()) * asReal(problem.motion.cols()));
  curves.rms_error_mm = mm_per_unit * std::sqrt(squares / count);
  curves.rms_motion_mm = mm_per_unit * std::sqrt(motion_squares / count);
  return curves;
}

RowMajorMatrixF takeLidsAndBrows(FaceAnimation& animation, const FaceMesh& mesh, const FaceShapes& shapes) {
  const auto isTaken = [](int shape) {
    if (shape < 0) return false;
    const std::string_view name = kArkitNames[unsignedIndex(shape)];
    return name.starts_with("EyeBlink") || name.starts_with("EyeWide") || name.starts_with("EyeSquint") ||
           name.starts_with("Brow");
  };
  const std::vector<bool> is_bare = bareSkin(mesh);
  std::vector<DrivenShape> own;
  for (std::size_t s = 0; s < shapes.names.size(); ++s) {
    const int number = arkitIndexAmong(shapes.names[s], shapes.names);
    if (isTaken(number) && shapes.moves[s].rows() == mesh.vertices.rows())
      own.push_back(drivenShape(number, shapes.moves[s], is_bare));
  }
  if (own.empty() || animation.positions.rows() == 0) return {};
  std::vector<std::uint32_t> columns = animation.vertices;
  if (columns.empty()) {
    columns.resize(mesh.vertexCount());
    std::iota(columns.begin(), columns.end(), 0U);
  }
  // The region of a shape is where it does half of its most; further out it fades.
  std::vector<std::pair<std::size_t, float>> region;  // of `columns`, and how wholly it is the shapes'
  for (std::size_t i = 0; i < columns.size(); ++i) {
    float share = 0;
    for (const DrivenShape& shape : own) {
      if (shape.most > 0) share = std::max(share, 2 * shape.moves.row(columns[i]).norm() / shape.most);
    }
    if (share > 0.1F) region.emplace_back(i, std::min(share, 1.0F));
  }
  const auto rows = 3 * signedIndex(region.size());
  Eigen::MatrixXf moves = Eigen::MatrixXf::Zero(rows, kShapes), seen = moves, motion(rows, animation.positions.rows());
  for (std::size_t r = 0; r < region.size(); ++r) {
    const Eigen::Index row = 3 * signedIndex(r), column = 3 * signedIndex(region[r].first);
    const std::uint32_t v = columns[region[r].first];
    motion.middleRows<3>(row) =
        (animation.positions.middleCols<3>(column).rowwise() - mesh.vertices.row(v)).transpose();
    for (const DrivenShape& shape : own) {
      moves.block<3, 1>(row, shape.number) += shape.moves.row(v).transpose();
      if (shape.isSeenIn(v, is_bare)) seen.block<3, 1>(row, shape.number) += shape.moves.row(v).transpose();
    }
  }
  if (region.empty()) return {};
  RowMajorMatrixF weights = fitShapeWeights(seen, motion, own.size());
  closeLids(seen, motion, weights);
  constexpr float kSeen = 0.02F;  // a shape that never does more is left alone
  for (Eigen::Index k = 0; k < kShapes; ++k) {
    if (weights.col(k).maxCoeff() < kSeen) weights.col(k).setZero();
  }
  if (weights.maxCoeff() <= 0) return {};
  const Eigen::MatrixXf done = moves * weights.transpose();
  for (std::size_t r = 0; r < region.size(); ++r) {
    const Eigen::Index row = 3 * signedIndex(r), column = 3 * signedIndex(region[r].first);
    const Eigen::MatrixXf left = (1 - region[r].second) * (motion.middleRows<3>(row) - done.middleRows<3>(row));
    animation.positions.middleCols<3>(column) =
        left.transpose().rowwise() + mesh.vertices.row(columns[region[r].first]);
  }
  return weights;
}

}  // namespace mouthpiece
