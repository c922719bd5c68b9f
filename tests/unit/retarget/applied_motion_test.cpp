// What `retarget apply` does with motion that would tear a face.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <functional>

#include "deform/mesh/face_mesh.h"
#include "motion/formats/motion_file.h"
#include "motion/marker_layout.h"
#include "support/run_program.h"
#include "test_face.h"
#include "units/file/corpus.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;
using test::ProgramResult;
using test::runProgram;
using test::ScratchFolder;

constexpr float kHeldStillMm = 0.5F;  ///< of a vertex: skin that moves takes the head along by some tenths
constexpr float kLedPastMm = 1.5F;    ///< the gap of one sample is filled from its neighbours

class AppliedMotion : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!test::canonicalFace()) GTEST_SKIP() << test::kNoCanonicalFace;
    const test::MadeUpActor actor = test::madeUpActor();
    Corpus corpus;
    corpus.name = "madeup";
    corpus.layout = defaultLayout();
    corpus.neutral_pose_mm = actor.neutral_mm;
    corpus.takes.push_back(test::openingTake(actor));
    motion_ = corpus.takes[0].motion;
    writeCorpus(folder_.path() / "madeup.corpus", corpus);
    const ProgramResult made = runProgram(
        "retarget", {"sample", "--out", folder_.path().string(), "--canonical", test::canonicalFace()->string(),
                     "--corpus", (folder_.path() / "madeup.corpus").string()});
    ASSERT_EQ(made.exit_code, 0) << made.err;
  }

  ProgramResult apply(const MotionClip& motion, const std::string& out) const {
    const fs::path file = folder_.path() / "take.c3d";
    writeMotion(file, motion);
    return runProgram("retarget", {"apply", "--face", (folder_.path() / "default.face").string(), "--motion",
                                   file.string(), "--out", (folder_.path() / out).string()});
  }
  MotionClip changed(const std::function<void(MotionClip&)>& change) const {
    MotionClip motion = motion_;
    change(motion);
    return motion;
  }
  VertexPositions frame(const std::string& out, int number) const {
    return readFaceMesh(folder_.path() / out / ("default.000" + std::to_string(number) + ".obj")).vertices;
  }
  static auto samples(MotionClip& motion, const std::string& marker) {
    return motion.positions_mm.middleCols<3>(3 * motion.findMarker(marker)->row());
  }

  ScratchFolder folder_;
  MotionClip motion_;
};

TEST_F(AppliedMotion, AHeadThatTurnsIsHeldStill) {
  const ProgramResult still = apply(motion_, "still");
  ASSERT_EQ(still.exit_code, 0) << still.err;
  EXPECT_EQ(still.err, "");
  const MotionClip turning = changed([](MotionClip& motion) {
    for (Eigen::Index f = 0; f < motion.positions_mm.rows(); ++f) {
      const double angle = 0.35 * std::sin(0.5 * static_cast<double>(f));
      const Eigen::Matrix3d turn = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY()).toRotationMatrix();
      for (Eigen::Index column = 0; column < motion.positions_mm.cols(); column += 3) {
        auto place = motion.positions_mm.block<1, 3>(f, column);
        place = (place * turn.transpose()).eval() + Eigen::RowVector3d(200, 0, 3 * static_cast<double>(f));
      }
    }
  });
  const ProgramResult held = apply(turning, "held");
  EXPECT_EQ(held.exit_code, 0);
  EXPECT_NE(held.err.find("the head turns by up to 20 degrees"), std::string::npos) << held.err;
  EXPECT_LT((frame("held", 6) - frame("still", 6)).rowwise().norm().maxCoeff(), kHeldStillMm);
}

TEST_F(AppliedMotion, TheHeadThatWasFittedIsNotReplaced) {
  const std::string before = test::readAll(folder_.path() / "default.obj");
  const ProgramResult made = apply(motion_, "default.obj");
  EXPECT_EQ(made.exit_code, 1);
  EXPECT_EQ(test::readAll(folder_.path() / "default.obj"), before);
}

TEST_F(AppliedMotion, AGlitchIsLedPastAndTold) {
  ASSERT_EQ(apply(motion_, "still").exit_code, 0);
  const ProgramResult told =
      apply(changed([](MotionClip& motion) { samples(motion, "LIP_LO_MID")(6, 1) -= 80; }), "led");
  EXPECT_EQ(told.exit_code, 0);
  EXPECT_NE(told.err.find("LIP_LO_MID jumps 80 mm off its path at 0.10 s"), std::string::npos) << told.err;
  EXPECT_LT((frame("led", 6) - frame("still", 6)).rowwise().norm().maxCoeff(), kLedPastMm);
}

TEST_F(AppliedMotion, WhatTearsTheFaceIsTold) {
  const ProgramResult told = apply(
      changed([](MotionClip& motion) { samples(motion, "LIP_LO_MID").col(1).bottomRows(7).array() -= 22; }), "torn");
  EXPECT_NE(told.err.find("tears the face: an edge of"), std::string::npos) << told.err;
  EXPECT_NE(told.err.find(" beside LIP_"), std::string::npos) << told.err;
}

TEST_F(AppliedMotion, MotionOfNoSuchFaceIsRefused) {
  const auto refused = [&](const std::function<void(MotionClip&)>& change, const std::string& why) {
    const ProgramResult told = apply(changed(change), "none.glb");
    EXPECT_EQ(told.exit_code, 1) << why;
    EXPECT_NE(told.err.find(why), std::string::npos) << told.err;
    EXPECT_FALSE(fs::exists(folder_.path() / "none.glb")) << why;
  };
  refused([](MotionClip& motion) { motion.positions_mm *= 1.3; }, "its face is 1.3");
  refused(
      [](MotionClip& motion) {
        const Eigen::MatrixXd right = samples(motion, "LIP_CORNER_R");
        samples(motion, "LIP_CORNER_R") = samples(motion, "LIP_CORNER_L").eval();
        samples(motion, "LIP_CORNER_L") = right;
      },
      "LIP_CORNER_R lies where the actor has LIP_CORNER_L");
  refused(
      [](MotionClip& motion) {
        for (Eigen::Index column = 0; column < motion.positions_mm.cols(); column += 3)
          motion.positions_mm.col(column) *= -1;
      },
      "markers lie over 25 mm from the actor's neutral pose");
  refused([](MotionClip& motion) { samples(motion, "LIP_LO_MID").middleRows(3, 2).setConstant(std::nan("")); },
          "LIP_LO_MID is not seen from 0.05 s on for 2 frames");
}

TEST_F(AppliedMotion, AMarkerThatNoFrameShowsIsLeftOut) {
  const ProgramResult told =
      apply(changed([](MotionClip& motion) { samples(motion, "CHIN_LOW").setConstant(std::nan("")); }), "chinless");
  EXPECT_EQ(told.exit_code, 0);
  EXPECT_NE(told.err.find("no frame shows CHIN_LOW"), std::string::npos) << told.err;
}

}  // namespace
}  // namespace mouthpiece
