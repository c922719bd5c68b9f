// A .face file of version 2 as `retarget fit` wrote it before the rooms of deform were sorted: it opens, moves its
// mesh, and is written again with the same contents.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "base/files.h"
#include "deform/mesh/face_mesh.h"
#include "motion/marker_layout.h"
#include "retarget/rig/face_fit.h"
#include "retarget/rig/face_rig.h"
#include "support/cbor_tree.h"

namespace mouthpiece {
namespace {

const std::filesystem::path kData = std::filesystem::path(MOUTHPIECE_SOURCE_DIR) / "tests/unit/retarget/data";
constexpr double kSame_mm = 1e-4;  ///< places are floats of up to 100 mm

const FaceFile& stored() {
  static const FaceFile face = readFaceFile(kData / "version2.face");
  return face;
}

TEST(Version2, Opens) {
  EXPECT_EQ(stored().name, "version 2");
  EXPECT_EQ(stored().mesh_file, "version2.obj");
  EXPECT_EQ(stored().marker_names.size(), 66U);
  EXPECT_EQ(stored().metres_per_unit, 0.001);
  EXPECT_GT(stored().control.points.size(), 110U);
  EXPECT_EQ(stored().control.rest_slopes.rows(), 2 * stored().control.rest.rows());
  const FaceMesh mesh = readMeshOf(stored(), kData / "version2.face");
  EXPECT_EQ(mesh.vertexCount(), stored().binding.patch.size());
  EXPECT_NO_THROW(checkBinding(stored().binding, mesh, stored().control, "version2.face"));
  EXPECT_EQ(faultsOf(checkFace(stored(), mesh)).size(), 2U)
      << "an egg is no head: what the program that wrote it finds";
}

TEST(Version2, IsWrittenAgainAsItWasButForWhereItsBlobsLie) {
  nlohmann::json written = test::cborTree(faceFileToBytes(stored()));
  EXPECT_EQ(written["version"], 3);
  written["version"] = 2;
  EXPECT_EQ(written, nlohmann::json::from_cbor(readFile(kData / "version2.face")));
}

TEST(Version2, MovesItsMesh) {
  const FaceRig rig = FaceRig::load(kData / "version2.face");
  MotionClip motion{60, stored().marker_names, PositionMatrix(2, 198)};
  MarkerPositions pose = stored().actor_neutral_mm;
  motion.positions_mm.row(0) = Eigen::RowVectorXd::Map(pose.data(), 198);
  for (std::size_t i = 0; i < stored().marker_names.size(); ++i) {
    const std::string& name = stored().marker_names[i];
    if (name.starts_with("LIP_LO") || name.starts_with("CHIN")) pose(signedIndex(i), 1) -= 12;
  }
  motion.positions_mm.row(1) = Eigen::RowVectorXd::Map(pose.data(), 198);
  const FaceMotion on_face = rig.retarget(motion);
  VertexPositions rest, open;
  rig.deform(on_face.pose(FrameIndex{0}), {}, rest);
  rig.deform(on_face.pose(FrameIndex{1}), {}, open);
  EXPECT_LT((rest - rig.mesh().vertices).cwiseAbs().maxCoeff(), 0.05F);
  // The slit's vertices follow each other, the lower one first.
  int pairs = 0;
  for (Eigen::Index v = 0; v + 1 < rest.rows(); ++v) {
    if (rig.mesh().vertices.row(v) != rig.mesh().vertices.row(v + 1)) continue;
    EXPECT_GT(open(v + 1, 1) - open(v, 1), 4.0F);
    ++pairs;
  }
  EXPECT_GE(pairs, 3);
}

}  // namespace
}  // namespace mouthpiece
