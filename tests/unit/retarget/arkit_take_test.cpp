// `corpus convert --arkit-head`: Live Link Face's weights as markers on a head that has the shapes.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "deform/mesh/face_mesh.h"
#include "motion/formats/motion_file.h"
#include "retarget/rig/face_fit.h"
#include "retarget/rig/face_rig.h"
#include "support/run_program.h"
#include "test_face.h"
#include "units/file/corpus.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;
using test::runProgram;
using test::ScratchFolder;

const fs::path kSample = fs::path(MOUTHPIECE_BUILD_SHARE_DIR) / "sample.corpus";

/// Two triangles of skin and a shape that lowers one corner and moves another sideways.
FaceMesh patch() {
  FaceMesh mesh;
  mesh.vertices.resize(4, 3);
  mesh.vertices << 0, 0, 0, 0.1F, 0, 0, 0, 0.1F, 0, 0.1F, 0.1F, 0;
  mesh.triangles = {{0, 1, 2}, {1, 3, 2}};
  mesh.parts = {{.name = "skin", .triangle_count = 2}};
  mesh.metres_per_unit = 1;
  return mesh;
}

TEST(MarkerShapes, AMarkerMovesAsTheCornersOfItsTriangle) {
  FaceShapes shapes{{"jawOpen"}, {VertexPositions::Zero(4, 3)}};
  shapes.moves[0].row(0) << 0, -0.03F, 0;
  shapes.moves[0].row(1) << 0.006F, 0, 0;
  MarkerPositions places(2, 3);
  places << 0, 0, 0.02, 0.05, 0.025, -0.01;  // off the skin: carried to it
  const MarkerShapes markers = markerShapes(patch(), shapes, places, "patch");
  EXPECT_LT((markers.neutral_mm.row(0) - Eigen::RowVector3d(0, 0, 0)).norm(), 1e-4);
  EXPECT_LT((markers.neutral_mm.row(1) - Eigen::RowVector3d(50, 25, 0)).norm(), 1e-4);
  EXPECT_LT((markers.moves_mm[0].row(0) - Eigen::RowVector3d(0, -30, 0)).norm(), 1e-4);
  // Shares of the corners: 0.25, 0.5, 0.25.
  EXPECT_LT((markers.moves_mm[0].row(1) - Eigen::RowVector3d(3, -7.5, 0)).norm(), 1e-4);

  Eigen::MatrixXd weights(3, 1);
  weights << 0, 0.5, std::nan("");
  const PositionMatrix driven = drivenMarkers(markers, weights);
  EXPECT_LT((driven.block<1, 3>(1, 3) - Eigen::RowVector3d(51.5, 21.25, 0)).norm(), 1e-4);
  EXPECT_TRUE(driven.row(2).array().isNaN().all());
}

class ArkitTake : public testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists(test::kSharedFaces / "ict_arkit.glb")) GTEST_SKIP() << "no heads in " << test::kSharedFaces;
    if (!fs::exists(kSample)) GTEST_SKIP() << "no " << kSample << "; make it with `make`";
  }
  /// The first seconds of a take of the sample corpus.
  static MotionClip shortMotion() {
    const Corpus corpus = readCorpus(kSample, CorpusAudio::kSkip, CorpusMotion::kOnDemand);
    MotionClip motion = corpus.take_source->load(TakeIndex(0));
    motion.positions_mm = motion.positions_mm.topRows(std::min<Eigen::Index>(150, motion.positions_mm.rows())).eval();
    return motion;
  }
  ScratchFolder folder_;
};

TEST_F(ArkitTake, GivesTheMotionBackThatOurExportMadeWeightsOf) {
  const fs::path face = folder_.path() / "head.face", csv = folder_.path() / "live_link.csv";
  const fs::path motion_file = folder_.path() / "motion.c3d", take_file = folder_.path() / "take.c3d";
  const MotionClip motion = shortMotion();
  writeMotion(motion_file, motion);
  const auto run = [](const char* program, const std::vector<std::string>& arguments) {
    const test::ProgramResult result = runProgram(program, arguments);
    ASSERT_EQ(result.exit_code, 0) << result.err;
  };
  run("retarget", {"fit", "--mesh", (test::kSharedFaces / "ict_arkit.glb").string(), "--anchors",
                   (test::kSharedFaces / "ict_head.landmarks.json").string(), "--corpus", kSample.string(), "--out",
                   face.string()});
  run("retarget",
      {"apply", "--face", face.string(), "--motion", motion_file.string(), "--out", csv.string(), "--quiet"});
  run("corpus", {"convert", csv.string(), take_file.string(), "--layout", "mediapipe66", "--arkit-head", face.string(),
                 "--fps", fmt::format("{}", motion.frame_rate_hz)});

  const MotionClip take = readMotion(take_file);
  const FaceRig rig = FaceRig::load(face);
  const PositionMatrix wanted = 1000 * rig.mesh().metres_per_unit * rig.retarget(motion).markers();
  ASSERT_EQ(take.frameCount(), motion.frameCount());
  ASSERT_EQ(take.marker_names, motion.marker_names);
  // Each marker about its own mean: the shapes start from the head's rest, the motion from the actor's.
  const auto still = [](const PositionMatrix& positions) -> PositionMatrix {
    return positions.rowwise() - positions.colwise().mean();
  };
  const auto rms = [&](const PositionMatrix& values) {
    return std::sqrt(values.squaredNorm() / static_cast<double>(values.size() / 3));
  };
  const double error_mm = rms(still(take.positions_mm) - still(wanted)), motion_mm = rms(still(wanted));
  RecordProperty("error_mm", fmt::format("{:.2f} of {:.2f}", error_mm, motion_mm));
  EXPECT_LT(error_mm, 0.5 * motion_mm);
  EXPECT_LT(error_mm, 1.0);

  // The same from the GLB and the landmarks beside it.
  const fs::path again = folder_.path() / "again.c3d";
  run("corpus", {"convert", csv.string(), again.string(), "--arkit-head",
                 (test::kSharedFaces / "ict_arkit.glb").string(), "--fps", fmt::format("{}", motion.frame_rate_hz)});
  EXPECT_LT((readMotion(again).positions_mm - take.positions_mm).cwiseAbs().maxCoeff(), 0.01);
}

TEST_F(ArkitTake, RefusesWhatIsNoTrackAndHeadsWithoutShapes) {
  const auto complaint = [&](const std::string& csv, const fs::path& head) {
    const fs::path file = folder_.write("x.csv", csv);
    const auto result =
        runProgram("corpus", {"convert", file.string(), (folder_.path() / "x.c3d").string(), "--arkit-head",
                              head.string(), "--anchors", (test::kSharedFaces / "ict_head.landmarks.json").string()});
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    return result.err;
  };
  const std::string good = "Timecode,BlendShapeCount,JawOpen\n0:0:0:0.0,1,0\n0:0:0:1.0,1,0.5\n";
  EXPECT_NE(complaint("time_s,A.x,A.y,A.z\n0,1,2,3\n", test::kSharedFaces / "ict_arkit.glb").find("Timecode"),
            std::string::npos);
  EXPECT_NE(complaint(good, test::kSharedFaces / "ict_head.obj").find("none with an ARKit name"), std::string::npos);
  EXPECT_NE(complaint(good, folder_.path() / "none.glb").find("none.glb"), std::string::npos);
  EXPECT_FALSE(fs::exists(folder_.path() / "x.c3d"));
}

}  // namespace
}  // namespace mouthpiece
