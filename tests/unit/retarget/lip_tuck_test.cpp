// F and V, W and UW, on heads with teeth and without.
#include "deform/mouth/lip_tuck.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <filesystem>
#include <limits>

#include "base/files.h"
#include "deform/kernel/deformer.h"
#include "deform/surface/virtual_points.h"
#include "retarget/rig/face_fit.h"
#include "retarget/rig/face_rig.h"
#include "synthesis/lips.h"
#include "test_face.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

/// A fitted head.
struct Head {
  FaceMesh mesh;
  FaceFile file;
  [[nodiscard]] double mm() const { return 1000 * mesh.metres_per_unit; }
};

Head fitted(const fs::path& mesh_file, const std::string& anchors) {
  const test::MadeUpActor actor = test::madeUpActor();
  const FitRequest request{.name = "head",
                           .mesh_file = "head.obj",
                           .mesh_sha256 = {},
                           .corpus = "made up",
                           .marker_names = actor.names,
                           .actor_neutral_mm = actor.neutral_mm,
                           .warp = {},
                           .binding = {}};
  Head head;
  head.mesh = readFaceMesh(mesh_file);
  head.file = fitFace(head.mesh, parseAnchors(anchors, "anchors"), "anchors", request);
  return head;
}

VertexPositions posed(const Head& head, double tuck) {
  const FaceDeformer deformer(head.mesh, head.file.control, head.file.binding);
  const std::vector<LipGap> gaps(lipPairs(head.file.control).size(), {.opened = 0, .least = 0, .tuck = tuck});
  VertexPositions out;
  const MarkerPositions closed = head.file.marker_targets + closingOffsets(head.file.control);
  deformer.deform({closed, gaps}, {}, out);
  return out;
}

/// The highest vertex of the lower lip, or the lowest of the upper one, in the middle of the mouth.
Eigen::RowVector3d rimOf(const Head& head, const VertexPositions& vertices, LipSide side) {
  const double up = side == LipSide::kLower ? 1 : -1;
  double best = -std::numeric_limits<double>::infinity();
  Eigen::RowVector3d rim;
  for (std::size_t v = 0; v < head.file.binding.patch.size(); ++v) {
    const int patch = head.file.binding.patch[v];
    const Eigen::RowVector3d p = vertices.row(static_cast<Eigen::Index>(v)).cast<double>();
    if (patch < 0 || head.file.control.sideOf(static_cast<std::size_t>(patch)) != side) continue;
    if (std::abs(p.x()) * head.mm() > 3 || up * p.y() < best) continue;
    best = up * p.y();
    rim = p;
  }
  return rim;
}

/// The upper teeth's edge in the middle: the lowest of the foremost 8 mm.
Eigen::RowVector3d teethEdge(const Head& head) {
  std::vector<Eigen::RowVector3d> middle;
  double front = -std::numeric_limits<double>::infinity();
  for (const Triangle& triangle : trianglesOf(head.mesh, {PartKind::kUpperTeeth})) {
    for (const std::uint32_t v : triangle) {
      const Eigen::RowVector3d p = head.mesh.vertices.row(v).cast<double>();
      if (std::abs(p.x()) * head.mm() > 4) continue;
      middle.push_back(p);
      front = std::max(front, p.z());
    }
  }
  Eigen::RowVector3d edge(0, std::numeric_limits<double>::infinity(), 0);
  for (const Eigen::RowVector3d& p : middle) {
    if (head.mm() * (front - p.z()) < 8 && p.y() < edge.y()) edge = p;
  }
  return edge;
}

/// The rim is at the edge of the teeth, below it and not behind them, in a mouth that is not closed.
void expectLipAtTeeth(const Head& head) {
  const Eigen::RowVector3d edge = teethEdge(head), rest = rimOf(head, head.mesh.vertices, LipSide::kLower);
  const VertexPositions f = posed(head, 1);
  const Eigen::RowVector3d rim = rimOf(head, f, LipSide::kLower);
  EXPECT_NEAR(head.mm() * (rim.y() - edge.y()), -0.3, 1.5);
  EXPECT_NEAR(head.mm() * (rim.z() - edge.z()), 0.5, 2.5);
  EXPECT_LT(rim.z(), rest.z()) << "it goes back";
  EXPECT_GT(head.mm() * (rimOf(head, f, LipSide::kUpper).y() - edge.y()), 0.5) << "the teeth are seen";
  const LipContactMeter meter(head.mesh, head.file.control);
  EXPECT_LT(head.mm() * meter.measure(f).in_teeth, 0.5);
  EXPECT_LT(head.mm() * meter.measure(posed(head, 0)).gap, 0.3) << "without the tuck it is a closed mouth";
}

TEST(LipTuck, BringsTheDefaultFacesLipToItsTeeth) {
  if (!test::canonicalFace()) GTEST_SKIP() << test::kNoCanonicalFace;
  Head head;
  head.file = test::fittedDefaultFace(head.mesh);
  expectLipAtTeeth(head);
  EXPECT_GT(LipContactMeter(head.mesh, head.file.control).measure(posed(head, 1)).gap, 1);
}

TEST(LipTuck, BringsTheIctHeadsLipToItsTeeth) {
  if (!test::canonicalFace()) GTEST_SKIP() << test::kNoCanonicalFace;
  if (!fs::exists(test::kSharedFaces / "ict_head.obj"))
    GTEST_SKIP() << "the ICT head is not beside the project (../shared/faces)";
  expectLipAtTeeth(fitted(test::kSharedFaces / "ict_head.obj",
                          readFile(fs::path(MOUTHPIECE_SOURCE_DIR) / "sample_data/anchors/ict_head.anchors.json")));
}

/// As a user would click them on makehuman_male.obj.
constexpr const char* kMakeHumanAnchors = R"({"markers": {
  "LIP_CORNER_R": [-0.2341, 7.492, 1.4335], "LIP_CORNER_L": [0.2341, 7.492, 1.4335], "LIP_UP_MID": 362,
  "LIP_LO_MID": 492, "NOSE_TIP": 294, "CHIN_LOW": 1584, "CANTHUS_OUT_R": 1417, "CANTHUS_OUT_L": 3539,
  "EYE_IN_R": 2195, "EYE_IN_L": 4296}})";

/// From the middle of the upper rim down to the lower lip's outer edge: what one sees of that lip, mm.
double shownLowerLip(const Head& head, const VertexPositions& vertices) {
  std::uint32_t edge = 0;
  (head.mesh.vertices.cast<double>().rowwise() - head.file.control.rest.row(findPoint(head.file.control, "LIP_LO_MID")))
      .rowwise()
      .squaredNorm()
      .minCoeff(&edge);
  return head.mm() * (rimOf(head, vertices, LipSide::kUpper).y() - double{vertices(edge, 1)});
}

/// Seen from the side the lower lip's rim is behind the upper one's, from the front hidden behind it, and what one sees
/// of the lower lip is thinner than in M, be it thick or thin.
TEST(LipTuck, TucksTheLipBehindTheUpperOneWhereThereAreNoTeeth) {
  if (!test::canonicalFace()) GTEST_SKIP() << test::kNoCanonicalFace;
  if (!fs::exists(test::kSharedFaces / "makehuman_male.obj"))
    GTEST_SKIP() << "MakeHuman's head is not beside the project";
  std::vector<std::pair<std::string, std::string>> heads{{"makehuman_male.obj", kMakeHumanAnchors}};
  for (const char* name : {"mh_african_female_young", "mh_asian_male_old", "ict_id14"})
    heads.emplace_back(
        fmt::format("more/{}.obj", name),
        readFile(fs::path(MOUTHPIECE_SOURCE_DIR) / fmt::format("tests/data/anchors/{}.anchors.json", name)));
  for (const auto& [mesh_file, anchors] : heads) {
    SCOPED_TRACE(mesh_file);
    const Head head = fitted(test::kSharedFaces / mesh_file, anchors);
    const double mouth = head.file.control.mouth_width;
    const VertexPositions f = posed(head, 1), m = posed(head, 0);
    const Eigen::RowVector3d lower = rimOf(head, f, LipSide::kLower), upper = rimOf(head, f, LipSide::kUpper);
    EXPECT_LT(lower.z() - rimOf(head, m, LipSide::kLower).z(), -0.06 * mouth);
    EXPECT_GT(lower.z() - rimOf(head, m, LipSide::kLower).z(), -0.15 * mouth);
    EXPECT_LT(lower.z(), upper.z() - 0.01 * mouth) << "from the side it is no closed mouth";
    EXPECT_GT(upper.y() - rimOf(head, m, LipSide::kUpper).y(), 0.02 * mouth) << "the upper lip is raised";
    EXPECT_LT(upper.y() - lower.y(), 0.01 * mouth) << "and hides the lower one's rim";
    EXPECT_LT(shownLowerLip(head, f), 0.92 * shownLowerLip(head, m)) << "which gets thinner";
    const LipContactMeter meter(head.mesh, head.file.control);
    EXPECT_LT(head.mm() * (meter.measure(f).overlap - meter.measure(head.mesh.vertices).overlap), 0.5);
  }
}

/// How far forward the tuck takes the skin of the chin, in the middle, mm.
double chinBulge(const Head& head) {
  const VertexPositions way = posed(head, 1) - posed(head, 0);
  const MarkerPositions& rest = head.file.control.rest;
  const auto at = [&](const char* name) -> Eigen::RowVector3d { return rest.row(findPoint(head.file.control, name)); };
  double most = 0;
  for (std::size_t v = 0; v < head.file.binding.patch.size(); ++v) {
    const Eigen::RowVector3d p = head.mesh.vertices.row(signedIndex(v)).cast<double>();
    if (head.file.binding.patch[v] < 0 || std::abs(p.x()) * head.mm() > 4) continue;
    if (p.y() > at("LIP_LO_MID").y() || p.y() < at("CHIN_LOW").y() || p.z() < at("CHIN_LOW").z()) continue;
    most = std::max(most, head.mm() * double{way(signedIndex(v), 2)});
  }
  return most;
}

/// A surface that goes in steeply at the lip swings out again below it.
TEST(LipTuck, LeavesNoBumpInTheChin) {
  if (!test::canonicalFace()) GTEST_SKIP() << test::kNoCanonicalFace;
  Head head;
  head.file = test::fittedDefaultFace(head.mesh);
  EXPECT_LT(chinBulge(head), 0.5) << "with teeth";
  if (!fs::exists(test::kSharedFaces / "makehuman_male.obj"))
    GTEST_SKIP() << "MakeHuman's head is not beside the project";
  EXPECT_LT(chinBulge(fitted(test::kSharedFaces / "makehuman_male.obj", kMakeHumanAnchors)), 0.2) << "without";
}

TEST(LipTuck, ComesAndGoesWithoutAJump) {
  if (!test::canonicalFace()) GTEST_SKIP() << test::kNoCanonicalFace;
  Head head;
  head.file = test::fittedDefaultFace(head.mesh);
  VertexPositions before = posed(head, 0);
  EXPECT_EQ((before - posed(head, 0)).cwiseAbs().maxCoeff(), 0);
  for (int i = 1; i <= 40; ++i) {
    const VertexPositions now = posed(head, i / 40.0);
    ASSERT_LT((now - before).rowwise().norm().maxCoeff(), 0.9F) << i;  // eased: half as fast again in its middle
    before = now;
  }
}

/// Lips that touch have the upper one's edge in the way: the lower one passes under it, and does not pop through.
TEST(LipTuck, PassesUnderTheUpperLipWithoutAJump) {
  if (!test::canonicalFace()) GTEST_SKIP() << test::kNoCanonicalFace;
  constexpr int kSteps = 20;
  const Head head =
      fitted(test::kSharedFaces / "more/mh_african_female_young.obj",
             readFile(fs::path(MOUTHPIECE_SOURCE_DIR) / "tests/data/anchors/mh_african_female_young.anchors.json"));
  VertexPositions before = posed(head, 0);
  const double way = head.mm() * double{(posed(head, 1) - before).rowwise().norm().maxCoeff()};
  for (int i = 1; i <= kSteps; ++i) {
    const VertexPositions now = posed(head, asReal(i) / kSteps);
    EXPECT_LT(head.mm() * double{(now - before).rowwise().norm().maxCoeff()}, 4 * way / kSteps) << i;
    before = now;
  }
}

/// The face in a frame of the actor's markers, by a phone that is as round as that.
VertexPositions deformedBy(const FaceRig& rig, const test::MadeUpActor& actor, const MarkerPositions& markers_mm,
                           const LipRounding& unseen, float rounding) {
  MotionClip clip{60, actor.names, PositionMatrix(1, markers_mm.size())};
  clip.positions_mm.row(0) = Eigen::Map<const Eigen::RowVectorXd>(markers_mm.data(), markers_mm.size());
  const ActorPose who{actor.neutral_mm, 0, unseen};
  const std::array lips{LipPose{0, 0.4F, 0, rounding}};
  VertexPositions out;
  rig.deform(rig.retarget(clip, &who, lips).pose(FrameIndex{0}), {}, out);
  return out;
}

/// What a camera in front does not see of W is added, and can be seen from the side.
TEST(LipRoundingTest, NarrowsTheMouthAndBringsTheLipsForward) {
  if (!test::canonicalFace()) GTEST_SKIP() << test::kNoCanonicalFace;
  FaceMesh mesh;
  const FaceFile file = test::fittedDefaultFace(mesh);
  const FaceRig rig = FaceRig::of(file, mesh, "default.face");
  const test::MadeUpActor actor = test::madeUpActor();
  const auto deformed = [&](const LipRounding& unseen, float rounding) {
    return deformedBy(rig, actor, actor.neutral_mm, unseen, rounding);
  };
  const VertexPositions rest = deformed({}, 1), round = deformed(kRounded, 1);
  EXPECT_EQ((deformed(kRounded, 0) - deformed({}, 0)).cwiseAbs().maxCoeff(), 0) << "nothing where it is not round";
  // MediaPipe's landmarks: the corners of the lips and the middles of their edges.
  const auto width = [](const VertexPositions& v) { return double{(v.row(61) - v.row(291)).norm()}; };
  EXPECT_LT(width(round), 0.9 * width(rest));
  for (const int lip : {0, 13, 14, 17}) EXPECT_GT(round(lip, 2) - rest(lip, 2), 3) << lip;
  for (const int still : {1, 33, 263}) EXPECT_LT((round.row(still) - rest.row(still)).norm(), 1) << still;
}

/// Whatever the outer edges of the lips do: a wide flat slit says no W.
TEST(LipRoundingTest, LeavesAHoleBetweenLipsThatMeetBesideIt) {
  if (!test::canonicalFace()) GTEST_SKIP() << test::kNoCanonicalFace;
  FaceMesh mesh;
  const FaceFile file = test::fittedDefaultFace(mesh);
  const FaceRig rig = FaceRig::of(file, mesh, "default.face");
  const test::MadeUpActor actor = test::madeUpActor();
  const auto deformed = [&](double opened_mm, float rounding) {
    MarkerPositions now = actor.neutral_mm;
    for (std::size_t m = 0; m < actor.names.size(); ++m) {
      if (lipSideOf(actor.names[m]) == LipSide::kLower) now(signedIndex(m), 1) -= opened_mm;
    }
    return deformedBy(rig, actor, now, {}, rounding);
  };
  // MediaPipe's landmarks of both rims: in the middle, and some way to the corners.
  const double mm = 1000 * mesh.metres_per_unit;
  const auto gap = [mm](const VertexPositions& v, int upper, int lower) {
    return mm * double{v(upper, 1) - v(lower, 1)};
  };
  for (const double opened_mm : {0.0, 3.0}) {
    const VertexPositions flat = deformed(opened_mm, 0), round = deformed(opened_mm, 1);
    EXPECT_GT(gap(round, 13, 14), 2) << opened_mm;
    for (const auto& [upper, lower] : {std::pair{80, 88}, {310, 318}}) {
      EXPECT_GT(gap(flat, upper, lower), 0.4) << upper;
      EXPECT_LT(gap(round, upper, lower), 0.35) << upper;
    }
  }
}

}  // namespace
}  // namespace mouthpiece
