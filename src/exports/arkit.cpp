#include "exports/arkit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "base/errors.h"
#include "base/index.h"
#include "deform/mesh/face_mesh.h"
#include "deform/mesh/lip_slit.h"
#include "exports/gltf/glb.h"

namespace mouthpiece {
namespace {

constexpr Eigen::Index kShapes = signedIndex(kArkitNames.size());
constexpr int kMostSweeps = 400;
constexpr double kStill = 1e-4;  ///< largest change of a weight in a sweep that ends the search

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

/// Numbers of two shapes, by name.
using ShapePair = std::array<Eigen::Index, 2>;
Eigen::Index numberOf(std::string_view name) {
  const auto found = std::find(kArkitNames.begin(), kArkitNames.end(), name);
  MOUTHPIECE_EXPECT(found != kArkitNames.end());
  return found - kArkitNames.begin();
}

/// No animator sets both of these.
const std::vector<ShapePair>& opposingShapes() {
  static const std::vector<ShapePair> pairs = [] {
    std::vector<ShapePair> list;
    for (const auto& [one, other] :
         std::initializer_list<std::pair<const char*, const char*>>{{"JawLeft", "JawRight"},
                                                                    {"MouthLeft", "MouthRight"},
                                                                    {"MouthSmileLeft", "MouthFrownLeft"},
                                                                    {"MouthSmileRight", "MouthFrownRight"},
                                                                    {"MouthPucker", "MouthStretchLeft"},
                                                                    {"MouthPucker", "MouthStretchRight"},
                                                                    {"MouthPucker", "MouthSmileLeft"},
                                                                    {"MouthPucker", "MouthSmileRight"},
                                                                    {"MouthFunnel", "MouthPressLeft"},
                                                                    {"MouthFunnel", "MouthPressRight"},
                                                                    {"MouthRollLower", "MouthLowerDownLeft"},
                                                                    {"MouthRollLower", "MouthLowerDownRight"},
                                                                    {"MouthRollUpper", "MouthUpperUpLeft"},
                                                                    {"MouthRollUpper", "MouthUpperUpRight"},
                                                                    {"EyeBlinkLeft", "EyeWideLeft"},
                                                                    {"EyeBlinkRight", "EyeWideRight"},
                                                                    {"BrowDownLeft", "BrowOuterUpLeft"},
                                                                    {"BrowDownRight", "BrowOuterUpRight"}})
      list.push_back({numberOf(one), numberOf(other)});
    return list;
  }();
  return pairs;
}

/// Of each shape its mirror image; -1 where it has none, or where the two undo each other.
std::vector<Eigen::Index> mirrorShapes() {
  std::vector<Eigen::Index> mirrors(kArkitNames.size(), -1);
  for (std::size_t k = 0; k < kArkitNames.size(); ++k) {
    const std::string_view name = kArkitNames[k];
    if (!name.ends_with("Left") || name == "JawLeft" || name == "MouthLeft") continue;
    const Eigen::Index right = numberOf(std::string(name.substr(0, name.size() - 4)) + "Right");
    mirrors[k] = right;
    mirrors[unsignedIndex(right)] = signedIndex(k);
  }
  return mirrors;
}

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Every weight in turn takes its best value for the others, until none changes. Each step lowers the energy, which is
/// convex while no weight is shut.
class WeightDescent {
 public:
  WeightDescent(const Eigen::MatrixXf& shapes, const Eigen::MatrixXf& motion, std::size_t shape_count,
                const ArkitOptions& options, const ShapeClosures* closures)
      : gram_((shapes.transpose() * shapes).cast<double>()),
        right_((motion.transpose() * shapes).cast<double>()),
        weights_(RowMajor::Zero(motion.cols(), kShapes)),
        pulled_(RowMajor::Zero(motion.cols(), kShapes)),
        shut_(decltype(shut_)::Zero(motion.cols(), kShapes)) {
    for (Eigen::Index k = 0; k < kShapes; ++k) {
      if (gram_(k, k) > 0) present_.push_back(k);
      Eigen::Index& mirror = mirrors_[unsignedIndex(k)];
      if (mirror >= 0 && !(gram_(mirror, mirror) > 0)) mirror = -1;
    }
    has_jaw_ = gram_(jaw_, jaw_) > 0;
    const double energy = gram_.trace() / std::max(asReal(shape_count), 1.0);
    pull_ = options.smoothness * energy;
    thrift_ = options.thrift * energy;
    push_ = options.sparsity * energy;
    symmetry_ = options.symmetry * energy;
    if (closures == nullptr || closures->shapes.rows() == 0) return;
    // A pair counts as so many of the vertices around it.
    const double share = options.closure * asReal(shapes.rows()) / (100 * asReal(closures->shapes.rows()));
    closed_gram_ = gram_ + share * (closures->shapes.transpose() * closures->shapes).cast<double>();
    closed_ = closures->in_frame;
    for (std::size_t t = 0; t < closed_.size(); ++t) {
      if (closed_[t])
        right_.row(signedIndex(t)) +=
            share * (closures->motion.col(signedIndex(t)).transpose() * closures->shapes).cast<double>();
    }
  }

  void descend() {
    for (int sweep = 0; sweep < kMostSweeps; ++sweep) {
      double change = 0;
      for (Eigen::Index step = 0; step < weights_.rows(); ++step) {
        const Eigen::Index t = sweep % 2 == 0 ? step : weights_.rows() - 1 - step;  // news travels both ways
        change = std::max(change, settle(t));
      }
      if (change < kStill) break;
    }
  }

  /// Of two shapes that undo each other the one goes that does less around the frame. True when any did.
  bool shutOpposing() {
    constexpr Eigen::Index kAround = 4;  // frames to each side: neighbours decide alike
    bool any = false;
    for (const auto& [one, other] : opposingShapes()) {
      for (Eigen::Index t = 0; t < weights_.rows(); ++t) {
        if (weights_(t, one) < kZero || weights_(t, other) < kZero) continue;
        const Eigen::Index first = std::max<Eigen::Index>(0, t - kAround),
                           last = std::min(weights_.rows() - 1, t + kAround);
        const auto doneBy = [&](Eigen::Index k) {
          return weights_.col(k).segment(first, last - first + 1).sum() * std::sqrt(gram_(k, k));
        };
        const Eigen::Index less = doneBy(one) < doneBy(other) ? one : other;
        shut_(t, less) = 1;
        set(t, less, 0);
        any = true;
      }
    }
    return any;
  }

  [[nodiscard]] RowMajorMatrixF weights() const {
    return (weights_.array() < kZero).select(0.0, weights_).cast<float>();
  }

 private:
  static constexpr double kZero = 0.004;  ///< nobody sees less

  /// Settles all weights of a frame, each in turn; returns the largest change.
  double settle(Eigen::Index t) {
    const Eigen::MatrixXd& gram = gramAt(t);
    const double* const right = &right_(t, 0);
    const double* const pulled = &pulled_(t, 0);
    const double* const weights = &weights_(t, 0);
    const double* const before = t > 0 ? weights - kShapes : nullptr;
    const double* const after = t + 1 < weights_.rows() ? weights + kShapes : nullptr;
    const double around = thrift_ + (before ? pull_ : 0) + (after ? pull_ : 0);
    double largest = 0;
    for (const Eigen::Index k : present_) {
      if (!mayMove(t, k)) continue;
      const double own = gram(k, k);
      double target = right[k] - push_ - pulled[k] + own * weights[k];
      double share = own + around;
      if (before) target += pull_ * before[k];
      if (after) target += pull_ * after[k];
      if (const Eigen::Index mirror = mirrors_[unsignedIndex(k)]; mirror >= 0) {
        target += symmetry_ * weights[mirror];
        share += symmetry_;
      }
      const double least = k == jaw_ ? weights[close_] : 0.0;
      if (target <= 0 && weights[k] == 0 && least == 0) continue;  // most weights rest most of the time
      const double most = k == close_ && has_jaw_ ? weights[jaw_] : 1.0;
      const double best = std::clamp(target / share, least, most);
      largest = std::max(largest, std::abs(best - weights[k]));
      set(t, k, best);
    }
    return largest;
  }

  [[nodiscard]] bool mayMove(Eigen::Index t, Eigen::Index k) const { return shut_(t, k) == 0; }

  [[nodiscard]] const Eigen::MatrixXd& gramAt(Eigen::Index t) const {
    return !closed_.empty() && closed_[unsignedIndex(t)] ? closed_gram_ : gram_;
  }

  /// Most weights rest most of the time: the products follow what changes, instead of being made again.
  void set(Eigen::Index t, Eigen::Index k, double weight) {
    const double change = weight - weights_(t, k);
    if (change == 0) return;
    pulled_.row(t) += change * gramAt(t).col(k).transpose();
    weights_(t, k) = weight;
  }

  Eigen::MatrixXd gram_;  ///< 52 x 52
  RowMajor right_;        ///< frames x 52, as those that follow
  RowMajor weights_;
  RowMajor pulled_;  ///< of each frame the Gram matrix times the weights
  Eigen::Matrix<std::uint8_t, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> shut_;  ///< 1: stays 0
  Eigen::MatrixXd closed_gram_;  ///< of frames in which the lips meet
  std::vector<bool> closed_;
  std::vector<Eigen::Index> mirrors_ = mirrorShapes();  ///< -1 also where the head has no mirror image
  std::vector<Eigen::Index> present_;                   ///< shapes that the head has
  Eigen::Index jaw_ = numberOf("JawOpen"), close_ = numberOf("MouthClose");
  bool has_jaw_ = false;
  double pull_ = 0, thrift_ = 0, push_ = 0, symmetry_ = 0;
};

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

/// Lips that meet are asked to meet all over: the shapes give in where they cannot.
void tighten(const std::vector<double>& gapes, double mm_per_unit, ShapeClosures& closures) {
  for (std::size_t t = 0; t < gapes.size(); ++t) {
    const float shift = asFloat(std::max(0.0, gapes[t] - kTightMm) / mm_per_unit);
    for (Eigen::Index row = 1; closures.in_frame[t] && row < closures.motion.rows(); row += 3)
      closures.motion(row, signedIndex(t)) -= shift;
  }
}

}  // namespace

RowMajorMatrixF fitShapeWeights(const Eigen::MatrixXf& shapes, const Eigen::MatrixXf& motion, std::size_t shape_count,
                                const ArkitOptions& options, const ShapeClosures* closures) {
  WeightDescent descent(shapes, motion, shape_count, options, closures);
  descent.descend();
  // What one of two may do changes once the other is shut, and may meet a third.
  constexpr int kRounds = 4;
  for (int round = 0; round < kRounds && descent.shutOpposing(); ++round) descent.descend();
  descent.shutOpposing();
  return descent.weights();
}

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
  for (const double gape : gapes) closures.in_frame.push_back(!slit.empty() && gape < kMeetMm);
  tighten(gapes, mm_per_unit, closures);
  closures.motion.colwise() -= at_rest;
  // Where the weights leave lips apart that meet, they are asked for as much more.
  constexpr int kRounds = 5;
  for (int round = 0; round < kRounds; ++round) {
    RowMajorMatrixF weights =
        fitShapeWeights(problem.shapes, problem.motion, unsignedIndex(present), options, &closures);
    std::vector<double> apart = gapesOf(slit, (closures.shapes * weights.transpose()).colwise() + at_rest, mm_per_unit);
    std::size_t kept = 0;
    for (std::size_t t = 0; t < apart.size(); ++t) {
      if (closures.in_frame[t] && apart[t] < kMeetMm) ++kept;
      if (!closures.in_frame[t] || apart[t] < kMeetMm) apart[t] = 0;
    }
    if (round == 0 || kept > curves.closures_kept) {
      curves.weights = std::move(weights);
      curves.closures_kept = kept;
    }
    curves.closures = unsignedIndex(std::count(closures.in_frame.begin(), closures.in_frame.end(), true));
    if (curves.closures_kept == curves.closures) break;
    tighten(apart, mm_per_unit, closures);
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
    const HeadTurn head = curves.head.empty() ? HeadTurn{} : curves.head[unsignedIndex(t)];
    const GazeTurn eye = curves.gaze.empty() ? GazeTurn{} : curves.gaze[unsignedIndex(t)];
    for (const float turn : {head.yaw, head.pitch, head.roll, eye.yaw, eye.pitch, 0.0F, eye.yaw, eye.pitch, 0.0F})
      text += fmt::format(",{:.6f}", turn);
    text += '\n';
  }
  return text;
}

std::string glbWithArkitAnimation(std::string_view glb, const std::string& file, const ArkitCurves& curves) {
  auto made = glbWithWeights(glb, file, curves.frame_rate_hz, {curves.weights, arkitIndex});
  if (!made) throw InputError(file, "", "holds no shape with an ARKit name");
  return *std::move(made);
}

}  // namespace mouthpiece
