#include "exports/arkit.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "base/errors.h"
#include "base/index.h"
#include "deform/mesh/face_mesh.h"
#include "deform/mesh/lip_slit.h"

namespace mouthpiece {
namespace {

constexpr Eigen::Index kShapes = signedIndex(kArkitNames.size());

/// The shape's number, unless it turns the eyes: what markers do to the lids says nothing about where they look.
int drivenShape(std::string_view name) {
  const int shape = arkitIndex(name);
  return shape >= 0 && kArkitNames[unsignedIndex(shape)].starts_with("EyeLook") ? -1 : shape;
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

Problem problemOf(const FaceAnimation& animation, const FaceMesh& mesh, const FaceShapes& shapes) {
  Problem problem;
  const Eigen::Map<const Eigen::RowVectorXf> rest(mesh.vertices.data(), mesh.vertices.size());
  const float still = asFloat(1e-6 / mesh.metres_per_unit);
  for (const Eigen::Index v : skinVertices(mesh)) {
    bool moves =
        (animation.positions.middleCols<3>(3 * v).rowwise() - rest.segment<3>(3 * v)).cwiseAbs().maxCoeff() > still;
    for (std::size_t s = 0; s < shapes.moves.size() && !moves; ++s)
      moves = drivenShape(shapes.names[s]) >= 0 && shapes.moves[s].row(v).cwiseAbs().maxCoeff() > still;
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
    for (std::size_t s = 0; s < shapes.moves.size(); ++s) {
      const int shape = drivenShape(shapes.names[s]);
      if (shape < 0) continue;
      problem.has_shape[unsignedIndex(shape)] = true;
      problem.shapes.block<3, 1>(row, shape) += shapes.moves[s].row(v).transpose();
    }
  }
  return problem;
}

/// The slit of the mouth; its motion as places, `at_rest` from one lip to the other.
ShapeClosures closuresOf(const FaceAnimation& animation, const FaceMesh& mesh, const FaceShapes& shapes,
                         std::vector<SlitPair>& slit, Eigen::VectorXf& at_rest) {
  VertexPositions jaw = VertexPositions::Zero(mesh.vertices.rows(), 3);
  for (std::size_t s = 0; s < shapes.names.size(); ++s) {
    const int shape = arkitIndex(shapes.names[s]);
    if (shape >= 0 && kArkitNames[unsignedIndex(shape)] == "JawOpen") jaw += shapes.moves[s];
  }
  // The corners always touch: what counts is the middle half.
  slit = lipSlit(mesh, jaw);
  std::erase_if(slit, [](const SlitPair& pair) {
    return pair.step < kSlitSteps / 4 || pair.step >= kSlitSteps - kSlitSteps / 4;
  });
  ShapeClosures closures;
  const auto rows = 3 * signedIndex(slit.size());
  closures.shapes = Eigen::MatrixXf::Zero(rows, kShapes);
  closures.motion = Eigen::MatrixXf::Zero(rows, animation.positions.rows());
  at_rest = Eigen::VectorXf::Zero(rows);
  for (std::size_t i = 0; i < slit.size(); ++i) {
    const Eigen::Index row = 3 * signedIndex(i), upper = signedIndex(slit[i].upper), lower = signedIndex(slit[i].lower);
    for (std::size_t s = 0; s < shapes.moves.size(); ++s) {
      const int shape = drivenShape(shapes.names[s]);
      if (shape >= 0)
        closures.shapes.block<3, 1>(row, shape) +=
            (shapes.moves[s].row(upper) - shapes.moves[s].row(lower)).transpose();
    }
    at_rest.segment<3>(row) = (mesh.vertices.row(upper) - mesh.vertices.row(lower)).transpose();
    closures.motion.middleRows<3>(row) =
        (animation.positions.middleCols<3>(3 * upper) - animation.positions.middleCols<3>(3 * lower)).transpose();
  }
  return closures;
}

/// How far the lips of each frame gape where they do most, over the middle half of the mouth, mm: in each step across
/// it the pair that is nearest counts, by height, since lips that roll pass each other in depth.
std::vector<double> gapesOf(const std::vector<SlitPair>& slit, const Eigen::MatrixXf& apart, double mm_per_unit) {
  std::vector<double> gapes(unsignedIndex(apart.cols()), 0.0);
  for (Eigen::Index t = 0; t < apart.cols(); ++t) {
    for (std::size_t first = 0; first < slit.size();) {
      double least = std::numeric_limits<double>::max();
      std::size_t i = first;
      for (; i < slit.size() && slit[i].step == slit[first].step; ++i)
        least = std::min(least, mm_per_unit * static_cast<double>(apart(3 * signedIndex(i) + 1, t)));
      gapes[unsignedIndex(t)] = std::max(gapes[unsignedIndex(t)], least);
      first = i;
    }
  }
  return gapes;
}

constexpr double kTightMm = 0.15;
/// Lips meet that gape by no more than this beyond closed ones.
constexpr double kMeetMm = 0.35;

/// How far vertices of closed lips gape, mm: those of round rims stay some tenths of a millimetre apart. As far as at
/// rest and in the motion's tightest frame, as long as these are of closed lips.
double closedGape(double at_rest, const std::vector<double>& gapes) {
  constexpr double kOpen = 1.5;
  const double least = gapes.empty() ? 0 : *std::min_element(gapes.begin(), gapes.end());
  double closed = kTightMm;
  for (const double gape : {at_rest, least}) {
    if (gape < kOpen) closed = std::max(closed, gape);
  }
  return closed;
}

/// Lips that meet are asked to meet all over: the shapes give in where they cannot.
void tighten(const std::vector<double>& gapes, double tight_mm, double mm_per_unit, ShapeClosures& closures) {
  for (std::size_t t = 0; t < gapes.size(); ++t) {
    const float shift = asFloat(std::max(0.0, gapes[t] - tight_mm) / mm_per_unit);
    for (Eigen::Index row = 1; closures.in_frame[t] && row < closures.motion.rows(); row += 3)
      closures.motion(row, signedIndex(t)) -= shift;
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
  const Problem problem = problemOf(animation, mesh, shapes);
  const double mm_per_unit = 1000 * mesh.metres_per_unit;
  ArkitCurves curves;
  curves.frame_rate_hz = animation.frame_rate_hz;
  curves.has_shape = problem.has_shape;
  const auto present = std::count(problem.has_shape.begin(), problem.has_shape.end(), true);
  Eigen::VectorXf at_rest;
  std::vector<SlitPair> slit;
  ShapeClosures closures = closuresOf(animation, mesh, shapes, slit, at_rest);
  const std::vector<double> gapes = gapesOf(slit, closures.motion, mm_per_unit);
  const double tight_mm = closedGape(gapesOf(slit, at_rest, mm_per_unit).front(), gapes), meet_mm = tight_mm + kMeetMm;
  for (const double gape : gapes) closures.in_frame.push_back(!slit.empty() && gape < meet_mm);
  tighten(gapes, tight_mm, mm_per_unit, closures);
  closures.motion.colwise() -= at_rest;
  // Where the weights leave lips apart that meet, they are asked for as much more.
  constexpr int kRounds = 5;
  for (int round = 0; round < kRounds; ++round) {
    RowMajorMatrixF weights =
        fitShapeWeights(problem.shapes, problem.motion, unsignedIndex(present), options, &closures);
    std::vector<double> apart = gapesOf(slit, (closures.shapes * weights.transpose()).colwise() + at_rest, mm_per_unit);
    std::size_t kept = 0;
    for (std::size_t t = 0; t < apart.size(); ++t) {
      if (closures.in_frame[t] && apart[t] < meet_mm) ++kept;
      if (!closures.in_frame[t] || apart[t] < meet_mm) apart[t] = 0;
    }
    if (round == 0 || kept > curves.closures_kept) {
      curves.weights = std::move(weights);
      curves.closures_kept = kept;
    }
    curves.closures = unsignedIndex(std::count(closures.in_frame.begin(), closures.in_frame.end(), true));
    if (curves.closures_kept == curves.closures) break;
    tighten(apart, tight_mm, mm_per_unit, closures);
  }
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
  std::vector<std::size_t> own;
  for (std::size_t s = 0; s < shapes.names.size(); ++s) {
    if (isTaken(arkitIndex(shapes.names[s])) && shapes.moves[s].rows() == mesh.vertices.rows()) own.push_back(s);
  }
  if (own.empty() || animation.positions.rows() == 0) return {};
  std::vector<std::uint32_t> columns = animation.vertices;
  if (columns.empty()) {
    columns.resize(mesh.vertexCount());
    std::iota(columns.begin(), columns.end(), 0U);
  }
  std::vector<float> reach(shapes.names.size(), 0.0F);
  for (const std::size_t s : own) reach[s] = shapes.moves[s].rowwise().norm().maxCoeff();
  // The region of a shape is where it does half of its most; further out it fades.
  std::vector<std::pair<std::size_t, float>> region;  // of `columns`, and how wholly it is the shapes'
  for (std::size_t i = 0; i < columns.size(); ++i) {
    float share = 0;
    for (const std::size_t s : own) {
      if (reach[s] > 0) share = std::max(share, 2 * shapes.moves[s].row(columns[i]).norm() / reach[s]);
    }
    if (share > 0.1F) region.emplace_back(i, std::min(share, 1.0F));
  }
  const auto rows = 3 * signedIndex(region.size());
  Eigen::MatrixXf moves = Eigen::MatrixXf::Zero(rows, kShapes), motion(rows, animation.positions.rows());
  for (std::size_t r = 0; r < region.size(); ++r) {
    const Eigen::Index row = 3 * signedIndex(r), column = 3 * signedIndex(region[r].first);
    const std::uint32_t v = columns[region[r].first];
    motion.middleRows<3>(row) =
        (animation.positions.middleCols<3>(column).rowwise() - mesh.vertices.row(v)).transpose();
    for (const std::size_t s : own)
      moves.block<3, 1>(row, arkitIndex(shapes.names[s])) += shapes.moves[s].row(v).transpose();
  }
  if (region.empty()) return {};
  RowMajorMatrixF weights = fitShapeWeights(moves, motion, own.size());
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
