// .face files: there and back, and every kind of damage.
#include "retarget/rig/face_file.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <random>
#include <tuple>

#include "base/errors.h"
#include "base/files.h"
#include "base/index.h"
#include "deform/mesh/face_mesh.h"
#include "motion/marker_layout.h"
#include "retarget/rig/face_rig.h"
#include "support/allocations.h"
#include "support/cbor_tree.h"
#include "support/run_program.h"
#include "test_face.h"

namespace mouthpiece {
namespace {

using nlohmann::json;
using test::ScratchFolder;

class FaceFileTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!test::canonicalFace()) GTEST_SKIP() << test::kNoCanonicalFace;
  }
  static const FaceFile& face() {
    static FaceMesh mesh;
    static const FaceFile made = test::fittedDefaultFace(mesh);
    return made;
  }
  static json tree() { return test::cborTree(faceFileToBytes(face())); }
  /// What the reader says of a changed file.
  static std::string messageOf(const json& changed) {
    std::string bytes;
    json::to_cbor(changed, bytes);
    return messageOfBytes(bytes);
  }
  static std::string messageOfBytes(std::string_view bytes) {
    try {
      parseFaceFile(bytes, "x.face");
    } catch (const InputError& error) {
      return error.what();
    }
    return "no error";
  }
};

TEST_F(FaceFileTest, ComesBackByteForByte) {
  const std::string bytes = faceFileToBytes(face());
  EXPECT_EQ(faceFileToBytes(parseFaceFile(bytes, "x.face")), bytes);
}

TEST_F(FaceFileTest, AFileFromBeforeRoundingWasKeptRoundsNothing) {
  json changed = tree();
  EXPECT_FALSE(changed.contains("actor_unseen_rounding"));
  changed["actor_unseen_rounding"] = {{"narrowing", 0.125}, {"protrusion", 0.0625}};
  const auto read = [&changed] {
    std::string bytes;
    json::to_cbor(changed, bytes);
    return parseFaceFile(bytes, "x.face").actor_unseen;
  };
  EXPECT_EQ(read().narrowing, 0.125);
  EXPECT_EQ(read().protrusion, 0.0625);
  FaceFile kept = face();
  kept.actor_unseen = read();
  EXPECT_EQ(parseFaceFile(faceFileToBytes(kept), "x.face").actor_unseen.narrowing, 0.125);
  changed.erase("actor_unseen_rounding");
  EXPECT_EQ(read().narrowing, 0);
  EXPECT_EQ(read().protrusion, 0);
}

TEST_F(FaceFileTest, AFileWithItsBlobsInTheMapIsReadToo) {
  json before = tree();
  before["version"] = 2;
  std::string bytes;
  json::to_cbor(before, bytes);
  EXPECT_EQ(faceFileToBytes(parseFaceFile(bytes, "x.face")), faceFileToBytes(face()));
}

TEST_F(FaceFileTest, NamesItsMeshFromItsOwnFolder) {
  json changed = tree();
  changed["mesh"]["file"] = "/etc/passwd";
  EXPECT_EQ(messageOf(changed),
            "x.face:mesh.file: found \"/etc/passwd\"; expected the name of a mesh, from the face file's folder");
}

TEST_F(FaceFileTest, TruncationIsRefusedWhereverItHappens) {
  const std::string bytes = faceFileToBytes(face());
  for (std::size_t size = 0; size < bytes.size(); size += 1 + size / 40) {
    EXPECT_NE(messageOfBytes(std::string_view(bytes).substr(0, size)), "no error") << size;
  }
}

TEST_F(FaceFileTest, DamagedBytesNeverDoMoreThanThrow) {
  std::string bytes = faceFileToBytes(face());
  std::mt19937 random(5);
  for (int i = 0; i < 300; ++i) {
    std::string damaged = bytes;
    for (int k = 0; k < 4; ++k)
      damaged[random() % std::min<std::size_t>(damaged.size(), 1 + (random() % 2 == 0 ? 20'000 : damaged.size()))] =
          static_cast<char>(random());
    messageOfBytes(damaged);
  }
  SUCCEED();
}

TEST_F(FaceFileTest, DeepNestingIsRefusedBeforeItOverflowsTheStack) {
  EXPECT_NE(messageOfBytes(std::string(1'000'000, '\x81')), "no error");  // an array of an array of ...
  EXPECT_NE(messageOfBytes("\xBF" + std::string(100, '\xA1')), "no error");
}

TEST_F(FaceFileTest, EveryMissingFieldIsNamed) {
  const json whole = tree();
  for (const auto& [key, value] : whole.items()) {
    json changed = whole;
    changed.erase(key);
    if (key == "actor_closed_lips_mm") continue;  // younger than the format's version
    EXPECT_EQ(messageOf(changed).rfind("x.face:" + key, 0), 0U) << key << " -> " << messageOf(changed);
    EXPECT_NE(messageOf(changed).find("is missing"), std::string::npos) << messageOf(changed);
  }
}

TEST_F(FaceFileTest, WrongValuesAreNamed) {
  const auto expectRefused = [&](const char* pointer, json value) {
    json changed = tree();
    changed[json::json_pointer(pointer)] = std::move(value);
    EXPECT_EQ(messageOf(changed).rfind("x.face:", 0), 0U) << pointer << " -> " << messageOf(changed);
  };
  expectRefused("/format", "mp3");
  expectRefused("/version", 1);
  expectRefused("/version", -1);
  expectRefused("/mesh/metres_per_unit", 0);
  expectRefused("/mesh/metres_per_unit", std::numeric_limits<double>::quiet_NaN());
  expectRefused("/mesh/file", "");
  expectRefused("/markers/0", 7);
  expectRefused("/markers/1", face().marker_names[0]);
  expectRefused("/marker_targets", json::binary(std::vector<std::uint8_t>(7)));
  expectRefused("/actor_neutral_mm", json::binary(std::vector<std::uint8_t>(66 * 24, 0xFF)));  // NaN
  expectRefused("/actor_unseen_rounding", {{"narrowing", 0.1}, {"protrusion", -0.1}});
  expectRefused("/warp/kernel", "gaussian");
  expectRefused("/warp/shape_factor", 0);
  expectRefused("/control/points/70/driver_points", json::binary({200, 0, 0, 0}));
  expectRefused("/control/points/0/rule", 9);
  expectRefused("/control/triangles", json::binary({1, 0, 0, 0, 2, 0, 0, 0, 255, 255, 255, 127}));
  expectRefused("/control/triangles", json::binary(std::vector<std::uint8_t>{}));
}

TEST_F(FaceFileTest, ANewerVersionSaysSo) {
  json changed = tree();
  changed["version"] = 7;
  EXPECT_EQ(messageOf(changed), "x.face:version: found 7; expected 2 or 3 (fit the face again with this program)");
}

class RigTest : public FaceFileTest {
 protected:
  void SetUp() override {
    FaceFileTest::SetUp();
    if (IsSkipped()) return;
    mesh_path_ = folder_.write("default.obj", objBytes(test::defaultFace().mesh));
    face_path_ = folder_.path() / "default.face";
    writeFaceFile(face_path_, face());
  }
  ScratchFolder folder_;
  std::filesystem::path mesh_path_, face_path_;
};

TEST_F(RigTest, AtNeutralTheFaceRests) {
  const FaceRig rig = FaceRig::load(face_path_);
  const test::MadeUpActor actor = test::madeUpActor();
  MotionClip clip{60, actor.names, PositionMatrix(1, actor.neutral_mm.size())};
  clip.positions_mm.row(0) = Eigen::Map<const Eigen::RowVectorXd>(actor.neutral_mm.data(), actor.neutral_mm.size());
  const FaceMotion motion = rig.retarget(clip);
  VertexPositions deformed;
  rig.deform(motion.pose(FrameIndex{0}), TonguePose{}, deformed);
  EXPECT_LT((deformed - rig.mesh().vertices).cwiseAbs().maxCoeff(), 1e-3F);
}

TEST_F(RigTest, MarkersMoveTheSkinUnderThem) {
  const FaceRig rig = FaceRig::load(face_path_);
  const test::MadeUpActor actor = test::madeUpActor();
  MotionClip clip{60, actor.names, PositionMatrix(1, actor.neutral_mm.size())};
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0, 1.5);
  MarkerPositions pose = actor.neutral_mm;
  for (Eigen::Index i = 0; i < pose.size(); ++i) pose.data()[i] += noise(random);
  clip.positions_mm.row(0) = Eigen::Map<const Eigen::RowVectorXd>(pose.data(), pose.size());
  const FaceMotion motion = rig.retarget(clip);
  VertexPositions deformed;
  rig.deform(motion.pose(FrameIndex{0}), TonguePose{}, deformed);
  // Markers away from lips and lids, whose virtual neighbours have rules of their own.
  for (const char* name : {"CHEEK_MID_L", "CHIN_MID", "NOSE_BRIDGE", "BROW_MID_R", "LIP_UP_MID", "LIP_LO_MID"}) {
    const MarkerIndex marker = defaultLayout().indexOf(name);
    const int landmark = defaultLayout().markers[marker.value].mediapipe_landmark;
    const Eigen::RowVector3d asked = motion.markers().block<1, 3>(0, 3 * static_cast<Eigen::Index>(marker.value));
    EXPECT_LT((deformed.row(landmark).cast<double>() - asked).norm(), 0.2) << name;
  }
}

/// An actor with eyes twice as wide open blinks: the same millimetres would take the head's upper lids far through the
/// lower ones.
TEST_F(RigTest, LidsMeetAsTheActorsDo) {
  const FaceRig rig = FaceRig::load(face_path_);
  const test::MadeUpActor made_up = test::madeUpActor();
  ActorPose actor{made_up.neutral_mm, 0};
  const auto row = [&](const std::string& name) { return signedIndex(defaultLayout().indexOf(name).value); };
  for (const std::string side : {"R", "L"}) {
    actor.neutral_mm.row(row("LID_UP_" + side)) +=
        made_up.neutral_mm.row(row("LID_UP_" + side)) - made_up.neutral_mm.row(row("LID_LO_" + side));
  }
  MotionClip clip{60, made_up.names, PositionMatrix(11, actor.neutral_mm.size())};
  for (Eigen::Index f = 0; f < 11; ++f) {
    MarkerPositions pose = actor.neutral_mm;
    for (const std::string side : {"R", "L"}) {
      const Eigen::RowVector3d apart = pose.row(row("LID_UP_" + side)) - pose.row(row("LID_LO_" + side));
      pose.row(row("LID_UP_" + side)) -= 0.1 * asReal(f) * apart;
    }
    clip.positions_mm.row(f) = Eigen::Map<const Eigen::RowVectorXd>(pose.data(), pose.size());
  }
  const FaceMotion motion = rig.retarget(clip, &actor);
  for (const std::string side : {"R", "L"}) {
    const auto apartIn = [&](Eigen::Index f) -> Eigen::RowVector3d {
      return motion.markers().block<1, 3>(f, 3 * row("LID_UP_" + side)) -
             motion.markers().block<1, 3>(f, 3 * row("LID_LO_" + side));
    };
    const Eigen::RowVector3d open = apartIn(0);
    for (Eigen::Index f = 3; f < 11; ++f)
      EXPECT_NEAR(apartIn(f).dot(open) / open.squaredNorm(), 1 - 0.1 * asReal(f), 1e-6) << side << " " << f;
  }
}

TEST_F(RigTest, PosesAllocateNothing) {
  const FaceRig rig = FaceRig::load(face_path_);
  const FaceMotion motion = rig.retarget(test::openingTake(test::madeUpActor()).motion);
  VertexPositions out;
  EXPECT_GT(test::allocationsIn([&] { rig.deform(motion.pose(FrameIndex{6}), {}, out); }), 0U) << "nothing is counted";
  for (FrameIndex frame; frame.value < motion.frameCount(); ++frame) {
    const TonguePose tongue{.tip_up = 0.3F, .tip_forward = 0.8F};
    EXPECT_EQ(test::allocationsIn([&] { rig.deform(motion.pose(frame), tongue, out); }), 0U) << frame.value;
  }
}

TEST_F(RigTest, AMissingMarkerIsNamed) {
  const FaceRig rig = FaceRig::load(face_path_);
  MotionClip clip{60, {"LIP_UP_MID"}, PositionMatrix::Zero(1, 3)};
  try {
    (void)rig.retarget(clip);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("lacks the marker LIP_LO_MID"), std::string::npos) << error.what();
  }
}

TEST_F(RigTest, AChangedMeshIsRefused) {
  std::string bytes = test::readAll(mesh_path_);
  bytes[bytes.find("\nv ") + 3] = '9';
  std::ignore = folder_.write("default.obj", bytes);
  try {
    FaceRig::load(face_path_);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("has changed since default.face was fitted to it"), std::string::npos)
        << error.what();
  }
}

TEST_F(RigTest, AMissingMeshIsRefused) {
  std::filesystem::remove(mesh_path_);
  try {
    FaceRig::load(face_path_);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("is not there"), std::string::npos) << error.what();
  }
}

TEST_F(RigTest, TheGuardOfTheLipsIsReadAsItWasFound) {
  FaceFile guarded = FaceRig::load(face_path_).withSetUp(face());
  guarded.mesh = nullptr;
  writeFaceFile(face_path_, guarded);
  EXPECT_EQ(readFaceFile(face_path_).guard, guarded.guard);
  EXPECT_EQ(FaceRig::load(face_path_).withSetUp(face()).guard, guarded.guard);
  guarded.guard[2] = 0xFFFFFFFF;
  writeFaceFile(face_path_, guarded);
  try {
    FaceRig::load(face_path_);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_EQ(std::string(error.what()), face_path_.string() + ":guard: found a watch of no vertex or column");
  }
}

TEST_F(RigTest, TheMeshThatIsKeptIsTheOneThatWasRead) {
  const FaceMesh read = FaceRig::load(face_path_).mesh();
  const FaceFile whole = FaceRig::load(face_path_).withSetUp(face());
  const std::string bytes = faceFileToBytes(whole);
  const FaceFile again = parseFaceFile(bytes, "x.face");
  EXPECT_EQ(faceFileToBytes(again), bytes);
  ASSERT_NE(again.mesh, nullptr);
  EXPECT_EQ(again.mesh->vertices, read.vertices);
  EXPECT_EQ(again.mesh->triangles, read.triangles);
  EXPECT_EQ(again.mesh->vertex_colors, read.vertex_colors);
  EXPECT_EQ(again.mesh->texture_coordinates, read.texture_coordinates);
  EXPECT_EQ(again.mesh->metres_per_unit, read.metres_per_unit);
  ASSERT_EQ(again.mesh->parts.size(), read.parts.size());
  for (std::size_t i = 0; i < read.parts.size(); ++i) {
    const MeshPart &now = again.mesh->parts[i], &before = read.parts[i];
    EXPECT_EQ(std::tie(now.name, now.kind, now.first_triangle, now.triangle_count, now.base_color, now.roughness,
                       now.material, now.stands_off),
              std::tie(before.name, before.kind, before.first_triangle, before.triangle_count, before.base_color,
                       before.roughness, before.material, before.stands_off));
  }
}

TEST_F(RigTest, AKeptMeshThatDoesNotFitTogetherIsRefused) {
  const std::string bytes = faceFileToBytes(FaceRig::load(face_path_).withSetUp(face()));
  const json whole = test::cborTree(bytes);
  const auto expectRefused = [&](const char* key, json value) {
    json changed = whole;
    changed["mesh"]["stored"][json::json_pointer(key)] = std::move(value);
    EXPECT_EQ(messageOf(changed).rfind("x.face:mesh.stored.", 0), 0U) << key << " -> " << messageOf(changed);
  };
  const json no_numbers =
      json::binary(std::vector<std::uint8_t>(whole["mesh"]["stored"]["vertices"].get_binary().size(), 0xFF));
  expectRefused("/vertices", no_numbers);
  expectRefused("/vertices", json::binary({1, 2, 3, 4}));
  expectRefused("/triangles", json::binary(std::vector<std::uint8_t>(12, 0xFF)));
  expectRefused("/triangles", json::binary(std::vector<std::uint8_t>(12)));
  expectRefused("/parts/0/triangles", 1'000'000'000);
  expectRefused("/parts/0/kind", "fish");
  expectRefused("/looks", json::binary({1, 2, 3, 4}));
  expectRefused("/materials", json::binary({1, 2, 3, 4}));
  expectRefused("/vertex_colors", json::binary({0, 0, 0, 0}));
  expectRefused("/texture_coordinates", json::binary({0, 0, 0, 0}));
}

TEST_F(RigTest, ABindingOfAnotherMeshIsRefused) {
  FaceFile other = face();
  other.binding.patch.pop_back();
  writeFaceFile(face_path_, other);
  EXPECT_THROW(FaceRig::load(face_path_), InputError);
}

}  // namespace
}  // namespace mouthpiece
