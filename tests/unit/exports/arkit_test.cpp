// ARKit's curves from a moving face.
#include "exports/arkit.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <random>
#include <set>

#include "base/errors.h"
#include "base/files.h"
#include "deform/mesh/face_mesh.h"
#include "deform/topology/lip_slit.h"
#include "motion/lip_gauge.h"

namespace mouthpiece {
namespace {

constexpr float kWeightWithin = 0.02F;  ///< what thrift and smoothness take away

/// A strip of skin with shapes of ARKit's names that move separate vertices.
struct Head {
  FaceMesh mesh;
  FaceShapes shapes;
};

Head headWith(const std::vector<std::string>& names) {
  Head head;
  const auto count = static_cast<Eigen::Index>(2 * names.size() + 2);
  head.mesh.vertices = VertexPositions::Zero(count, 3);
  for (Eigen::Index v = 0; v < count; ++v) head.mesh.vertices.row(v) << static_cast<float>(v), float(v % 2), 0;
  for (std::uint32_t v = 0; v + 2 < count; ++v) head.mesh.triangles.push_back({v, v + 1, v + 2});
  head.mesh.parts = {{.name = "skin", .triangle_count = head.mesh.triangles.size()}};
  for (std::size_t s = 0; s < names.size(); ++s) {
    head.shapes.names.push_back(names[s]);
    head.shapes.moves.push_back(VertexPositions::Zero(count, 3));
    head.shapes.moves.back().row(static_cast<Eigen::Index>(2 * s)) << 0, -8, 2;
    head.shapes.moves.back().row(static_cast<Eigen::Index>(2 * s + 1)) << 1, -3, 0;
  }
  return head;
}

FaceAnimation animationOf(const Head& head, const Eigen::MatrixXf& weights) {
  FaceAnimation animation{60, {}};
  animation.positions.resize(weights.rows(), head.mesh.vertices.size());
  for (Eigen::Index t = 0; t < weights.rows(); ++t) {
    VertexPositions frame = head.mesh.vertices;
    for (std::size_t s = 0; s < head.shapes.moves.size(); ++s)
      frame += weights(t, static_cast<Eigen::Index>(s)) * head.shapes.moves[s];
    animation.positions.row(t) = Eigen::Map<const Eigen::RowVectorXf>(frame.data(), frame.size());
  }
  return animation;
}

TEST(Arkit, KnowsTheNamesThatHeadsUse) {
  EXPECT_EQ(kArkitNames[static_cast<std::size_t>(arkitIndex("jawOpen"))], "JawOpen");
  EXPECT_EQ(kArkitNames[static_cast<std::size_t>(arkitIndex("mouthSmile_L"))], "MouthSmileLeft");
  EXPECT_EQ(kArkitNames[static_cast<std::size_t>(arkitIndex("mouthSmileRight"))], "MouthSmileRight");
  EXPECT_EQ(kArkitNames[static_cast<std::size_t>(arkitIndex("browInnerUp_R"))], "BrowInnerUp");
  EXPECT_EQ(kArkitNames[static_cast<std::size_t>(arkitIndex("jawLeft"))], "JawLeft");
  EXPECT_EQ(arkitIndex("cheekRaiser_L"), -1);
  EXPECT_EQ(arkitIndex(""), -1);
}

TEST(Arkit, FindsTheWeightsThatMadeAMotion) {
  const Head head = headWith({"jawOpen", "mouthSmile_L", "mouthSmile_R", "browInnerUp_L", "browInnerUp_R"});
  Eigen::MatrixXf weights(40, 5);
  for (Eigen::Index t = 0; t < weights.rows(); ++t) {
    const float way = 0.5F - 0.5F * std::cos(0.15F * static_cast<float>(t));
    weights.row(t) << 0.8F * way, 0.3F * way, 0.6F, 0.4F * way, 0.4F * way;
  }
  const ArkitCurves curves = fitArkit(framesOf(animationOf(head, weights)), head.mesh, head.shapes);
  for (Eigen::Index s = 0; s < weights.cols(); ++s) {
    const int shape = arkitIndex(head.shapes.names[static_cast<std::size_t>(s)]);
    EXPECT_LT((curves.weights.col(shape) - weights.col(s)).cwiseAbs().maxCoeff(), kWeightWithin)
        << head.shapes.names[static_cast<std::size_t>(s)];
  }
  EXPECT_LT(curves.rms_error_mm, 0.02 * curves.rms_motion_mm);
}

TEST(Arkit, KeepsWeightsBetweenZeroAndOne) {
  const Head head = headWith({"jawOpen", "mouthPucker"});
  Eigen::MatrixXf weights = Eigen::MatrixXf::Constant(10, 2, 1.7F);
  weights.col(1).setConstant(-0.4F);
  const ArkitCurves curves = fitArkit(framesOf(animationOf(head, weights)), head.mesh, head.shapes);
  EXPECT_GE(curves.weights.minCoeff(), 0);
  EXPECT_LE(curves.weights.maxCoeff(), 1);
  EXPECT_EQ(curves.weights.col(arkitIndex("mouthPucker")).maxCoeff(), 0);
  EXPECT_GT(curves.largest_error_mm, 1);
}

TEST(Arkit, SmoothnessTakesTremblingAway) {
  const Head head = headWith({"jawOpen", "mouthFunnel"});
  std::mt19937 random(7);
  std::normal_distribution<float> noise(0.5F, 0.05F);
  Eigen::MatrixXf weights(80, 2);
  for (Eigen::Index i = 0; i < weights.size(); ++i) weights.data()[i] = noise(random);
  const auto change = [&](double smoothness) {
    const ArkitCurves curves =
        fitArkit(framesOf(animationOf(head, weights)), head.mesh, head.shapes, {.smoothness = smoothness});
    const Eigen::VectorXf jaw = curves.weights.col(arkitIndex("jawOpen"));
    return (jaw.tail(79) - jaw.head(79)).norm();
  };
  EXPECT_LT(change(2), 0.5F * change(0));
}

/// A lid of skin that EyeBlinkLeft closes and lashes on it, whose tips go twice as far; brows that are a mesh of their
/// own. The motion blinks for 10 of 60 frames, the lashes go as the lid does, and the brows rise by half.
TEST(Arkit, BlinksAsFarAsTheLidWhateverItsLashesDo) {
  Head head;
  constexpr Eigen::Index kLid = 30, kLashes = 90, kBrow = 20, kAll = kLid + kLashes + kBrow;
  head.mesh.vertices = VertexPositions::Zero(kAll, 3);
  head.mesh.metres_per_unit = 0.001;
  for (Eigen::Index v = 0; v < kAll; ++v) head.mesh.vertices.row(v) << static_cast<float>(v), float(v % 2), 0;
  Eigen::Index first = 0;
  for (const auto& [name, count] : {std::pair("skin", kLid), {"lashes", kLashes}, {"brow", kBrow}}) {
    const std::size_t before = head.mesh.triangles.size();
    for (Eigen::Index v = first; v + 2 < first + count; ++v) {
      const auto at = static_cast<std::uint32_t>(v);
      head.mesh.triangles.push_back({at, at + 1, at + 2});
    }
    head.mesh.parts.push_back({.name = name,
                               .first_triangle = before,
                               .triangle_count = head.mesh.triangles.size() - before,
                               .stands_off = first > 0});
    first += count;
  }
  head.shapes.names = {"eyeBlinkLeft", "browInnerUp"};
  head.shapes.moves = {VertexPositions::Zero(kAll, 3), VertexPositions::Zero(kAll, 3)};
  VertexPositions closed = VertexPositions::Zero(kAll, 3);
  for (Eigen::Index v = 0; v < kLid + kLashes; ++v) {
    const float way = v < kLid ? 10 * static_cast<float>(v) / (kLid - 1) : 10;  // to the lid's edge
    closed.row(v) << 0, -way, 0;
    head.shapes.moves[0].row(v) << 0, v < kLid ? -way : -2 * way, 0;
  }
  head.shapes.moves[1].bottomRows(kBrow).col(1).setConstant(5);
  FaceAnimation animation{60, {}};
  animation.positions.resize(60, 3 * kAll);
  for (Eigen::Index t = 0; t < 60; ++t) {
    VertexPositions frame = head.mesh.vertices + 0.5F * head.shapes.moves[1];
    if (t >= 30 && t < 40) frame += closed;
    animation.positions.row(t) = Eigen::Map<const Eigen::RowVectorXf>(frame.data(), frame.size());
  }
  const Eigen::Index blink = arkitIndex("eyeBlinkLeft"), brow = arkitIndex("browInnerUp");
  const ArkitCurves curves = fitArkit(framesOf(animation), head.mesh, head.shapes);
  FrameMaker frames = framesOf(animation);
  int made = 0;
  frames.make = [&made, make = frames.make](Eigen::Index frame, std::span<float> out) {
    ++made;
    make(frame, out);
  };
  const RowMajorMatrixF taken = takeLidsAndBrows(frames, head.mesh, head.shapes);
  const FaceAnimation left = frames.all();
  EXPECT_EQ(made, 2 * 60) << "frames that are held take room";
  for (const RowMajorMatrixF& weights : {curves.weights, taken}) {
    EXPECT_GT(weights(35, blink), 0.98F);
    EXPECT_EQ(weights(10, blink), 0);
    EXPECT_NEAR(weights(35, brow), 0.5F, kWeightWithin);
  }
  head.shapes.names[0] = "blink";
  FrameMaker again = framesOf(animation);
  EXPECT_EQ(takeLidsAndBrows(again, head.mesh, head.shapes), taken) << "both eyes' is the left one's";
  head.shapes.names[1] = "eyeBlinkRight";
  again = framesOf(animation);
  EXPECT_EQ(takeLidsAndBrows(again, head.mesh, head.shapes).col(blink).maxCoeff(), 0) << "one eye's goes before";
  for (Eigen::Index v = kLid / 2 + 1; v < kLid; ++v)
    EXPECT_NEAR(left.positions(35, 3 * v + 1), head.mesh.vertices(v, 1), 1e-3F) << "the shape alone moves the lid";
}

TEST(Arkit, RefusesAHeadWithoutSuchShapes) {
  const Head head = headWith({"happy", "sad"});
  EXPECT_THROW((void)fitArkit(framesOf(animationOf(head, Eigen::MatrixXf::Zero(3, 2))), head.mesh, head.shapes),
               InputError);
}

TEST(Arkit, ShapesOfAnotherMeshAreRefused) {
  Head head = headWith({"jawOpen", "mouthSmile_L", "mouthSmile_R"});
  const FaceAnimation animation = animationOf(head, Eigen::MatrixXf::Zero(3, 3));
  for (VertexPositions& moves : head.shapes.moves) moves.conservativeResize(moves.rows() + 1000, 3);
  EXPECT_THROW((void)fitArkit(framesOf(animation), head.mesh, head.shapes), InputError);
}

TEST(Arkit, CsvHasALineAFrameAndLiveLinksColumns) {
  ArkitCurves curves{.frame_rate_hz = 60, .weights = RowMajorMatrixF::Constant(121, 52, 0.25F), .has_shape = {}};
  const std::string csv = liveLinkCsv(curves);
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 122);
  EXPECT_TRUE(csv.starts_with("Timecode,BlendShapeCount,EyeBlinkLeft,"));
  EXPECT_NE(csv.find("\n00:00:02:00.000,61,0.250000,"), std::string::npos);
  const std::string first = csv.substr(csv.find('\n') + 1, csv.find('\n', csv.find('\n') + 1) - csv.find('\n') - 1);
  EXPECT_EQ(std::count(first.begin(), first.end(), ','), 62);
}

TEST(Arkit, AnimatesAGivenGlbAndKeepsTheRest) {
  const std::filesystem::path path =
      std::filesystem::path(MOUTHPIECE_SOURCE_DIR) / ".." / "shared" / "faces" / "ict_arkit.glb";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "../shared/faces/ict_arkit.glb is not here";
  const std::string given = readFile(path);
  const FaceShapes shapes = parseFaceShapes(given, path);
  EXPECT_EQ(shapes.names.size(), 55U);
  const auto known = std::count_if(shapes.names.begin(), shapes.names.end(),
                                   [](const std::string& name) { return arkitIndex(name) >= 0; });
  EXPECT_EQ(known, 53);  // all but the cheek raisers
  ArkitCurves curves{.frame_rate_hz = 60, .weights = RowMajorMatrixF::Zero(30, 52), .has_shape = {}};
  curves.weights.col(arkitIndex("jawOpen")).setLinSpaced(0, 1);
  const std::string made = glbWithArkitAnimation(given, path.string(), curves);
  const FaceMesh before = parseFaceMesh(given, path), after = parseFaceMesh(made, path);
  EXPECT_EQ(before.vertices, after.vertices);
  EXPECT_EQ(before.parts.size(), after.parts.size());
  const auto chunk = nlohmann::json::parse(made.substr(20, *reinterpret_cast<const std::uint32_t*>(made.data() + 12)));
  ASSERT_EQ(chunk.at("animations").size(), 1U);
  const auto& sampler = chunk["animations"][0]["samplers"][0];
  EXPECT_EQ(chunk["accessors"][sampler["output"].get<std::size_t>()]["count"], 30 * 55);
  EXPECT_EQ(chunk["materials"].size(), 12U);
}

TEST(Arkit, RefusesADamagedGlb) {
  const ArkitCurves curves{.frame_rate_hz = 60, .weights = RowMajorMatrixF::Zero(2, 52), .has_shape = {}};
  for (const std::string bad : {"", "glTF", "glTF\2\0\0\0aaaaaaaaaaaaaaaaaaaaaaaa"})
    EXPECT_THROW((void)glbWithArkitAnimation(bad, "x.glb", curves), InputError);
}

/// A mouth that opens, closes from frame 20 to 39 with the jaw still down, and opens again, as markers of the learnt
/// head; the lips' outer edges are pressed or stretched by `off_mm` meanwhile, as those of touching lips are.
struct Closing {
  MotionClip motion;
  std::vector<LipPose> lips;

  explicit Closing(double off_mm) {
    const ArkitMarkerMoves& learnt = arkitMarkerMoves();
    const auto moves = [&](std::string_view shape) {
      return Eigen::Map<const Eigen::RowVectorXd>(learnt.moves_mm[static_cast<std::size_t>(arkitIndex(shape))].data(),
                                                  learnt.neutral_mm.size());
    };
    const LipGauge gauge(learnt.markers);
    motion.frame_rate_hz = 60;
    motion.marker_names = learnt.markers;
    motion.positions_mm.resize(60, learnt.neutral_mm.size());
    for (Eigen::Index t = 0; t < 60; ++t) {
      const bool is_closed = t >= 20 && t < 40;
      auto row = motion.positions_mm.row(t);
      row = Eigen::Map<const Eigen::RowVectorXd>(learnt.neutral_mm.data(), learnt.neutral_mm.size());
      row += (is_closed ? 0.15 : 0.4) * moves("JawOpen");
      if (is_closed) row += 0.12 * moves("MouthClose");
      if (is_closed) row(gauge.column(MarkerRole::kLowerLip) + 1) -= off_mm;
      lips.push_back({.seal = is_closed ? 1.0F : 0.0F});
    }
  }
};

TEST(ArkitMarkers, LipsThatTouchTouchOnTheHeadToo) {
  constexpr double kTouchMm = 0.5;
  const ArkitMarkerMoves& learnt = arkitMarkerMoves();
  for (const double off_mm : {-1.0, 0.0, 2.0}) {
    const Closing closing(off_mm);
    const RowMajorMatrixF weights = arkitFromMarkers(closing.motion, &learnt.neutral_mm, closing.lips);
    const Eigen::MatrixXd parted = learnt.rims_parted_mm * weights.cast<double>().transpose();
    EXPECT_LT(parted.middleCols(21, 18).maxCoeff(), kTouchMm) << off_mm;
    EXPECT_GT(parted.middleCols(21, 18).minCoeff(), -2 * kTouchMm) << off_mm;
    EXPECT_GT(parted.leftCols(18).minCoeff(), 5) << "an open mouth stays open";
  }
}

TEST(ArkitMarkers, RoundedLipsPuckerByWhatTheCaptureHasNotSeen) {
  Closing closing(0);
  const LipRounding unseen{.narrowing = 0.14, .protrusion = 0.08};
  const auto puckerOf = [&](const LipRounding& rounding) {
    const RowMajorMatrixF weights =
        arkitFromMarkers(closing.motion, &arkitMarkerMoves().neutral_mm, closing.lips, rounding);
    return weights.col(arkitIndex("MouthPucker")).head(18).maxCoeff();
  };
  EXPECT_LT(puckerOf(unseen), 0.05F) << "lips that are not rounded";
  for (LipPose& lips : closing.lips) lips.rounding = 1;
  EXPECT_GT(puckerOf(unseen), 0.3F);
  EXPECT_LT(puckerOf({}), 0.05F) << "all of it was seen";
}

/// Of ways to close lips that are as good as each other the one is taken that animators take.
TEST(FitShapeWeights, ClosedLipsArePressed) {
  const int roll = arkitIndex("MouthRollUpper"), press = arkitIndex("MouthPressLeft");
  Eigen::MatrixXf shapes = Eigen::MatrixXf::Zero(2, 52);
  shapes(0, roll) = shapes(0, press) = shapes(1, roll) = shapes(1, press) = 1;
  const Eigen::MatrixXf motion = Eigen::MatrixXf::Constant(2, 12, 0.5F);
  ShapeClosures closures{shapes, motion, motion, std::vector<bool>(12, false)};
  for (std::size_t t = 6; t < 12; ++t) closures.in_frame[t] = true;
  const RowMajorMatrixF weights = fitShapeWeights(shapes, motion.transpose() * shapes, 2,
                                                  {.smoothness = 0, .thrift = 0.01, .press = 0.05}, &closures);
  EXPECT_NEAR(weights(2, roll), weights(2, press), 0.05F);
  EXPECT_GT(weights(9, press), weights(9, roll) + 0.2F);
  for (Eigen::Index t = 0; t < 12; ++t) EXPECT_NEAR(weights(t, roll) + weights(t, press), 0.5F, 0.05F);
}

/// Places that meet are left where the motion has them within their bounds, and brought there from outside.
TEST(FitShapeWeights, PlacesThatMeetStayWithinTheirBounds) {
  const int open = arkitIndex("JawOpen");
  Eigen::MatrixXf shapes = Eigen::MatrixXf::Zero(2, 52);
  shapes(0, open) = 1;
  shapes(1, arkitIndex("MouthFunnel")) = 1;
  const Eigen::MatrixXf motion = Eigen::MatrixXf::Constant(2, 4, 0.5F);
  const auto opens = [&](float least, float most) {
    const ShapeClosures closures{shapes.topRows(1), Eigen::MatrixXf::Constant(1, 4, least),
                                 Eigen::MatrixXf::Constant(1, 4, most), std::vector<bool>(4, true)};
    return fitShapeWeights(shapes, motion.transpose() * shapes, 2, {.closure = 10'000}, &closures)(1, open);
  };
  EXPECT_NEAR(opens(0.2F, 0.8F), 0.5F, kWeightWithin);
  EXPECT_NEAR(opens(0.2F, 0.3F), 0.3F, kWeightWithin);
  EXPECT_NEAR(opens(0.6F, 0.8F), 0.6F, kWeightWithin);
}

/// The chin opens and the lips stay, pressed on each other: MouthClose as much as JawOpen. (Each in turn at its best
/// for the other they stopped at 0.3.)
TEST(FitShapeWeights, TheJawOpensBehindClosedLips) {
  const int open = arkitIndex("JawOpen"), close = arkitIndex("MouthClose");
  Eigen::MatrixXf shapes = Eigen::MatrixXf::Zero(2, 52), motion(2, 6);
  shapes.col(open) << 1, 1;
  shapes.col(close) << -1, 0;
  motion.row(0).setConstant(-0.2F);
  motion.row(1).setConstant(0.5F);
  const RowMajorMatrixF weights = fitShapeWeights(shapes, motion.transpose() * shapes, 2);
  EXPECT_NEAR(weights(3, open), 0.5F, kWeightWithin);
  EXPECT_EQ(weights(3, close), weights(3, open));
  motion.row(0).setConstant(0);
  motion.row(1).setConstant(2);
  EXPECT_LE(fitShapeWeights(shapes, motion.transpose() * shapes, 2).maxCoeff(), 1);
}

/// Wherever the search begins it ends at the same weights.
TEST(FitShapeWeights, AGuessOnlyShortensTheSearch) {
  const int open = arkitIndex("JawOpen"), close = arkitIndex("MouthClose"), funnel = arkitIndex("MouthFunnel");
  Eigen::MatrixXf shapes = Eigen::MatrixXf::Zero(3, 52), motion(3, 8);
  shapes.col(open) << 1, 1, 0.3F;
  shapes.col(close) << -1, 0, 0;
  shapes.col(funnel) << 0.2F, 0, 1;
  for (Eigen::Index t = 0; t < motion.cols(); ++t) motion.col(t) << 0.1F, 0.5F, 0.05F * asFloat(asReal(t));
  ShapeClosures closures{shapes.topRows(1), Eigen::MatrixXf::Zero(1, 8), Eigen::MatrixXf::Constant(1, 8, 0.1F),
                         std::vector<bool>(8, false)};
  closures.in_frame[0] = closures.in_frame[5] = true;
  const auto weightsFrom = [&](std::span<const float> guess) {
    return fitShapeWeights(shapes, motion.transpose() * shapes, 3, {}, &closures, guess);
  };
  const RowMajorMatrixF weights = weightsFrom({});
  const std::vector<float> all(52, 1.0F), own(weights.data(), weights.data() + 52);
  EXPECT_LT((weightsFrom(all) - weights).cwiseAbs().maxCoeff(), kWeightWithin);
  EXPECT_LT((weightsFrom(own) - weights).cwiseAbs().maxCoeff(), kWeightWithin);
}

/// ICT's head, if it is here.
class ArkitOnIct : public testing::Test {
 protected:
  void SetUp() override {
    const std::filesystem::path path =
        std::filesystem::path(MOUTHPIECE_SOURCE_DIR) / ".." / "shared" / "faces" / "ict_arkit.glb";
    if (!std::filesystem::exists(path)) GTEST_SKIP() << "../shared/faces/ict_arkit.glb is not here";
    const std::string bytes = readFile(path);
    mesh_ = parseFaceMesh(bytes, path);
    shapes_ = parseFaceShapes(bytes, path);
  }

  /// `frames` with JawOpen and MouthClose at these weights are added to `animation_`.
  void add(Eigen::Index frames, float jaw, float close) {
    VertexPositions frame = mesh_.vertices;
    for (std::size_t s = 0; s < shapes_.names.size(); ++s) {
      if (arkitIndex(shapes_.names[s]) == arkitIndex("jawOpen")) frame += jaw * shapes_.moves[s];
      if (arkitIndex(shapes_.names[s]) == arkitIndex("mouthClose")) frame += close * shapes_.moves[s];
    }
    const Eigen::Index before = animation_.positions.rows();
    animation_.positions.conservativeResize(before + frames, frame.size());
    animation_.positions.bottomRows(frames).rowwise() =
        Eigen::Map<const Eigen::RowVectorXf>(frame.data(), frame.size());
  }

  FaceMesh mesh_;
  FaceShapes shapes_;
  FaceAnimation animation_{60, {}};
};

/// What the shapes can do is found in their terms, closed lips, too.
TEST_F(ArkitOnIct, FindsTheWeightsThatCloseLipsBehindAnOpenJaw) {
  add(12, 0.15F, 0.14F);
  const ArkitCurves curves = fitArkit(framesOf(animation_), mesh_, shapes_);
  EXPECT_EQ(curves.closures, 12U);
  EXPECT_EQ(curves.closures_kept, 12U);
  EXPECT_NEAR(curves.weights(6, arkitIndex("jawOpen")), 0.15F, kWeightWithin);
  EXPECT_NEAR(curves.weights(6, arkitIndex("mouthClose")), 0.14F, kWeightWithin);
  EXPECT_LT(curves.rms_error_mm, 0.1 * curves.rms_motion_mm);
}

/// Rims whose vertices are some tenths of a millimetre apart on closed lips: all frames of those are held.
TEST_F(ArkitOnIct, HoldsLipsThatCloseWithRoundRims) {
  add(15, 0.3F, 0);
  add(15, 0, 0);
  const ArkitCurves curves = fitArkit(framesOf(animation_), mesh_, shapes_);
  EXPECT_EQ(curves.closures, 15U) << "the head at rest";
  EXPECT_EQ(curves.closures_kept, 15U);
}

/// Lips with a notch, or so coarse that vertices have none across from them.
TEST_F(ArkitOnIct, HoldsLipsThatCloseBesideANotch) {
  const auto jaw = std::find_if(shapes_.names.begin(), shapes_.names.end(),
                                [](const std::string& name) { return arkitIndex(name) == arkitIndex("jawOpen"); });
  const VertexPositions& jaw_moves = shapes_.moves[static_cast<std::size_t>(jaw - shapes_.names.begin())];
  std::set<std::uint32_t> notch;
  for (const SlitPair& pair : lipSlit(mesh_, jaw_moves)) {
    if (pair.step >= 17 && pair.step < 23) notch.insert(pair.upper);
  }
  for (const std::uint32_t v : notch) mesh_.vertices(v, 1) += 0.003F;
  add(15, 0.3F, 0);
  add(15, 0, 0);
  const ArkitCurves curves = fitArkit(framesOf(animation_), mesh_, shapes_);
  EXPECT_EQ(curves.closures, 15U);
  EXPECT_EQ(curves.closures_kept, 15U);
}

TEST(Gaze, GoesIntoLookShapesAndIntoLiveLinksColumns) {
  RowMajorMatrixF weights = RowMajorMatrixF::Zero(3, std::ssize(kArkitNames));
  const std::vector<GazeTurn> gaze{{}, {.yaw = kWholeLook / 2, .pitch = -kWholeLook / 4}, {.yaw = -3, .pitch = 3}};
  addGaze(gaze, weights);
  const auto at = [&](Eigen::Index frame, std::string_view shape) { return weights(frame, arkitIndex(shape)); };
  EXPECT_TRUE(weights.row(0).isZero(0));
  // To the subject's left: away from the nose with the left eye, towards it with the right one.
  EXPECT_FLOAT_EQ(at(1, "EyeLookOutLeft"), 0.5F);
  EXPECT_FLOAT_EQ(at(1, "EyeLookInRight"), 0.5F);
  EXPECT_FLOAT_EQ(at(1, "EyeLookDownLeft"), 0.25F);
  EXPECT_EQ(at(1, "EyeLookInLeft") + at(1, "EyeLookOutRight") + at(1, "EyeLookUpRight"), 0);
  EXPECT_EQ(at(2, "EyeLookInLeft"), 1) << "and no more";
  EXPECT_EQ(at(2, "EyeLookUpRight"), 1);

  ArkitCurves curves;
  curves.frame_rate_hz = 60;
  curves.weights = weights;
  const std::string still = liveLinkCsv(curves);
  EXPECT_FALSE(parseLiveLinkCsv(still, "still.csv").turns_head);
  curves.gaze = gaze;
  curves.head = {{}, {.yaw = 0.1F, .pitch = 0.2F, .roll = 0.3F}, {}};
  const std::string turned = liveLinkCsv(curves);
  EXPECT_TRUE(parseLiveLinkCsv(turned, "turned.csv").turns_head);
  EXPECT_NE(turned.find(",0.100000,0.200000,0.300000,0.260000,-0.130000,0.000000,0.260000,-0.130000,0.000000\n"),
            std::string::npos);
}

}  // namespace
}  // namespace mouthpiece
