#include "retarget/rig/face_judge.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "deform/topology/welding.h"
#include "retarget/rig/face_fit.h"
#include "test_face.h"

namespace mouthpiece {
namespace {

/// The default face, moved by a made-up actor who opens the mouth and closes it.
class FaceJudgeTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!test::canonicalFace()) GTEST_SKIP() << test::kNoCanonicalFace;
    if (file_.marker_names.empty()) file_ = test::fittedDefaultFace(mesh_);
  }

  static JudgedPoses opening() {
    JudgedPoses poses;
    poses.motion = test::openingTake(test::madeUpActor()).motion;
    const std::size_t count = poses.motion.frameCount();
    poses.tongue.resize(count);
    for (std::size_t i = 0; i < count; ++i) {
      const bool closed = i == 0 || i + 1 == count;
      poses.lips.push_back({closed ? 1.0F : 0.0F, 0});
      poses.rows.push_back({fmt::format("pose {}", i), closed, i > 0});
    }
    return poses;
  }

  static FaceJudgement judged(const FaceFile& file, const JudgedPoses& poses) {
    const ActorPose actor{test::madeUpActor().neutral_mm, 0};
    return judgeFace(FaceRig::of(file, mesh_, "default.face"), file, poses, actor);
  }

  static const FaceFault* faultOf(const FaceJudgement& judgement, std::string_view limit) {
    const auto fault = std::find_if(judgement.faults.begin(), judgement.faults.end(),
                                    [&](const FaceFault& f) { return f.limit == limit; });
    return fault == judgement.faults.end() ? nullptr : &*fault;
  }

  static inline FaceMesh mesh_;  // fitted once
  static inline FaceFile file_;
};

TEST_F(FaceJudgeTest, FindsNothingOnAGoodFace) {
  const FaceJudgement found = judged(file_, opening());
  for (const FaceFault& fault : found.faults) ADD_FAILURE() << fault.what;
  EXPECT_EQ(found.closures, 2);
  EXPECT_EQ(found.touching, 2);
  EXPECT_EQ(found.steps, 12);
  EXPECT_NEAR(found.motion_share, 1, 0.1);
  EXPECT_GT(found.edge_growth_mm, 0.5) << "a mouth that opens stretches";
  EXPECT_EQ(found.warp_folds, 0);
}

TEST_F(FaceJudgeTest, NamesShapesWhoseLipsDoNotMeet) {
  const FaceRig rig = FaceRig::of(file_, mesh_, "default.face");
  const JudgedPoses poses = opening();
  const FaceMotion motion = rig.retarget(poses.motion);
  VertexPositions open;
  rig.deform(motion.pose(FrameIndex{6}), {}, open);
  const std::vector<FaceJudgement> found =
      judgeShapes(rig, file_, std::vector{mesh_.vertices, open, open},
                  std::vector<JudgedPoses::Row>{{"shut", true}, {"ajar", true}, {"open", false}});
  ASSERT_EQ(found.size(), 3U);
  EXPECT_EQ(faultOf(found[0], "closures"), nullptr);
  ASSERT_NE(faultOf(found[1], "closures"), nullptr);
  EXPECT_NE(faultOf(found[1], "closures")->what.find("in ajar"), std::string::npos);
  EXPECT_GT(*std::max_element(found[1].left_open.begin(), found[1].left_open.end()), 1);
  EXPECT_EQ(faultOf(found[2], "closures"), nullptr) << "nobody says that they shall meet";
}

TEST(MendingRule, KeepsWhatLeavesFewerFaultsButNoOpenMouth) {
  const auto judged = [](const std::vector<std::string_view>& limits, std::size_t touching) {
    FaceJudgement judgement;
    judgement.closures = 40;
    judgement.touching = touching;
    for (const std::string_view limit : limits) judgement.faults.push_back({limit, "", {}, {}});
    return judgement;
  };
  const FaceJudgement torn = judged({"stretch", "vertex jump"}, 39), open = judged({"closures"}, 20);
  EXPECT_TRUE(mendsMore(judged({"stretch"}, 39), torn));
  EXPECT_TRUE(mendsMore(judged({"stretch"}, 38), torn)) << "closures within their limit are worth less than a fault";
  EXPECT_FALSE(mendsMore(torn, judged({"stretch"}, 20))) << "more faults are not made up for by closures";
  EXPECT_FALSE(mendsMore(open, torn)) << "a mouth that closes is not opened for whole skin";
  EXPECT_TRUE(mendsMore(open, judged({"closures", "stretch"}, 30))) << "one that is open may stay so";
  EXPECT_TRUE(mendsMore(judged({"closures"}, 21), open));
  EXPECT_FALSE(mendsMore(judged({"motion"}, 39), torn)) << "a face that stands still never tears";
  EXPECT_FALSE(mendsMore(judged({"lip motion"}, 39), judged({"stretch"}, 38))) << "and its lips always touch";
  EXPECT_FALSE(mendsMore(open, open)) << "what is as good stays as it was";
  EXPECT_FALSE(mendsMore(judged({"lips in each other"}, 20), open));
  EXPECT_TRUE(mendsMore(judged({"lips in each other"}, 39), open));
}

/// Edges that are torn twice over were never mended, but took most of the time that mending takes.
TEST(MendingRule, RelaxesFurtherWhatIsTornAloneAndNotTwiceOver) {
  const auto torn = [](std::vector<std::string_view> limits, double times_as_far) {
    FaceJudgement judgement;
    judgement.torn = {7};
    judgement.edge_ratio = times_as_far * limitNamed("edge length");
    judgement.edge_growth_mm = times_as_far * limitNamed("stretch");
    for (const std::string_view limit : limits) judgement.faults.push_back({limit, "", {}, {}});
    return judgement;
  };
  EXPECT_TRUE(isTornAlone(torn({"stretch", "edge length"}, 1.9)));
  EXPECT_FALSE(isTornAlone(torn({"stretch", "edge length"}, 2.1)));
  FaceJudgement one = torn({"stretch"}, 0.9);
  one.edge_growth_mm = 2.1 * limitNamed("stretch");
  EXPECT_FALSE(isTornAlone(one)) << "an edge that grows too far, though not by many times its length";
  one = torn({"edge length"}, 0.9);
  one.edge_ratio = 2.1 * limitNamed("edge length");
  EXPECT_FALSE(isTornAlone(one));
  EXPECT_TRUE(isTornAlone(torn({"vertex jump"}, 0.5)));
  EXPECT_FALSE(isTornAlone(torn({"vertex jump", "closures"}, 0.5))) << "the lips do not meet, either";
  EXPECT_FALSE(isTornAlone(torn({}, 0.5))) << "nothing is wrong";
  one = torn({"stretch"}, 1.1);
  one.torn.clear();
  EXPECT_FALSE(isTornAlone(one)) << "nothing to relax";
}

/// A few vertices of the lower lip are left hanging on the upper one.
FaceFile hungOnEachOther(const FaceFile& whole) {
  FaceFile torn = whole;
  const auto on = [&](LipSide side, std::size_t v) {
    const int patch = torn.binding.patch[v];
    return patch >= 0 && torn.binding.d[v] * torn.binding.d[v] < 1 &&
           torn.control.sideOf(static_cast<std::size_t>(patch)) == side;
  };
  std::size_t upper = 0;
  while (!on(LipSide::kUpper, upper)) ++upper;
  int left = 5;
  for (std::size_t v = 0; v < torn.binding.patch.size() && left > 0; ++v) {
    if (!on(LipSide::kLower, v)) continue;
    torn.binding.patch[v] = torn.binding.patch[upper];
    --left;
  }
  return torn;
}

TEST_F(FaceJudgeTest, MendsLipsThatHangOnEachOther) {
  FaceFile face = hungOnEachOther(file_);
  const FaceBinding before = face.binding;
  const JudgedPoses poses = opening();
  const ActorPose actor{test::madeUpActor().neutral_mm, 0};
  FaceRig rig = FaceRig::of(face, mesh_, "default.face");
  const FaceJudgement mended = mendFace(face, rig, poses, actor, judgeFace(rig, face, poses, actor));
  for (const FaceFault& fault : mended.faults) ADD_FAILURE() << fault.what;
  EXPECT_EQ(face.binding.patch, before.patch) << "their own places stay";
  ASSERT_FALSE(face.binding.relaxed.vertices.empty());
  EXPECT_LT(face.binding.relaxed.vertices.size(), mesh_.vertexCount() / 10) << "what was whole stays as it was";
  const FaceFile read = parseFaceFile(faceFileToBytes(face), "mended.face");
  EXPECT_EQ(read.binding.relaxed.from, face.binding.relaxed.from);
  EXPECT_EQ(judged(read, poses).edge_growth_mm, mended.edge_growth_mm) << "the file holds all of it";
}

TEST_F(FaceJudgeTest, LeavesAloneWhatItCannotMend) {
  // As few poses as show it: all are judged in each of the many ways that are tried.
  const JudgedPoses all = opening();
  JudgedPoses gaping;
  gaping.motion = {all.motion.frame_rate_hz, all.motion.marker_names,
                   all.motion.positions_mm(std::vector{0, 6, 12}, Eigen::all)};
  gaping.lips = {all.lips[0], all.lips[6], all.lips[12]};
  gaping.tongue.resize(3);
  gaping.rows = {{"shut", true}, {"gaping", true}, {"shut again", true}};
  const ActorPose actor{test::madeUpActor().neutral_mm, 0};
  FaceFile face = file_;
  FaceRig rig = FaceRig::of(face, mesh_, "default.face");
  const FaceJudgement before = judgeFace(rig, face, gaping, actor);
  ASSERT_NE(faultOf(before, "closures"), nullptr);
  EXPECT_EQ(mendFace(face, rig, gaping, actor, before).faults.size(), before.faults.size());
  EXPECT_EQ(faceFileToBytes(face), faceFileToBytes(file_));
}

TEST_F(FaceJudgeTest, LipsThatArePressedComeCloser) {
  FaceFile pressed = file_;
  pressed.binding.pressed.assign(kLipColumns, asFloat(0.005 * file_.control.mouth_width));
  const FaceFile read = parseFaceFile(faceFileToBytes(pressed), "pressed.face");
  EXPECT_EQ(read.binding.pressed, pressed.binding.pressed);
  EXPECT_GT(judged(read, opening()).lips_overlap_mm, judged(file_, opening()).lips_overlap_mm + 0.05);
  EXPECT_FALSE(read.binding.meets);
  pressed.binding.meets = true;
  const FaceFile meeting = parseFaceFile(faceFileToBytes(pressed), "meeting.face");
  EXPECT_TRUE(meeting.binding.meets);
  EXPECT_LT(judged(meeting, opening()).lips_overlap_mm, judged(read, opening()).lips_overlap_mm)
      << "what presses them too far is moved apart";
}

TEST_F(FaceJudgeTest, LipsAreTuckedByTheFacesShare) {
  JudgedPoses poses = opening();
  const std::size_t row = poses.rows.size() / 2;
  const auto lowerLipIn = [&](float tuck, double share) {
    for (LipPose& lips : poses.lips) lips.tuck = tuck;
    FaceFile face = file_;
    face.binding.tuck = asFloat(share);
    const FaceFile read = parseFaceFile(faceFileToBytes(face), "tucked.face");
    EXPECT_EQ(read.binding.tuck, face.binding.tuck);
    const FaceRig rig = FaceRig::of(read, mesh_, "tucked.face");
    VertexPositions moved;
    rig.deform(rig.retarget(poses.motion, nullptr, poses.lips).pose(FrameIndex{row}), poses.tongue[row], moved);
    return moved;
  };
  const VertexPositions untucked = lowerLipIn(0, 1), whole = lowerLipIn(1, 1);
  const float way = (whole - untucked).rowwise().norm().maxCoeff();
  EXPECT_GT(way, 0.02F * asFloat(file_.control.mouth_width));
  EXPECT_LT((lowerLipIn(1, 0.5) - lowerLipIn(0.5F, 1)).rowwise().norm().maxCoeff(), 0.02F * way);
  FaceFile wrong = file_;
  wrong.binding.tuck = -1;
  EXPECT_THROW(FaceRig::of(wrong, mesh_, "wrong.face"), InputError);
}

/// No marker shows how the lower lip goes to the teeth: its skin is measured by its rim's way, but no lip pops there.
TEST_F(FaceJudgeTest, StepsToTheTeethAreMeasuredByTheRims) {
  const auto tuckedWithin = [&](int steps) {
    JudgedPoses poses = opening();
    poses.motion.positions_mm.rowwise() = Eigen::RowVectorXd(poses.motion.positions_mm.row(0));
    for (std::size_t i = 0; i < poses.lips.size(); ++i) {
      poses.lips[i] = {.seal = 0, .tuck = std::min(1.0F, asFloat(i) / asFloat(steps))};
      poses.rows[i].closed = false;
    }
    return judged(file_, poses);
  };
  const FaceJudgement glides = tuckedWithin(4);
  EXPECT_GT(glides.jump_ratio, 0.7);
  EXPECT_LT(glides.jump_ratio, 1.5) << "on this face it goes along with them";
  EXPECT_EQ(faultOf(glides, "vertex jump"), nullptr);
  for (const int steps : {1, 2}) {
    const FaceJudgement pops = tuckedWithin(steps);
    ASSERT_NE(faultOf(pops, "vertex jump"), nullptr) << steps << " of a sixtieth: " << pops.jump_ratio;
    EXPECT_NE(faultOf(pops, "vertex jump")->what.find("LIP_LO"), std::string::npos);
  }
}

TEST_F(FaceJudgeTest, OneBindingAfterTheOtherIsJudgedAsByItself) {
  const JudgedPoses poses = opening();
  const FaceRig rig = FaceRig::of(file_, mesh_, "default.face");
  const FaceJudge judge(rig, file_, poses, {test::madeUpActor().neutral_mm, 0});
  FaceFile pressed = file_;
  pressed.binding.pressed.assign(kLipColumns, asFloat(0.015 * file_.control.mouth_width));
  for (const FaceFile* face : {&std::as_const(pressed), &std::as_const(file_), &std::as_const(pressed)}) {
    const FaceJudgement found = judge.judge(FaceRig::of(*face, mesh_, "default.face")), alone = judged(*face, poses);
    EXPECT_EQ(found.lips_overlap_mm, alone.lips_overlap_mm);
    EXPECT_EQ(found.jump_ratio, alone.jump_ratio);
    EXPECT_EQ(found.warp_stretch_least, alone.warp_stretch_least);
    EXPECT_EQ(found.torn, alone.torn);
    EXPECT_EQ(found.faults.size(), face == &file_ ? 0U : 1U);
  }
}

TEST_F(FaceJudgeTest, JudgesWhollyOnlyWhereMoreClosuresTouch) {
  const JudgedPoses poses = opening();
  const FaceRig rig = FaceRig::of(file_, mesh_, "default.face");
  const FaceJudge judge(rig, file_, poses, {test::madeUpActor().neutral_mm, 0});
  const FaceJudgement whole = judge.judge(rig);
  ASSERT_GT(whole.touching, 0U);
  EXPECT_FALSE(judge.judgeIfMoreTouch(rig, whole.touching));
  const auto found = judge.judgeIfMoreTouch(rig, whole.touching - 1);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->touching, whole.touching);
  EXPECT_EQ(found->edge_ratio, whole.edge_ratio);
}

/// The mesh with every triangle apart, and whose vertex each of its vertices was.
std::pair<FaceMesh, Welding> takenApart(const FaceMesh& whole) {
  FaceMesh apart = whole;
  apart.texture_coordinates.clear();
  apart.vertex_colors.clear();
  Welding back{whole, {}, std::vector<std::uint32_t>(whole.vertexCount())};
  for (Triangle& t : apart.triangles) {
    for (std::uint32_t& v : t) {
      back.given_of[v] = static_cast<std::uint32_t>(back.welded_of.size());
      back.welded_of.push_back(std::exchange(v, back.given_of[v]));
    }
  }
  apart.vertices = whole.vertices(back.welded_of, Eigen::all);
  return {std::move(apart), std::move(back)};
}

TEST_F(FaceJudgeTest, ASewnHeadIsJudgedAsTheGivenOneIs) {
  const auto [apart, back] = takenApart(mesh_);
  const FaceFile torn = hungOnEachOther(file_);
  FaceFile given = torn;
  given.binding = givenBinding(torn.binding, back);
  const Welding welding = weldSplitTriangles(apart);
  ASSERT_FALSE(welding.isNothing());
  FaceFile sewn = given;
  sewn.binding = weldedBinding(given.binding, welding);
  const JudgedPoses poses = opening();
  const FaceRig rig = FaceRig::of(given, apart, "apart.face");
  const FaceJudge judge(rig, given, poses, {test::madeUpActor().neutral_mm, 0});
  const FaceJudgement of_given = judge.judge(rig), of_sewn = judge.judge(FaceRig::of(sewn, welding.mesh, "apart.face"));
  EXPECT_FALSE(of_given.torn.empty());
  EXPECT_EQ(of_sewn.torn, of_given.torn);
  EXPECT_EQ(of_sewn.edge_growth_mm, of_given.edge_growth_mm);
  EXPECT_EQ(of_sewn.lips_overlap_mm, of_given.lips_overlap_mm);
  ASSERT_EQ(of_sewn.faults.size(), of_given.faults.size());
  for (std::size_t i = 0; i < of_given.faults.size(); ++i) EXPECT_EQ(of_sewn.faults[i].what, of_given.faults[i].what);
}

TEST_F(FaceJudgeTest, LipsInEachOtherAreHeldApart) {
  FaceFile face = file_;
  const auto pressed = asFloat(0.015 * file_.control.mouth_width);
  face.binding.pressed.assign(kLipColumns, pressed);
  const JudgedPoses poses = opening();
  const ActorPose actor{test::madeUpActor().neutral_mm, 0};
  FaceRig rig = FaceRig::of(face, mesh_, "default.face");
  const FaceJudgement before = judgeFace(rig, face, poses, actor);
  ASSERT_NE(faultOf(before, "lips in each other"), nullptr) << before.lips_overlap_mm;
  EXPECT_NEAR(1000 * mesh_.metres_per_unit * *std::max_element(before.overlaps.begin(), before.overlaps.end()),
              before.lips_overlap_mm, 1e-9);
  const FaceJudgement mended = mendFace(face, rig, poses, actor, before);
  EXPECT_EQ(faultOf(mended, "lips in each other"), nullptr) << mended.lips_overlap_mm;
  EXPECT_LT(*std::min_element(face.binding.pressed.begin(), face.binding.pressed.end()), pressed);
  EXPECT_EQ(mended.touching, before.touching);
}

TEST_F(FaceJudgeTest, SeesLipsThatHangOnEachOther) {
  const FaceFile torn = hungOnEachOther(file_);
  const FaceJudgement found = judged(torn, opening());
  const FaceFault* fault = faultOf(found, "stretch");
  ASSERT_NE(fault, nullptr);
  EXPECT_GT(found.edge_growth_mm, 5);
  EXPECT_NE(fault->what.find("vertex"), std::string::npos) << fault->what;
  EXPECT_NE(fault->what.find("in pose"), std::string::npos) << fault->what;
  EXPECT_FALSE(fault->triangles.empty());
  ASSERT_TRUE(fault->pose);
  EXPECT_GT(*fault->pose, 0U) << "at rest nothing shows";
}

/// Skin around the chin that swings out beyond its markers, as where two of them that part lie close together.
TEST_F(FaceJudgeTest, SeesSkinThatLeavesItsMarkers) {
  const FaceJudgement whole = judged(file_, opening());
  EXPECT_LT(whole.off_markers_mm, 2.5);
  FaceFile swung = file_;
  const auto chin = std::find(swung.marker_names.begin(), swung.marker_names.end(), "CHIN_UP");
  for (ControlPoint& point : swung.control.points) {
    if (!point.name.starts_with("FILL_")) continue;
    for (PointDriver& driver : point.drivers) {
      if (driver.point == chin - swung.marker_names.begin() && driver.weight > 0.3) driver.weight *= 4;
    }
  }
  const FaceJudgement found = judged(swung, opening());
  const FaceFault* fault = faultOf(found, "skin off its markers");
  ASSERT_NE(fault, nullptr) << found.off_markers_mm;
  EXPECT_GT(found.off_markers_mm, 5);
  EXPECT_NE(fault->what.find("vertex"), std::string::npos) << fault->what;
  EXPECT_NE(fault->what.find("in pose"), std::string::npos) << fault->what;
  EXPECT_FALSE(fault->triangles.empty());
  ASSERT_TRUE(fault->pose);
  EXPECT_GT(*fault->pose, 0U) << "at rest nothing shows";
}

TEST_F(FaceJudgeTest, SeesAFaceThatDoesNotMove) {
  FaceFile frozen = file_;
  std::fill(frozen.binding.skin_weight.begin(), frozen.binding.skin_weight.end(), 0.0F);
  std::fill(frozen.binding.jaw_weight.begin(), frozen.binding.jaw_weight.end(), 0.0F);
  const FaceJudgement found = judged(frozen, opening());
  EXPECT_NE(faultOf(found, "motion"), nullptr);
  EXPECT_NE(faultOf(found, "lip motion"), nullptr);
}

TEST_F(FaceJudgeTest, SeesClosuresThatStayOpen) {
  JudgedPoses gaping = opening();
  gaping.rows[6].closed = true;
  const FaceJudgement found = judged(file_, gaping);
  EXPECT_EQ(found.touching, 2);
  ASSERT_NE(faultOf(found, "closures"), nullptr);
  EXPECT_EQ(faultOf(found, "closures")->pose, 6U);
}

TEST_F(FaceJudgeTest, SeesAMouthThatOpensLopsided) {
  const FaceJudgement even = judged(file_, opening());
  ASSERT_TRUE(even.lopsided_mm) << "the default face is alike on both sides";
  FaceFile lame = file_;  // the right side goes half as far
  for (std::size_t v = 0; v < lame.binding.skin_weight.size(); ++v) {
    if (mesh_.vertices(signedIndex(v), 0) < 0) lame.binding.skin_weight[v] *= 0.5F;
  }
  const FaceJudgement found = judged(lame, opening());
  const FaceFault* fault = faultOf(found, "lopsided motion");
  ASSERT_NE(fault, nullptr) << *found.lopsided_mm;
  EXPECT_FALSE(fault->triangles.empty());
  ASSERT_TRUE(fault->pose);
  EXPECT_GT(*fault->pose, 0U);
}

/// What the actor's own sides do differently is no fault of the head.
TEST_F(FaceJudgeTest, ALopsidedActorIsNoLopsidedHead) {
  JudgedPoses poses = opening();
  for (std::size_t m = 0; m < poses.motion.marker_names.size(); ++m) {
    if (!poses.motion.marker_names[m].ends_with("_R")) continue;
    for (Eigen::Index f = 0; f < poses.motion.positions_mm.rows(); ++f) {
      double& height = poses.motion.positions_mm(f, 3 * signedIndex(m) + 1);
      height += 0.5 * (poses.motion.positions_mm(0, 3 * signedIndex(m) + 1) - height);
    }
  }
  const FaceJudgement found = judged(file_, poses);
  ASSERT_TRUE(found.lopsided_mm);
  EXPECT_EQ(faultOf(found, "lopsided motion"), nullptr) << *found.lopsided_mm;
}

TEST_F(FaceJudgeTest, LooksAtTheWarpWhereItIsUsed) {
  // Two markers one behind the other change places on the head: space between them is turned inside out.
  FaceFile folded = file_;
  const auto row = [&](const char* name) {
    return std::find(folded.marker_names.begin(), folded.marker_names.end(), name) - folded.marker_names.begin();
  };
  const Eigen::RowVector3d upper = folded.marker_targets.row(row("LIP_LO_MID"));
  folded.marker_targets.row(row("LIP_LO_MID")) = folded.marker_targets.row(row("CHIN_UP"));
  folded.marker_targets.row(row("CHIN_UP")) = upper;
  const FaceJudgement found = judged(folded, opening());
  EXPECT_GT(found.warp_folds, 0U);
  ASSERT_NE(faultOf(found, "warp fold-overs in use"), nullptr);
}

/// Brows half as far from the middle as the actor's: the warp that errs least folds skin between them over, a smoother
/// one does not. Where none of them helps the one that errs least stays.
TEST_F(FaceJudgeTest, ASmootherWarpIsTakenWhereTheBestOneFoldsSkin) {
  const test::MadeUpActor actor = test::madeUpActor();
  FitRequest request;
  request.marker_names = actor.names;
  request.actor_neutral_mm = actor.neutral_mm;
  request.warp.any_kernel = true;
  for (const double narrow : {0.5, 0.3}) {
    SCOPED_TRACE(narrow);
    Anchors anchors = test::defaultFace().anchors;
    for (std::size_t i = 0; i < actor.names.size(); ++i) {
      Eigen::Vector3d place = file_.marker_targets.row(signedIndex(i)).transpose();
      if (actor.names[i].starts_with("BROW_")) place.x() *= narrow;
      anchors.markers[actor.names[i]] = place;
    }
    FaceMesh mesh = test::defaultFace().mesh;
    FaceFile face = fitFace(mesh, anchors, "narrow brows", request);
    const WarpOptions taken = face.warp;
    const std::size_t folds = checkFace(face, mesh).fold_overs;
    face.warp = RbfWarp::fit(face.actor_neutral_mm, face.marker_targets, request.warp).options();
    EXPECT_GT(checkFace(face, mesh).fold_overs, 0U) << "of the one that errs least";
    if (narrow == 0.5) {
      EXPECT_EQ(folds, 0U);
      EXPECT_GT(taken.regularization, face.warp.regularization);
    } else {
      EXPECT_EQ(taken.regularization, face.warp.regularization);
      EXPECT_EQ(taken.kernel, face.warp.kernel);
    }
  }
}

}  // namespace
}  // namespace mouthpiece
