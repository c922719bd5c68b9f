// Shapes written into a GLB that was given.
#include "exports/gltf/glb.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <nlohmann/json.hpp>
#include <random>

#include "base/errors.h"
#include "deform/mesh/face_mesh.h"
#include "support/glb_file.h"

namespace mouthpiece {
namespace {

using test::GlbFile;

constexpr float kGivenWithin = 1e-6F;  ///< metres; floats through one rotation

/// Two parts with a texture, as a GLB.
std::string givenGlb() {
  FaceMesh mesh;
  mesh.metres_per_unit = 1;
  mesh.vertices.resize(6, 3);
  mesh.vertices << 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 2, 1, 0, 2, 0, 1, 2;
  mesh.triangles = {{0, 1, 2}, {3, 4, 5}};
  mesh.texture_coordinates.assign(6, {0.25F, 0.75F});
  mesh.parts = {{.name = "skin", .triangle_count = 1},
                {.name = "teeth", .first_triangle = 1, .triangle_count = 1, .roughness = 0.2F}};
  PrincipalShapes none;
  none.frame_rate_hz = 60;
  none.rest = Eigen::Map<const Eigen::RowVectorXf>(mesh.vertices.data(), mesh.vertices.size());
  none.shapes.resize(0, mesh.vertices.size());
  none.weights.resize(2, 0);
  return glbBytes(mesh, none, "head");
}

PrincipalShapes shapesFor(const FaceMesh& mesh) {
  std::mt19937 random(5);
  std::normal_distribution<float> move(0, 0.01F);
  PrincipalShapes shapes;
  shapes.frame_rate_hz = 50;
  shapes.rest = Eigen::Map<const Eigen::RowVectorXf>(mesh.vertices.data(), mesh.vertices.size());
  shapes.shapes = RowMajorMatrixF::Zero(3, mesh.vertices.size());
  for (Eigen::Index i = 0; i < 9; ++i) shapes.shapes(0, i) = move(random);
  shapes.shapes(1, 16) = move(random);
  shapes.weights = RowMajorMatrixF::Constant(4, 3, 0.5F);
  return shapes;
}

TEST(GivenGlb, GetsTheShapesAndKeepsTheRest) {
  const std::string given = givenGlb();
  const FaceMesh mesh = parseFaceMesh(given, "head.glb");
  const Eigen::Matrix3d upright = Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitX()).toRotationMatrix();
  const PrincipalShapes shapes = shapesFor(mesh);
  const auto made = glbWithShapes(given, "head.glb", shapes, upright);
  ASSERT_TRUE(made);
  const FaceMesh after = parseFaceMesh(*made, "head.glb");
  EXPECT_EQ(after.vertices, mesh.vertices);
  EXPECT_EQ(after.texture_coordinates, mesh.texture_coordinates);
  ASSERT_EQ(after.parts.size(), 2U);
  EXPECT_EQ(after.parts[1].roughness, 0.2F);
  const FaceShapes read = parseFaceShapes(*made, "head.glb");
  ASSERT_EQ(read.moves.size(), 2U) << "the third shape moves nothing";
  for (std::size_t k = 0; k < 2; ++k) {
    const Eigen::RowVectorXf row = shapes.shapes.row(static_cast<Eigen::Index>(k));
    const VertexPositions wanted = Eigen::Map<const VertexPositions>(row.data(), 6, 3) * upright.cast<float>();
    EXPECT_LT((read.moves[k] - wanted).cwiseAbs().maxCoeff(), kGivenWithin) << k;
  }
  const nlohmann::json root = GlbFile(*made).root;
  ASSERT_EQ(root["animations"].size(), 1U);
  EXPECT_EQ(root["accessors"][root["animations"][0]["samplers"][0]["output"].get<std::size_t>()]["count"], 8);
}

/// Where the first frame of `speech` and the weights at rest show the first primitive's vertices.
VertexPositions shownInSpeech(const GlbFile& glb) {
  const nlohmann::json& primitive = glb.root["meshes"][0]["primitives"][0];
  const std::vector<double> base = glb.accessor(primitive["attributes"]["POSITION"]);
  const nlohmann::json& animation = glb.root["animations"].back();
  const std::vector<double> keys = glb.accessor(animation["samplers"][0]["output"]);
  VertexPositions shown = Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>>(
                              base.data(), static_cast<Eigen::Index>(base.size() / 3), 3)
                              .cast<float>();
  for (std::size_t k = 0; k < primitive["targets"].size(); ++k) {
    const std::vector<double> moves = glb.accessor(primitive["targets"][k]["POSITION"]);
    for (Eigen::Index i = 0; i < shown.size(); ++i)
      shown.data()[i] += static_cast<float>(keys[k] * moves[static_cast<std::size_t>(i)]);
  }
  return shown;
}

TEST(GivenGlb, LipsOfAHeadWithAShapeLeftUpMeet) {
  const FaceMesh plain = parseFaceMesh(givenGlb(), "head.glb");
  PrincipalShapes jaw = shapesFor(plain);
  jaw.shapes = RowMajorMatrixF::Zero(1, plain.vertices.size());
  jaw.shapes(0, 1) = -0.5F;  // the first vertex goes down
  jaw.weights.resize(0, 1);
  const std::vector<std::string> names{"jawOpen"};
  const auto with_jaw = glbWithShapes(givenGlb(), "head.glb", jaw, Eigen::Matrix3d::Identity(), {}, nullptr, names);
  ASSERT_TRUE(with_jaw);
  for (const char* owner : {"meshes", "nodes"}) {
    GlbFile left_up(*with_jaw);
    left_up.root["meshes"][0]["weights"] = {0.0};
    left_up.root[owner][0]["weights"] = {0.6};
    const std::string given = left_up.toBytes();
    const FaceMesh mesh = parseFaceMesh(given, "head.glb");
    EXPECT_FLOAT_EQ(mesh.vertices(0, 1), -0.3F) << owner;
    PrincipalShapes closing = jaw;  // the first vertex goes to the third, wherever it rests
    closing.shapes.setZero();
    for (int axis = 0; axis < 3; ++axis) closing.shapes(0, axis) = mesh.vertices(2, axis) - mesh.vertices(0, axis);
    closing.weights = RowMajorMatrixF::Ones(2, 1);
    const auto made = glbWithShapes(given, "head.glb", closing, Eigen::Matrix3d::Identity());
    ASSERT_TRUE(made);
    const VertexPositions shown = shownInSpeech(GlbFile(*made));
    EXPECT_LT((shown.row(0) - shown.row(2)).norm(), kGivenWithin) << owner;
    EXPECT_EQ(parseFaceMesh(*made, "head.glb").vertices, mesh.vertices) << "it rests as it was given";
    // What moves its own shape goes on from where that rests, as the mesh did that was looked at.
    const OwnShapeWeights own{RowMajorMatrixF::Constant(2, 1, 0.3F), [](std::string_view) { return 0; }};
    const auto animated = glbWithWeights(given, "head.glb", 50, own);
    ASSERT_TRUE(animated);
    EXPECT_NEAR(shownInSpeech(GlbFile(*animated))(0, 1), -0.45F, kGivenWithin) << owner;
  }
}

TEST(GivenGlb, DamagedFieldsAreRefused) {
  const PrincipalShapes shapes = shapesFor(parseFaceMesh(givenGlb(), "head.glb"));
  for (const char* pointer : {"/scene", "/scenes/0/nodes/0", "/nodes/0/mesh"}) {
    GlbFile chunks(givenGlb());
    chunks.root[nlohmann::json::json_pointer(pointer)] = 77;
    EXPECT_THROW((void)glbWithShapes(chunks.toBytes(), "head.glb", shapes, Eigen::Matrix3d::Identity()), InputError)
        << pointer;
  }
}

}  // namespace
}  // namespace mouthpiece
