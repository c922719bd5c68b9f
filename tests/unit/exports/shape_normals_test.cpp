#include "exports/shapes/principal_shapes.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "deform/mesh/face_mesh.h"
#include "talking_head.h"

namespace mouthpiece {
namespace {

/// The textbook way, one mesh at a time.
VertexPositions plainNormals(const VertexPositions& vertices, const std::vector<Triangle>& triangles) {
  VertexPositions normals = VertexPositions::Zero(vertices.rows(), 3);
  for (const auto& [a, b, c] : triangles) {
    const Eigen::RowVector3f u = vertices.row(b) - vertices.row(a);
    const Eigen::RowVector3f v = vertices.row(c) - vertices.row(a);
    for (const std::uint32_t corner : {a, b, c}) normals.row(corner) += u.cross(v);
  }
  return normals.rowwise().normalized();
}

TEST(ShapeNormals, AreTheDerivativesOfThePlainWay) {
  constexpr float kStep = 0.02F;
  const auto head = samples::makeTalkingHead({.rings = 16, .segments = 20, .ripple_mm = 1});
  const auto shapes = principalShapes(head.animation, head.mesh.vertices, 0.001);
  ASSERT_GT(shapes.shapeCount(), 8) << "more than one group of lanes";
  const ShapeNormals normals = shapeNormals(head.mesh.triangles, shapes);
  const VertexPositions rest = plainNormals(head.mesh.vertices, head.mesh.triangles);
  EXPECT_TRUE(normals.rest.isApprox(Eigen::Map<const Eigen::RowVectorXf>(rest.data(), rest.size()), 1e-4F));
  for (Eigen::Index k = 0; k < shapes.shapeCount(); ++k) {
    const Eigen::Map<const VertexPositions> shape(shapes.shapes.row(k).data(), head.mesh.vertices.rows(), 3);
    const VertexPositions turned = (plainNormals(head.mesh.vertices + kStep * shape, head.mesh.triangles) -
                                    plainNormals(head.mesh.vertices - kStep * shape, head.mesh.triangles)) /
                                   (2 * kStep);
    VertexPositions deltas = VertexPositions::Zero(head.mesh.vertices.rows(), 3);
    const ShapeNormals::Turns& turns = normals.shapes[static_cast<std::size_t>(k)];
    for (std::size_t i = 0; i < turns.vertices.size(); ++i)
      deltas.row(turns.vertices[i]) = Eigen::Map<const Eigen::RowVector3f>(&turns.values[3 * i]);
    // Turns of less than half a degree are left out; a needle of a triangle at the poles may round further.
    EXPECT_LT((deltas - turned).rowwise().norm().maxCoeff(), 0.01F) << "shape " << k;
  }
}

/// Two shapes that fold a triangle over, each by itself, and together leave it as it is: so does an animation's offset
/// with the other shapes.
TEST(ShapeNormals, WhatShapesTakeBackOfEachOtherTurnsNothing) {
  PrincipalShapes shapes;
  shapes.rest.resize(9);
  shapes.rest << 0, 0, 0, 1, 0, 0, 0, 1, 0;
  shapes.shapes = RowMajorMatrixF::Zero(2, 9);
  shapes.shapes.row(0).segment<3>(6) << 0, -3, 1;
  shapes.shapes.row(1) = -shapes.shapes.row(0);
  const ShapeNormals normals = shapeNormals({{0, 1, 2}}, shapes);
  ASSERT_EQ(normals.shapes[0].vertices, normals.shapes[1].vertices);
  const Eigen::Map<const Eigen::VectorXf> there(normals.shapes[0].values.data(), 9),
      back(normals.shapes[1].values.data(), 9);
  EXPECT_GT(there.norm(), 0.5F);
  EXPECT_LT((there + back).norm(), 1e-6F);
}

TEST(ShapeNormals, AVertexWithoutAreaPointsForward) {
  PrincipalShapes shapes;
  shapes.rest = Eigen::RowVectorXf::Zero(12);
  shapes.shapes = RowMajorMatrixF::Zero(0, 12);
  const ShapeNormals normals = shapeNormals({{0, 1, 2}}, shapes);
  for (Eigen::Index v = 0; v < 4; ++v) EXPECT_EQ(normals.rest.segment<3>(3 * v), Eigen::RowVector3f(0, 0, 1));
}

}  // namespace
}  // namespace mouthpiece
