// A slice of random heads, fitted by ten clicks each: `heads` (heads_main.cpp) tries hundreds.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <map>

#include "deform/mesh/triangle_tree.h"
#include "deform/surface/virtual_points.h"
#include "deform/topology/skin_layers.h"
#include "heads/coarse_heads.h"
#include "heads/head_changes.h"
#include "heads/mouth_trial.h"
#include "motion/lip_gauge.h"
#include "programs/retarget/commands.h"
#include "retarget/rig/borrowed_mouth.h"
#include "retarget/rig/face_fit.h"
#include "retarget/rig/face_rig.h"

namespace mouthpiece::test {
namespace {

constexpr std::array<std::string_view, 5> kOpenVowels{"(AA)", "(AE)", "(EH)", "(AY)", "(AW)"};

const Corpus& clockCorpus() {
  static const Corpus corpus = readCorpus(MOUTHPIECE_BUILD_SHARE_DIR "/clock.corpus");
  return corpus;
}

/// The same actor as a camera of 24 pictures a second sees him.
Corpus slowCorpus() {
  constexpr Eigen::Index kEvery = 5;
  Corpus corpus = clockCorpus();
  for (CorpusTake& take : corpus.takes) {
    const PositionMatrix all = take.motion.positions_mm;
    take.motion.frame_rate_hz /= kEvery;
    take.motion.positions_mm.resize((all.rows() + kEvery - 1) / kEvery, all.cols());
    for (Eigen::Index f = 0; f < take.motion.positions_mm.rows(); ++f)
      take.motion.positions_mm.row(f) = all.row(kEvery * f);
  }
  return corpus;
}

/// Root mean square way of a marker in a step.
double stepOf(const JudgedPoses& poses) {
  double squares = 0, steps = 0;
  for (std::size_t row = 1; row < poses.rows.size(); ++row) {
    if (!poses.rows[row].follows) continue;
    const auto here = signedIndex(row);
    squares += (poses.motion.positions_mm.row(here) - poses.motion.positions_mm.row(here - 1)).squaredNorm();
    steps += asReal(poses.motion.markerCount());
  }
  return std::sqrt(squares / steps);
}

/// A step lasts 1/60 s at most, not as long as a slow camera's frame.
TEST(JudgedSteps, AreNoFramesOfASlowCamera) {
  const double fast = stepOf(judgedPoses(clockCorpus())), slow = stepOf(judgedPoses(slowCorpus()));
  EXPECT_GT(fast, 0.05);
  EXPECT_GT(slow / fast, 1) << "a 60th of a second, not the capture's 120th";
  EXPECT_LT(slow / fast, 3) << "other frames are drawn; by the camera's own it would be 5";
}

/// The way to and from closures is looked at step by step.
TEST(JudgedSteps, FollowLipsThatClose) {
  constexpr std::size_t kWays = 16, kSteps = 4;
  std::size_t ways = 0, steps = 0;
  for (const JudgedPoses::Row& row : judgedPoses(clockCorpus()).rows) {
    steps = row.follows ? steps + 1 : 0;
    ways += steps == kSteps ? 1U : 0U;
  }
  EXPECT_GT(ways, kWays / 2);
}

/// Every head of ../shared/faces and the default one, by ten clicks.
class ClickedHeads : public ::testing::TestWithParam<std::size_t> {};
INSTANTIATE_TEST_SUITE_P(All, ClickedHeads, ::testing::Range(std::size_t{0}, std::size_t{9}));

TEST_P(ClickedHeads, Pass) {
  const std::vector<ClickedHead> heads = clickedHeads(MOUTHPIECE_SOURCE_DIR, MOUTHPIECE_BUILD_SHARE_DIR);
  if (GetParam() >= heads.size()) GTEST_SKIP() << "../shared/faces is not here";
  const ClickedHead& head = heads[GetParam()];
  static const Corpus corpus = readCorpus(MOUTHPIECE_BUILD_SHARE_DIR "/sample.corpus");
  static const JudgedPoses poses = judgedPoses(corpus);
  const auto folder = std::filesystem::path(::testing::TempDir()) / ("clicked_" + head.name);
  const MouthTrial trial = tryMouth(head, corpus, poses, 0, folder);
  EXPECT_EQ(trial.refused, "") << head.name;
  EXPECT_EQ(trial.faults, "") << head.name;
  std::filesystem::remove_all(folder);
}

/// `mesh` without teeth, gums and tongue; vertices stay.
FaceMesh withoutTeeth(const FaceMesh& mesh) {
  FaceMesh bare = mesh;
  bare.triangles.clear();
  bare.parts.clear();
  for (const MeshPart& part : mesh.parts) {
    if (part.kind == PartKind::kUpperTeeth || part.kind == PartKind::kLowerTeeth || part.kind == PartKind::kTongue)
      continue;
    bare.parts.emplace_back(part).first_triangle = bare.triangles.size();
    const auto own = trianglesOf(mesh, part);
    bare.triangles.insert(bare.triangles.end(), own.begin(), own.end());
  }
  return bare;
}

/// Teeth that a head is given stand right behind its lips, a little under the rim of the upper one, and nowhere out of
/// the skin; what lies in the mouth has its colour.
TEST_P(ClickedHeads, GetTeethBehindTheirLips) {
  constexpr double kMiddle = 0.2;                     // mouth widths, as all of these
  constexpr double kNearest = 0.05, kFurthest = 0.4;  // behind the upper lip's foremost skin; lips are up to 0.3 thick
  constexpr double kShown = 0.1;                      // under the rim
  std::vector<ClickedHead> heads = clickedHeads(MOUTHPIECE_SOURCE_DIR, MOUTHPIECE_BUILD_SHARE_DIR);
  if (GetParam() >= heads.size()) GTEST_SKIP() << "../shared/faces is not here";
  ClickedHead& head = heads[GetParam()];
  FaceMesh bare = withoutTeeth(head.mesh);
  const FaceFile face = fitFace(bare, head.clicks, "clicks", requestFor(head, clockCorpus()));
  const std::filesystem::path donor = MOUTHPIECE_BUILD_SHARE_DIR "/default.face";
  const auto grown = withBorrowedMouth(bare, face, FaceRig::load(donor).mesh(), readFaceFile(donor));
  ASSERT_TRUE(grown);
  const FaceMesh whole = withInsideTold(grown->mesh, bare, face);
  EXPECT_FALSE(trianglesOf(whole, {PartKind::kMouthInside}).empty()) << head.name;
  const double width = face.control.mouth_width;
  const Eigen::Vector3d rim = face.control.rest.row(findPoint(face.control, "RIM_UP_MID")).transpose();
  const SkinLayers skin(whole.vertices, trianglesOf(whole, {PartKind::kSkin, PartKind::kLips}));
  double edge = rim.y() + width, nearest = width;
  for (const Triangle& t : trianglesOf(whole, {PartKind::kUpperTeeth})) {
    for (const std::uint32_t v : t) {
      const Eigen::Vector3d p = pointAt(whole.vertices, v), off = (p - rim).cwiseAbs() / width;
      if (off.x() > kMiddle || off.y() > kMiddle) continue;
      edge = std::min(edge, p.y());
      const auto layers = skin.at(p.x(), rim.y() + kMiddle / 2 * width);
      ASSERT_FALSE(layers.empty());
      nearest = std::min(nearest, layers[0] - p.z());
    }
  }
  EXPECT_GT(nearest / width, kNearest) << head.name;
  EXPECT_LT(nearest / width, kFurthest) << head.name;
  EXPECT_GT((rim.y() - edge) / width, 0) << head.name;
  EXPECT_LT((rim.y() - edge) / width, kShown) << head.name;
  for (const Triangle& t : trianglesOf(whole, {PartKind::kUpperTeeth, PartKind::kLowerTeeth, PartKind::kMouthInside})) {
    for (const std::uint32_t v : t) {
      const Eigen::Vector3d p = pointAt(whole.vertices, v);
      if ((p - rim).head<2>().cwiseAbs().maxCoeff() < 0.5 * width) continue;
      EXPECT_TRUE(skin.isBehind(p, 0)) << head.name << ' ' << ((p - rim) / width).transpose();
    }
  }
}

/// How much less far down the lower lip goes in its middle than beside it. `way`: of a marker.
double waveOf(const std::function<Eigen::Vector3d(const std::string&)>& way) {
  return way("LIP_LO_MID").y() - 0.5 * (way("LIP_LO_IN_R") + way("LIP_LO_IN_L")).y();
}

/// The lower lip's middle clicked 2 mm too low or too high, beside markers that found their places: it goes along with
/// them as the actor's does, in the widest of the captured poses.
TEST_P(ClickedHeads, OpenAsTheActorDoesWhereTheLipIsClickedBeside) {
  constexpr double kBesideMm = 2, kWithinMm = 0.75;
  std::vector<ClickedHead> heads = clickedHeads(MOUTHPIECE_SOURCE_DIR, MOUTHPIECE_BUILD_SHARE_DIR);
  if (GetParam() >= heads.size()) GTEST_SKIP() << "../shared/faces is not here";
  const Corpus& corpus = clockCorpus();
  const std::vector<std::string> names = corpus.layout.markerNames();
  const auto number = [&](const std::string& name) {
    return std::find(names.begin(), names.end(), name) - names.begin();
  };
  const auto placeIn = [&](const auto& row, const std::string& name) -> Eigen::Vector3d {
    return row.template segment<3>(3 * number(name)).transpose();
  };
  Eigen::RowVectorXd widest;
  double opening = 0;
  for (const CorpusTake& take : corpus.takes) {
    for (const auto& row : take.motion.positions_mm.rowwise()) {
      const double now = (placeIn(row, "LIP_UP_MID") - placeIn(row, "LIP_LO_MID")).norm();
      if (now > opening && row.allFinite()) {
        opening = now;
        widest = row;
      }
    }
  }
  const double of_actor = waveOf([&](const std::string& name) -> Eigen::Vector3d {
    return placeIn(widest, name) - corpus.neutral_pose_mm.row(number(name)).transpose();
  });
  for (const double beside : {-kBesideMm, 0.0, kBesideMm}) {
    ClickedHead head = heads[GetParam()];
    auto& click = std::get<Eigen::Vector3d>(head.clicks.markers.at("LIP_LO_MID"));
    const TriangleTree skin(head.mesh.vertices, trianglesOf(head.mesh, {PartKind::kSkin, PartKind::kLips}));
    click = skin.closest(click + Eigen::Vector3d(0, beside / head.mm_per_unit, 0))->point;
    const FaceFile face = fitFace(head.mesh, head.clicks, "clicks", requestFor(head, corpus));
    const RbfWarp warp = RbfWarp::fit(face.actor_neutral_mm, face.marker_targets, face.warp);
    const PositionMatrix moved = warp.targetFromActorRelative(widest, face.actor_neutral_mm);
    const double wave = waveOf([&](const std::string& name) -> Eigen::Vector3d {
      return head.mm_per_unit * (placeIn(moved.row(0), name) - face.marker_targets.row(number(name)).transpose());
    });
    EXPECT_LT(std::abs(wave - of_actor), kWithinMm) << head.name << " clicked " << beside << " mm beside";
  }
}

/// How far the actor's lips are apart beyond where they meet, and the same between the head's, in widths of their
/// mouths, in each pose of open vowels that are sung and that no consonant beside them narrows.
struct SungOpening {
  std::string pose;
  double actor = 0, head = 0;
};

std::vector<SungOpening> sungOpenings(const FaceFile& face, const FaceRig& rig, const Corpus& corpus,
                                      const JudgedPoses& poses) {
  constexpr double kOpen = 0.12;  // mouth widths of the actor
  const LipGauge gauge(corpus.layout);
  const std::vector<std::string> names = corpus.layout.markerNames();
  const auto neutral = [&](const std::string& name) {
    return corpus.neutral_pose_mm.row(std::find(names.begin(), names.end(), name) - names.begin());
  };
  const double actor_width = (neutral("LIP_CORNER_R") - neutral("LIP_CORNER_L")).norm();
  const FaceMotion motion = rig.retarget(poses.motion, nullptr, poses.lips);
  const LipContactMeter meter(rig.mesh(), face.control);
  std::vector<SungOpening> openings;
  for (std::size_t i = 0; i < poses.rows.size(); ++i) {
    const std::string& pose = poses.rows[i].where;
    const bool is_open = std::any_of(kOpenVowels.begin(), kOpenVowels.end(),
                                     [&](std::string_view vowel) { return pose.ends_with(vowel); });
    const bool is_led = poses.lips[i].seal > 0 || poses.lips[i].tuck > 0;  // by an M or F beside it
    if (!pose.starts_with("a song") || !is_open || is_led) continue;
    const double apart = gauge.opening(poses.motion.positions_mm.row(signedIndex(i))) - face.actor_closed_lips_mm;
    if (apart < kOpen * actor_width) continue;
    VertexPositions shown;
    rig.deform(motion.pose(FrameIndex{i}), poses.tongue[i], shown);
    openings.push_back({pose, apart / actor_width, meter.measure(shown).gap / face.control.mouth_width});
  }
  return openings;
}

/// Open vowels that are sung stand as wide open on every head as the singer's own mouth, each by its own width.
TEST_P(ClickedHeads, OpenAsWideAsWhoSings) {
  constexpr double kLeastShare = 0.9;  // 0.95 to 1.15 were measured
  std::vector<ClickedHead> heads = clickedHeads(MOUTHPIECE_SOURCE_DIR, MOUTHPIECE_BUILD_SHARE_DIR);
  if (GetParam() >= heads.size()) GTEST_SKIP() << "../shared/faces is not here";
  ClickedHead& head = heads[GetParam()];
  static const Corpus corpus = readCorpus(MOUTHPIECE_BUILD_SHARE_DIR "/sample.corpus");
  static const JudgedPoses poses = judgedPoses(corpus);
  const FaceFile face = fitFace(head.mesh, head.clicks, "clicks", requestFor(head, corpus));
  const FaceRig rig = FaceRig::of(face, std::move(head.mesh), head.name);
  const std::vector<SungOpening> openings = sungOpenings(face, rig, corpus, poses);
  EXPECT_GE(openings.size(), 3U);
  for (const SungOpening& one : openings) EXPECT_GE(one.head, kLeastShare * one.actor) << head.name << ", " << one.pose;
}

class RandomHeads : public ::testing::TestWithParam<unsigned> {};
// Heads that stand, so that they stay so (docs/theory/deform/lip_line.md): of the first 24 seeds twenty-three pass; 7,
// 29, 31, 47, 55, 71, 88, 93, 95, 101, 127 and 137 by lips that are made to meet, 244 by skin that is relaxed where a
// lip snapped shut, 106 and 394 since narrow slits are seen, 313 since the last closure of a face that is well is
// mended, 607 and 632 since walls of the mouth cross no lip, 658 since lips that met wrongly are made to meet even
// where relaxing has left a jump alone, 666 where it opens them, 615 since skin that is torn where lips meet is
// relaxed (so did 114, until what phones tell of the lips was judged: its lip pops), 449 since tongues come out between
// the lips, 833 since no skin between the lips is one's, 84, 406, 801
// and 832 since nothing in each other is asked there either, nor of lips' backs, 456 since coarse rims hang on what is
// an edge away, 295 since no vertex may go three times as far as any marker does, 985 since the surface is measured
// along the skin, 1149 since large triangles are a lip's, too, 748, 964 and 1090 since coarse rims hang where they lie,
// 1239 since thick lips are tucked less, 1808 since lips that get into the teeth are, too, 1843 since a small mouth's
// slits are seen, and 1769 since the fold under a lower lip is no mouth. Every third for everybody, but for those that
// take longest; all of them each night.
std::vector<unsigned> seedsThatPass() {
  const std::vector<unsigned> all{1,   2,   3,   4,   5,   6,    7,   8,   9,    10,   11,   12,   13,  14,
                                  15,  16,  17,  18,  19,  20,   21,  22,  23,   25,   29,   31,   35,  47,
                                  55,  60,  71,  88,  92,  93,   95,  101, 127,  137,  153,  171,  191, 194,
                                  244, 207, 106, 313, 394, 607,  658, 632, 666,  615,  449,  833,  84,  406,
                                  801, 832, 456, 295, 985, 1149, 748, 964, 1090, 1239, 1808, 1769, 1843};
  if (std::getenv("MOUTHPIECE_ALL_HEADS") != nullptr) return all;
  std::vector<unsigned> some;
  constexpr std::array<unsigned, 3> kDear{7, 13, 71};
  for (std::size_t i = 0; i < all.size(); i += 3)
    if (std::ranges::find(kDear, all[i]) == kDear.end()) some.push_back(all[i]);
  return some;
}
INSTANTIATE_TEST_SUITE_P(Seeds, RandomHeads, ::testing::ValuesIn(seedsThatPass()));

TEST_P(RandomHeads, FitByTenClicksAndDoNotTear) {
  const std::vector<ClickedHead> heads = clickedHeads(MOUTHPIECE_SOURCE_DIR, MOUTHPIECE_BUILD_SHARE_DIR);
  // Seeds stand for heads of ../shared/faces; the default head's own variants of some of them tear still.
  if (heads.size() < 2) GTEST_SKIP() << "../shared/faces is not here";
  const Corpus& corpus = clockCorpus();
  const ClickedHead head = variedHead(heads[GetParam() % heads.size()], GetParam());
  const auto folder = std::filesystem::path(::testing::TempDir()) / ("heads_" + std::to_string(GetParam()));
  static const JudgedPoses poses = judgedPoses(corpus);
  const MouthTrial trial = tryMouth(head, corpus, poses, GetParam(), folder);
  EXPECT_EQ(trial.refused, "") << head.name << ": " << head.changes;
  EXPECT_EQ(trial.faults, "") << head.name << ": " << head.changes;
  EXPECT_FALSE(trial.isTorn()) << head.name << ": edge +" << trial.edge_growth_mm << " mm, jump " << trial.jump_mm
                               << " mm, " << trial.shut << " of " << trial.closures << " shut; " << head.changes;
  EXPECT_GT(trial.closures, 0U);
  std::filesystem::remove_all(folder);
}

/// Heads as a game's artist makes them: a mouth-wide edge that grows a little, a fold of coarse skin, and triangles
/// that join the lips at a corner and reach to the middle, where they would seem to touch; 330: sheets with a hole
/// behind them that pass each other by a little; 318: rims an edge from all that faces forwards; 555: a slit that ends
/// before the mouth's corners.
class CoarseHeads : public ::testing::TestWithParam<unsigned> {};
INSTANTIATE_TEST_SUITE_P(Seeds, CoarseHeads, ::testing::Values(6U, 38U, 312U, 318U, 330U, 555U));

TEST_P(CoarseHeads, FitByTenClicksAndDoNotTear) {
  const std::vector<ClickedHead> heads = clickedHeads(MOUTHPIECE_SOURCE_DIR, MOUTHPIECE_BUILD_SHARE_DIR);
  if (heads.size() < 9) GTEST_SKIP() << "../shared/faces is not here";
  const std::optional<ClickedHead> head = coarseHead(heads[GetParam() / 3 % heads.size()], GetParam());
  ASSERT_TRUE(head);
  EXPECT_LT(head->mesh.triangles.size(), 2000U);
  const auto folder = std::filesystem::path(::testing::TempDir()) / ("coarse_" + std::to_string(GetParam()));
  static const JudgedPoses poses = judgedPoses(clockCorpus());
  const MouthTrial trial = tryMouth(*head, clockCorpus(), poses, GetParam(), folder);
  EXPECT_EQ(trial.refused, "") << head->name << ": " << head->changes;
  EXPECT_EQ(trial.faults, "") << head->name << ": " << head->changes;
  EXPECT_FALSE(trial.isTorn()) << head->name << ": edge +" << trial.edge_growth_mm << " mm, jump " << trial.jump_mm
                               << " mm, " << trial.shut << " of " << trial.closures << " shut";
  EXPECT_GT(trial.closures, 0U);
  std::filesystem::remove_all(folder);
}

/// A warp that meets each place exactly folds the skin between brows over where these are millimetres off.
TEST(StylisedHeads, AreFittedWithoutFolds) {
  const std::vector<ClickedHead> heads = clickedHeads(MOUTHPIECE_SOURCE_DIR, MOUTHPIECE_BUILD_SHARE_DIR);
  if (heads.size() < 9) GTEST_SKIP() << "../shared/faces is not here";
  const auto own =
      std::find_if(heads.begin(), heads.end(), [](const auto& h) { return h.name == "mh_asian_male_old"; });
  ASSERT_NE(own, heads.end());
  ClickedHead wide = *own;
  Chance chance(4);
  stylise(wide, 1, 1);
  jitter(wide, chance);
  constexpr unsigned kCoarse = 563;
  std::optional<ClickedHead> coarse = coarseHead(heads[kCoarse / 3 % heads.size()], kCoarse);
  ASSERT_TRUE(coarse);
  for (ClickedHead* head : {&wide, &*coarse}) {
    const FaceFile face = fitFace(head->mesh, head->clicks, "clicks", requestFor(*head, clockCorpus()));
    EXPECT_EQ(checkFace(face, head->mesh).fold_overs, 0U) << head->name << ": " << head->changes;
    EXPECT_GT(face.warp.regularization, 0);
  }
}

/// Over a hollow of the forehead the skin closest to two markers is one place: they are put apart.
TEST(StylisedHeads, HaveNoTwoMarkersInOnePlace) {
  const std::vector<ClickedHead> heads = clickedHeads(MOUTHPIECE_SOURCE_DIR, MOUTHPIECE_BUILD_SHARE_DIR);
  if (heads.size() < 9) GTEST_SKIP() << "../shared/faces is not here";
  ClickedHead head =
      *std::find_if(heads.begin(), heads.end(), [](const auto& h) { return h.name == "mh_african_female_young"; });
  // As `retarget anchors` finds them.
  const std::map<std::string, Eigen::Vector3d> found{
      {"CANTHUS_OUT_L", {0.421, 7.445, 1.183}}, {"CANTHUS_OUT_R", {-0.411, 7.445, 1.181}},
      {"CHIN_LOW", {0.000, 6.483, 1.356}},      {"EYE_IN_L", {0.160, 7.423, 1.203}},
      {"EYE_IN_R", {-0.160, 7.423, 1.203}},     {"LIP_CORNER_L", {0.241, 6.823, 1.395}},
      {"LIP_CORNER_R", {-0.240, 6.823, 1.395}}, {"LIP_LO_MID", {0.000, 6.707, 1.499}},
      {"LIP_UP_MID", {0.000, 6.947, 1.525}},    {"NOSE_TIP", {0.001, 7.138, 1.539}}};
  for (const auto& [name, place] : found) head.clicks.markers[name] = place;
  stylise(head, 0, 1);
  const FaceFile face = fitFace(head.mesh, head.clicks, "clicks", requestFor(head, clockCorpus()));
  for (Eigen::Index i = 0; i < face.marker_targets.rows(); ++i) {
    for (Eigen::Index j = 0; j < i; ++j)
      EXPECT_GT((face.marker_targets.row(i) - face.marker_targets.row(j)).norm(), 0.005 * face.control.mouth_width);
  }
}

/// Lips that are sheets with a hole behind them are as deep in each other as one has to be moved to get out.
TEST(CoarseSheets, AreAsDeepInEachOtherAsTheyHavePassed) {
  constexpr unsigned kSeed = 468;
  constexpr double kStepMm = 0.05;
  const std::vector<ClickedHead> heads = clickedHeads(MOUTHPIECE_SOURCE_DIR, MOUTHPIECE_BUILD_SHARE_DIR);
  if (heads.size() < 9) GTEST_SKIP() << "../shared/faces is not here";
  const std::optional<ClickedHead> head = coarseHead(heads[kSeed / 3 % heads.size()], kSeed);
  ASSERT_TRUE(head);
  FaceMesh mesh = head->mesh;
  const FaceFile face = fitFace(mesh, head->clicks, "clicks", requestFor(*head, clockCorpus()));
  const LipContactMeter meter(mesh, face.control, 0.005);
  const auto overlapMm = [&](double up_mm) {
    VertexPositions moved = mesh.vertices;
    for (std::size_t v = 0; v < mesh.vertexCount(); ++v) {
      const int patch = face.binding.patch[v];
      if (patch >= 0 && face.control.sideOf(unsignedIndex(patch)) == LipSide::kLower)
        moved(signedIndex(v), 1) += asFloat(up_mm / head->mm_per_unit);
    }
    return head->mm_per_unit * meter.measure(moved).overlap;
  };
  double touch_mm = 0;
  while (touch_mm < 5 && overlapMm(touch_mm) < 0.5 * kStepMm) touch_mm += kStepMm;
  ASSERT_LT(touch_mm, 5);
  for (const double passed_mm : {0.3, 0.5, 1.0, 2.0}) {
    const double found_mm = overlapMm(touch_mm + passed_mm);
    EXPECT_LT(found_mm, passed_mm + 2 * kStepMm);
    EXPECT_GT(found_mm, 0.75 * passed_mm);
  }
}

}  // namespace
}  // namespace mouthpiece::test
