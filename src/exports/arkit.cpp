#include "exports/arkit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>

#include "base/errors.h"
#include "base/index.h"
#include "deform/mesh/face_mesh.h"
#include "exports/gltf/glb.h"

namespace mouthpiece {
namespace {

constexpr Eigen::Index kShapes = signedIndex(kArkitNames.size());
constexpr int kMostSweeps = 400;
constexpr double kStill = 1e-4;  ///< largest change of a weight in a sweep that ends the search

/// Lower case, letters and digits only; a final side letter written out.
std::string plainName(std::string_view name) {
  std::string ending;
  if (name.size() > 2 && (name[name.size() - 2] == '_' || name[name.size() - 2] == '.')) {
    const char side = static_cast<char>(std::tolower(static_cast<unsigned char>(name.back())));
    if (side == 'l') ending = "left";
    if (side == 'r') ending = "right";
    if (!ending.empty()) name.remove_suffix(2);
  }
  std::string plain;
  for (const char letter : name) {
    const auto byte = static_cast<unsigned char>(letter);
    if (std::isalnum(byte) != 0) plain.push_back(static_cast<char>(std::tolower(byte)));
  }
  return plain + ending;
}

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

}  // namespace

int arkitIndex(std::string_view shape_name) {
  static const auto plain_names = [] {
    std::array<std::string, kArkitNames.size()> plain;
    std::transform(kArkitNames.begin(), kArkitNames.end(), plain.begin(), plainName);
    return plain;
  }();
  std::string name = plainName(shape_name);
  for (int pass = 0; pass < 2; ++pass) {
    const auto found = std::find(plain_names.begin(), plain_names.end(), name);
    if (found != plain_names.end()) return static_cast<int>(found - plain_names.begin());
    for (const std::string_view side : {"left", "right"}) {
      if (name.ends_with(side)) name.resize(name.size() - side.size());
    }
  }
  return -1;
}

/// Every weight in turn takes its best value for the others, until none changes. Each step lowers the energy, which is
/// convex.
RowMajorMatrixF fitShapeWeights(const Eigen::MatrixXf& shapes, const Eigen::MatrixXf& motion, std::size_t shape_count,
                                const ArkitOptions& options) {
  const Eigen::MatrixXd gram = (shapes.transpose() * shapes).cast<double>();
  const Eigen::MatrixXd right = (motion.transpose() * shapes).cast<double>();  // frames x 52
  const double energy = gram.trace() / std::max(asReal(shape_count), 1.0);
  const double pull = options.smoothness * energy;
  const double thrift = options.thrift * energy;
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  RowMajor weights = RowMajor::Zero(right.rows(), kShapes);
  for (int sweep = 0; sweep < kMostSweeps; ++sweep) {
    double change = 0;
    for (Eigen::Index step = 0; step < right.rows(); ++step) {
      const Eigen::Index t = sweep % 2 == 0 ? step : right.rows() - 1 - step;  // news travels both ways
      for (Eigen::Index k = 0; k < kShapes; ++k) {
        if (!(gram(k, k) > 0)) continue;
        double target = right(t, k) - gram.row(k).dot(weights.row(t)) + gram(k, k) * weights(t, k);
        double share = gram(k, k) + thrift;
        for (const Eigen::Index other : {t - 1, t + 1}) {
          if (other < 0 || other >= right.rows()) continue;
          target += pull * weights(other, k);
          share += pull;
        }
        const double best = std::clamp(target / share, 0.0, 1.0);
        change = std::max(change, std::abs(best - weights(t, k)));
        weights(t, k) = best;
      }
    }
    if (change < kStill) break;
  }
  return weights.cast<float>();
}

ArkitCurves fitArkit(const FaceAnimation& animation, const FaceMesh& mesh, const FaceShapes& shapes,
                     const ArkitOptions& options) {
  MOUTHPIECE_EXPECT(animation.positions.cols() == mesh.vertices.size());
  if (std::none_of(shapes.names.begin(), shapes.names.end(),
                   [](const std::string& name) { return arkitIndex(name) >= 0; })) {
    throw InputError(
        fmt::format("found {} morph targets, none with an ARKit name; expected a GLB with shapes such as "
                    "jawOpen and mouthSmile_L",
                    shapes.names.size()));
  }
  for (const VertexPositions& moves : shapes.moves) MOUTHPIECE_EXPECT(moves.rows() == mesh.vertices.rows());
  const Problem problem = problemOf(animation, mesh, shapes);
  ArkitCurves curves;
  curves.frame_rate_hz = animation.frame_rate_hz;
  curves.has_shape = problem.has_shape;
  const auto present = std::count(problem.has_shape.begin(), problem.has_shape.end(), true);
  curves.weights = fitShapeWeights(problem.shapes, problem.motion, unsignedIndex(present), options);
  const double mm_per_unit = 1000 * mesh.metres_per_unit;
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

std::string liveLinkCsv(const ArkitCurves& curves) {
  constexpr std::array<std::string_view, 9> kHeadAndEyes{"HeadYaw",     "HeadPitch",     "HeadRoll",
                                                         "LeftEyeYaw",  "LeftEyePitch",  "LeftEyeRoll",
                                                         "RightEyeYaw", "RightEyePitch", "RightEyeRoll"};
  std::string text = "Timecode,BlendShapeCount";
  for (const std::string_view name : kArkitNames) text.append(",").append(name);
  for (const std::string_view name : kHeadAndEyes) text.append(",").append(name);
  text += '\n';
  const auto frames_a_second = std::max<std::int64_t>(1, std::llround(curves.frame_rate_hz));
  for (Eigen::Index t = 0; t < curves.weights.rows(); ++t) {
    const std::int64_t seconds = t / frames_a_second;
    text += fmt::format("{:02}:{:02}:{:02}:{:02}.000,{}", seconds / 3600, seconds / 60 % 60, seconds % 60,
                        t % frames_a_second, kArkitNames.size() + kHeadAndEyes.size());
    for (Eigen::Index k = 0; k < kShapes; ++k) text += fmt::format(",{:.6f}", curves.weights(t, k));
    for (std::size_t k = 0; k < kHeadAndEyes.size(); ++k) text += ",0.000000";
    text += '\n';
  }
  return text;
}

std::string glbWithArkitAnimation(std::string_view glb, const std::string& file, const ArkitCurves& curves) {
  auto made = glbWithWeights(glb, file, curves.frame_rate_hz, curves.weights, arkitIndex);
  if (!made) throw InputError(file, "", "holds no shape with an ARKit name");
  return *std::move(made);
}

}  // namespace mouthpiece
