#include "exports/arkit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <concepts>
#include <limits>
#include <numeric>

#include "base/errors.h"
#include "base/index.h"
#include "deform/mesh/face_mesh.h"
#include "deform/topology/lip_slit.h"

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

/// The middle half of the slit of the mouth (its corners always touch): of each step across it the pair of vertices
/// that comes nearest in the motion. What counts is how much higher the upper one is, in mesh units: lips that roll
/// pass each other in depth.
struct Slit {
  std::vector<SlitPair> pairs;
  Eigen::MatrixXf shapes;   ///< pairs x 52: what the shapes part them by
  Eigen::MatrixXf heights;  ///< pairs x frames: of the motion
  Eigen::VectorXf at_rest;  ///< pairs
};

Eigen::VectorXf heightsOf(const SlitPair& pair, const RowMajorMatrixF& rows) {
  return rows.col(3 * signedIndex(pair.upper) + 1) - rows.col(3 * signedIndex(pair.lower) + 1);
}

/// Those of the middle half, of each step any number.
std::vector<SlitPair> middlePairs(const FaceMesh& mesh, const std::vector<DrivenShape>& driven) {
  VertexPositions jaw = VertexPositions::Zero(mesh.vertices.rows(), 3);
  for (const DrivenShape& shape : driven) {
    if (kArkitNames[unsignedIndex(shape.number)] == "JawOpen") jaw += shape.moves;
  }
  std::vector<SlitPair> pairs = lipSlit(mesh, jaw);
  std::erase_if(pairs, [](const SlitPair& pair) {
    return pair.step < kSlitSteps / 4 || pair.step >= kSlitSteps - kSlitSteps / 4;
  });
  return pairs;
}

/// `lowest`: of each of `pairs` its least height in the motion.
Slit slitOf(const std::vector<SlitPair>& pairs, const std::vector<float>& lowest, const FaceMesh& mesh,
            const std::vector<DrivenShape>& driven, Eigen::Index frame_count) {
  Slit slit;
  std::vector<float> kept;
  for (std::size_t i = 0; i < pairs.size() && frame_count > 0; ++i) {
    if (slit.pairs.empty() || slit.pairs.back().step != pairs[i].step) {
      slit.pairs.push_back(pairs[i]);
      kept.push_back(lowest[i]);
    } else if (lowest[i] < kept.back()) {
      slit.pairs.back() = pairs[i];
      kept.back() = lowest[i];
    }
  }
  const auto rows = signedIndex(slit.pairs.size());
  slit.shapes = Eigen::MatrixXf::Zero(rows, kShapes);
  slit.heights.resize(rows, frame_count);
  slit.at_rest.resize(rows);
  for (Eigen::Index row = 0; row < rows; ++row) {
    const Eigen::Index upper = slit.pairs[unsignedIndex(row)].upper, lower = slit.pairs[unsignedIndex(row)].lower;
    for (const DrivenShape& shape : driven)
      slit.shapes(row, shape.number) += shape.moves(upper, 1) - shape.moves(lower, 1);
    slit.at_rest(row) = mesh.vertices(upper, 1) - mesh.vertices(lower, 1);
  }
  return slit;
}

/// What a blink does to the lid's edge, which least squares over all of the lid, and what smooths and spares weights,
/// leave open in an eye that has closed.
struct LidEdge {
  Eigen::Index blink;              ///< number of the shape
  std::vector<Eigen::Index> rows;  ///< of the edge
  Eigen::VectorXf moves;           ///< rows: of the shape
  Eigen::RowVectorXf seen;         ///< frames: `moves` times the motion
};

std::vector<LidEdge> lidEdgesOf(const Eigen::MatrixXf& shapes, Eigen::Index frame_count) {
  constexpr float kEdge = 0.85F;  // of what the shape moves most
  std::vector<LidEdge> edges;
  for (const std::string_view name : {"EyeBlinkLeft", "EyeBlinkRight"}) {
    const Eigen::Index blink = arkitIndex(name);
    const auto lid = shapes.col(blink);
    float most = 0;
    for (Eigen::Index row = 0; row < lid.size(); row += 3) most = std::max(most, lid.segment<3>(row).norm());
    if (!(most > 0)) continue;
    LidEdge edge{blink, {}, {}, Eigen::RowVectorXf(frame_count)};
    for (Eigen::Index row = 0; row < lid.size(); row += 3) {
      if (lid.segment<3>(row).norm() >= kEdge * most) edge.rows.insert(edge.rows.end(), {row, row + 1, row + 2});
    }
    edge.moves = lid(edge.rows);
    edges.push_back(std::move(edge));
  }
  return edges;
}

/// What the fit asks of the motion of some vertices, three rows each, gathered frame by frame.
struct SeenMotion {
  Eigen::MatrixXf shapes;  ///< rows x 52
  RowMajorMatrixF seen;    ///< frames x 52: the motion times the shapes
  std::vector<LidEdge> lids;
  double squares = 0;  ///< of all motion

  SeenMotion(Eigen::MatrixXf shapes_of, Eigen::Index frame_count)
      : shapes(std::move(shapes_of)), seen(frame_count, kShapes), lids(lidEdgesOf(shapes, frame_count)) {}

  /// `motion`: rows x frames from `first` on.
  void add(Eigen::Index first, const Eigen::MatrixXf& motion) {
    seen.middleRows(first, motion.cols()) = motion.transpose() * shapes;
    for (LidEdge& lid : lids)
      lid.seen.segment(first, motion.cols()) = lid.moves.transpose() * motion(lid.rows, Eigen::all);
    for (Eigen::Index t = 0; t < motion.cols(); ++t) squares += static_cast<double>(motion.col(t).squaredNorm());
  }
};

/// How far `vertices` are from where they rest, 3 rows each x frames.
Eigen::MatrixXf motionOf(const RowMajorMatrixF& rows, std::span<const Eigen::Index> columns,
                         const Eigen::Ref<const VertexPositions>& rest) {
  Eigen::MatrixXf motion(3 * signedIndex(columns.size()), rows.rows());
  for (std::size_t i = 0; i < columns.size(); ++i) {
    motion.middleRows<3>(3 * signedIndex(i)) =
        (rows.middleCols<3>(3 * columns[i]).rowwise() - rest.row(signedIndex(i))).transpose();
  }
  return motion;
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
  // Without pairs the limits have no rows, and a column a frame as elsewhere.
  ShapeClosures closures{.shapes = slit.shapes, .least = slit.heights, .most = slit.heights};
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

/// A blink takes the lid's edge as far as the motion does.
void closeLids(const SeenMotion& motion, RowMajorMatrixF& weights) {
  constexpr float kWhole = 0.25F;  // weights below are left to fade out
  for (const LidEdge& lid : motion.lids) {
    const Eigen::RowVectorXf left =
        lid.seen - (lid.moves.transpose() * motion.shapes(lid.rows, Eigen::all)) * weights.transpose();
    for (Eigen::Index t = 0; t < weights.rows(); ++t) {
      float& weight = weights(t, lid.blink);
      weight = std::clamp(weight + std::min(weight / kWhole, 1.0F) * left(t) / lid.moves.squaredNorm(), 0.0F, 1.0F);
    }
  }
}

/// Skin that the frames or a shape move, and the pairs of the slit that come nearest in them.
struct MovingSkin {
  std::vector<Eigen::Index> vertices;
  VertexPositions rest;  ///< of these
  Slit slit;             ///< its heights not yet filled in
};

MovingSkin movingSkin(const FrameMaker& frames, const FaceMesh& mesh, const std::vector<DrivenShape>& driven,
                      const std::vector<bool>& is_bare) {
  const std::vector<Eigen::Index> skin = skinVertices(mesh);
  const std::vector<SlitPair> pairs = middlePairs(mesh, driven);
  std::vector<float> lowest(pairs.size(), std::numeric_limits<float>::max());
  std::vector<bool> moves(skin.size(), false);
  const float still = asFloat(1e-6 / mesh.metres_per_unit);
  for (std::size_t i = 0; i < skin.size(); ++i) {
    moves[i] = std::any_of(driven.begin(), driven.end(), [&](const DrivenShape& shape) {
      return shape.isSeenIn(skin[i], is_bare) && shape.moves.row(skin[i]).cwiseAbs().maxCoeff() > still;
    });
  }
  frames.inBlocks([&](Eigen::Index, const RowMajorMatrixF& rows) {
    for (std::size_t i = 0; i < skin.size(); ++i) {
      if (moves[i] || !is_bare[unsignedIndex(skin[i])]) continue;
      moves[i] = (rows.middleCols<3>(3 * skin[i]).rowwise() - mesh.vertices.row(skin[i])).cwiseAbs().maxCoeff() > still;
    }
    for (std::size_t i = 0; i < pairs.size(); ++i)
      lowest[i] = std::min(lowest[i], heightsOf(pairs[i], rows).minCoeff());
  });
  MovingSkin moving;
  for (std::size_t i = 0; i < skin.size(); ++i) {
    if (moves[i]) moving.vertices.push_back(skin[i]);
  }
  moving.rest = mesh.vertices(moving.vertices, Eigen::all);
  moving.slit = slitOf(pairs, lowest, mesh, driven, frames.frame_count);
  return moving;
}

/// (3 * vertices) x 52; shapes of one ARKit name are one.
Eigen::MatrixXf shapesOn(const std::vector<Eigen::Index>& vertices, const std::vector<DrivenShape>& driven,
                         const std::vector<bool>& is_bare) {
  Eigen::MatrixXf shapes = Eigen::MatrixXf::Zero(3 * signedIndex(vertices.size()), kShapes);
  for (const DrivenShape& shape : driven) {
    for (std::size_t i = 0; i < vertices.size(); ++i) {
      if (shape.isSeenIn(vertices[i], is_bare))
        shapes.block<3, 1>(3 * signedIndex(i), shape.number) += shape.moves.row(vertices[i]).transpose();
    }
  }
  return shapes;
}

/// The weights, and in how many frames lips meet. Where the weights leave lips apart that meet, they are asked for as
/// much more all over: the place that gapes alone is too little to be heard.
void fitMeetingLips(const SeenMotion& motion, const Slit& slit, double mm_per_unit, const ArkitOptions& options,
                    ArkitCurves& curves) {
  constexpr int kRounds = 5;
  const auto present = std::count(curves.has_shape.begin(), curves.has_shape.end(), true);
  ShapeClosures closures = closuresOf(slit, mm_per_unit);
  curves.closures = unsignedIndex(std::count(closures.in_frame.begin(), closures.in_frame.end(), true));
  const Eigen::MatrixXf meant = closures.most;
  for (int round = 0; round < kRounds; ++round) {
    RowMajorMatrixF weights = fitShapeWeights(motion.shapes, motion.seen, unsignedIndex(present), options, &closures);
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
}

/// What the weights leave of the motion.
void measureErrors(const FrameMaker& frames, const MovingSkin& skin, const SeenMotion& motion, double mm_per_unit,
                   ArkitCurves& curves) {
  double squares = 0;
  frames.inBlocks([&](Eigen::Index first, const RowMajorMatrixF& rows) {
    const Eigen::MatrixXf miss = motionOf(rows, skin.vertices, skin.rest) -
                                 motion.shapes * curves.weights.middleRows(first, rows.rows()).transpose();
    for (Eigen::Index t = 0; t < miss.cols(); ++t) {
      for (Eigen::Index row = 0; row < miss.rows(); row += 3) {
        const double square = static_cast<double>(miss.col(t).segment<3>(row).squaredNorm());
        curves.largest_error_mm = std::max(curves.largest_error_mm, mm_per_unit * std::sqrt(square));
        squares += square;
      }
    }
  });
  const double count = std::max(1.0, asReal(skin.vertices.size()) * asReal(frames.frame_count));
  curves.rms_error_mm = mm_per_unit * std::sqrt(squares / count);
  curves.rms_motion_mm = mm_per_unit * std::sqrt(motion.squares / count);
}

}  // namespace

ArkitCurves fitArkit(const FrameMaker& given, const FaceMesh& mesh, const FaceShapes& shapes,
                     const ArkitOptions& options) {
  MOUTHPIECE_EXPECT(given.width == mesh.vertices.size());
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
  const FrameMaker frames = heldIfShort(given);
  const std::vector<bool> is_bare = bareSkin(mesh);
  const std::vector<DrivenShape> driven = drivenShapes(shapes, is_bare);
  const double mm_per_unit = 1000 * mesh.metres_per_unit;

  MovingSkin skin = movingSkin(frames, mesh, driven, is_bare);
  SeenMotion motion(shapesOn(skin.vertices, driven, is_bare), frames.frame_count);
  frames.inBlocks([&](Eigen::Index first, const RowMajorMatrixF& rows) {
    motion.add(first, motionOf(rows, skin.vertices, skin.rest));
    for (std::size_t i = 0; i < skin.slit.pairs.size(); ++i)
      skin.slit.heights.row(signedIndex(i)).segment(first, rows.rows()) = heightsOf(skin.slit.pairs[i], rows);
  });
  ArkitCurves curves;
  curves.frame_rate_hz = frames.frame_rate_hz;
  curves.has_shape.assign(kArkitNames.size(), false);
  for (const DrivenShape& shape : driven) curves.has_shape[unsignedIndex(shape.number)] = true;
  fitMeetingLips(motion, skin.slit, mm_per_unit, options, curves);
  closeLids(motion, curves.weights);
  measureErrors(frames, skin, motion, mm_per_unit, curves);
  return curves;
}

RowMajorMatrixF takeLidsAndBrows(FrameMaker& frames, const FaceMesh& mesh, const FaceShapes& shapes) {
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
  if (own.empty() || frames.frame_count == 0) return {};
  std::vector<std::uint32_t> columns = frames.vertices;
  if (columns.empty()) {
    columns.resize(mesh.vertexCount());
    std::iota(columns.begin(), columns.end(), 0U);
  }
  // The region of a shape is where it does half of its most; further out it fades.
  std::vector<Eigen::Index> region;  // of `columns`
  std::vector<float> shares;         // how wholly each is the shapes'
  for (std::size_t i = 0; i < columns.size(); ++i) {
    float share = 0;
    for (const DrivenShape& shape : own) {
      if (shape.most > 0) share = std::max(share, 2 * shape.moves.row(columns[i]).norm() / shape.most);
    }
    if (share <= 0.1F) continue;
    region.push_back(signedIndex(i));
    shares.push_back(std::min(share, 1.0F));
  }
  if (region.empty()) return {};
  const auto count = signedIndex(region.size());
  Eigen::MatrixXf moves = Eigen::MatrixXf::Zero(3 * count, kShapes), seen = moves;
  VertexPositions rest(count, 3);
  for (Eigen::Index r = 0; r < count; ++r) {
    const std::uint32_t v = columns[unsignedIndex(region[unsignedIndex(r)])];
    rest.row(r) = mesh.vertices.row(v);
    for (const DrivenShape& shape : own) {
      moves.block<3, 1>(3 * r, shape.number) += shape.moves.row(v).transpose();
      if (shape.isSeenIn(v, is_bare)) seen.block<3, 1>(3 * r, shape.number) += shape.moves.row(v).transpose();
    }
  }
  SeenMotion motion(std::move(seen), frames.frame_count);
  const FrameMaker whole = std::move(frames);  // made anew each time: held they would take most of a GLB's memory
  whole.inBlocks(
      [&](Eigen::Index first, const RowMajorMatrixF& rows) { motion.add(first, motionOf(rows, region, rest)); });
  RowMajorMatrixF weights = fitShapeWeights(motion.shapes, motion.seen, own.size());
  closeLids(motion, weights);
  constexpr float kSeen = 0.02F;  // a shape that never does more is left alone
  for (Eigen::Index k = 0; k < kShapes; ++k) {
    if (weights.col(k).maxCoeff() < kSeen) weights.col(k).setZero();
  }
  frames = whole;
  if (weights.maxCoeff() <= 0) return {};
  frames.make = [=](Eigen::Index frame, std::span<float> out) {
    whole.make(frame, out);
    const Eigen::VectorXf done = moves * weights.row(frame).transpose();
    for (Eigen::Index r = 0; r < count; ++r) {
      Eigen::Map<Eigen::Vector3f> place(&out[unsignedIndex(3 * region[unsignedIndex(r)])]);
      const Eigen::Vector3f home = rest.row(r);
      place = home + (1 - shares[unsignedIndex(r)]) * (place - home - done.segment<3>(3 * r));
    }
  };
  return weights;
}

}  // namespace mouthpiece
