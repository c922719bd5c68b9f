// What a part of a head is, told by its name and its shape.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <numbers>

#include "deform/mesh/face_mesh.h"
#include "deform/mesh/mesh_reader.h"

namespace mouthpiece {
namespace {

TEST(PartKinds, AreToldByNames) {
  EXPECT_EQ(kindFromName("M_Face"), PartKind::kSkin);
  EXPECT_EQ(kindFromName("EyeLashes"), PartKind::kSkin);
  EXPECT_EQ(kindFromName("M_ScleraLeft"), PartKind::kEye);
  EXPECT_EQ(kindFromName("Tongue_01"), PartKind::kTongue);
  EXPECT_EQ(kindFromName("Mouth_inside"), PartKind::kMouthInside);
  EXPECT_EQ(kindFromName("MouthSock"), PartKind::kMouthInside);
  EXPECT_EQ(kindFromName("M_Socket"), PartKind::kMouthInside);
  EXPECT_EQ(kindFromName("Socks"), PartKind::kOther) << "a figure's feet went with its jaw";
  for (const char* worn : {"Glasses", "Eyeglasses", "EyeWear_01"})
    EXPECT_EQ(kindFromName(worn), PartKind::kOther) << worn;
  EXPECT_EQ(kindFromName("long_hair"), PartKind::kHair);
  EXPECT_EQ(kindFromName("lambert1"), std::nullopt);
}

TEST(PartKinds, MoustachesAreRootedInTheSkin) {
  for (const char* name : {"Moustache", "FacialHair_Mustache", "Whiskers.001", "Schnurrbart", "Beard"}) {
    const FaceMesh mesh =
        parseObj(std::string("usemtl ") + name + "\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "hair.obj");
    EXPECT_EQ(mesh.parts.at(0).kind, PartKind::kSkin) << name;
    EXPECT_TRUE(mesh.parts[0].stands_off) << name;
  }
}

/// A tiny tetrahedron with its lowest corner at height y.
std::string tooth(int index, double x, double y) {
  const int first = 4 * index + 1;
  std::string text;
  for (const auto& [dx, dy, dz] : {std::array{0.0, 0.0, 0.0}, {1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}}) {
    text += "v " + std::to_string(x + dx) + " " + std::to_string(y + dy) + " " + std::to_string(dz) + "\n";
  }
  const auto f = [&](int a, int b, int c) {
    text += "f " + std::to_string(first + a) + " " + std::to_string(first + b) + " " + std::to_string(first + c) + "\n";
  };
  f(0, 2, 1), f(0, 1, 3), f(0, 3, 2), f(1, 2, 3);
  return text;
}

TEST(PartKinds, TeethAreSplitIntoTwoRowsByHeight) {
  std::string teeth;
  for (int i = 0; i < 8; ++i) teeth += tooth(i, 2.0 * (i / 2), i % 2 == 0 ? 5.0 + 0.3 * i : -5.0 - 0.3 * i);
  // Neither the level of detail nor both rows' names say which of them it is.
  for (const std::string name : {"teeth_lod0_mesh", "upper_and_lower_teeth"})
    EXPECT_EQ(parseObj("usemtl " + name + "\n" + teeth, "teeth.obj").parts.size(), 2U) << name;
  const FaceMesh mesh = parseObj("usemtl Teeth\n" + teeth, "teeth.obj");
  ASSERT_EQ(mesh.parts.size(), 2U);
  for (const MeshPart& part : mesh.parts) {
    EXPECT_EQ(part.triangle_count, 16U);
    for (std::size_t t = part.first_triangle; t < part.first_triangle + part.triangle_count; ++t) {
      const bool is_high = mesh.vertices(mesh.triangles[t][0], 1) > 0;
      EXPECT_EQ(is_high, part.kind == PartKind::kUpperTeeth);
    }
  }
}

TEST(PartKinds, NamesOfRowsGoBeforeShape) {
  const FaceMesh mesh = parseObj("usemtl LowerTeeth\n" + tooth(0, 0, 3) + tooth(1, 4, -3), "teeth.obj");
  ASSERT_EQ(mesh.parts.size(), 1U);
  EXPECT_EQ(mesh.parts[0].kind, PartKind::kLowerTeeth);
}

TEST(PartKinds, PartsCoverAllTrianglesInOrder) {
  const FaceMesh mesh =
      parseObj("usemtl a\n" + tooth(0, 0, 0) + "usemtl b\n" + tooth(1, 3, 0) + "usemtl a\n" + tooth(2, 6, 0), "x.obj");
  ASSERT_EQ(mesh.parts.size(), 2U);
  std::size_t next = 0;
  for (const MeshPart& part : mesh.parts) {
    EXPECT_EQ(part.first_triangle, next);
    next += part.triangle_count;
  }
  EXPECT_EQ(next, mesh.triangles.size());
  EXPECT_EQ(mesh.parts[0].triangle_count, 8U);
}

/// Heads of balls, in one part without a name; faces look outward.
struct Balls {
  static constexpr std::size_t kTriangles = 2 * 12 * 8;  ///< of each
  MeshSoup soup;

  void add(const Eigen::Vector3d& middle, const Eigen::Vector3d& radii) {
    constexpr std::uint32_t kAround = 12, kRows = 9;
    const auto first = static_cast<std::uint32_t>(soup.vertexCount());
    for (std::uint32_t row = 0; row < kRows; ++row) {
      for (std::uint32_t at = 0; at < kAround; ++at) {
        const double down = std::numbers::pi * row / (kRows - 1), turn = 2 * std::numbers::pi * at / kAround;
        const Eigen::Vector3d out(std::sin(down) * std::sin(turn), std::cos(down), std::sin(down) * std::cos(turn));
        const Eigen::Vector3f place = (middle + radii.cwiseProduct(out)).cast<float>();
        soup.positions.insert(soup.positions.end(), {place.x(), place.y(), place.z()});
      }
    }
    for (std::uint32_t row = 0; row + 1 < kRows; ++row) {
      for (std::uint32_t at = 0; at < kAround; ++at) {
        const std::uint32_t a = first + row * kAround + at, b = first + row * kAround + (at + 1) % kAround;
        soup.triangles.push_back({a, a + kAround, b});
        soup.triangles.push_back({b, a + kAround, b + kAround});
        soup.part_of_triangle.insert(soup.part_of_triangle.end(), 2, 0);
      }
    }
  }
  std::map<PartKind, std::size_t> kinds() {
    soup.parts.emplace_back();
    const FaceMesh mesh = finishMesh(soup, "balls");
    std::map<PartKind, std::size_t> triangles;
    for (const MeshPart& part : mesh.parts) triangles[part.kind] += part.triangle_count;
    return triangles;
  }
};

Balls headOfBalls() {
  Balls head;
  head.add({0, 0, 0}, {75, 110, 90});
  for (const double x : {-31.0, 31.0}) head.add({x, 25, 55}, {12, 12, 12});
  return head;
}

TEST(PartKinds, WhatLiesInAHeadWithoutNamesIsToldByItsShape) {
  Balls head = headOfBalls();
  for (const double x : {-31.0, 31.0}) head.add({x, 25, 62}, {6, 6, 6});  // an iris before the ball's middle
  head.add({0, -48, 30}, {19, 8, 28});
  for (int i = -4; i <= 4; ++i) {
    for (const double y : {-40.0, -56.0}) head.add({5.5 * i, y, 62 - 1.6 * i * i}, {2.6, 5, 2.6});
  }
  auto kinds = head.kinds();
  EXPECT_EQ(kinds[PartKind::kSkin], Balls::kTriangles);
  EXPECT_EQ(kinds[PartKind::kEye], 4 * Balls::kTriangles);
  EXPECT_EQ(kinds[PartKind::kTongue], Balls::kTriangles);
  EXPECT_EQ(kinds[PartKind::kUpperTeeth], 9 * Balls::kTriangles);
  EXPECT_EQ(kinds[PartKind::kLowerTeeth], 9 * Balls::kTriangles);
}

TEST(PartKinds, WhatLiesBeforeTheFaceIsNotOfItsMouth) {
  Balls head = headOfBalls();
  head.add({0, -45, 96}, {30, 12, 6});  // a moustache
  EXPECT_EQ(head.kinds()[PartKind::kSkin], 2 * Balls::kTriangles);
}

TEST(PartKinds, BeadsAreNoEyes) {
  Balls head;
  head.add({0, 0, 0}, {75, 110, 90});
  for (int i = 0; i < 12; ++i) head.add({60 * std::sin(i * 0.5), -110.0, 60 * std::cos(i * 0.5)}, {6, 6, 6});
  EXPECT_EQ(head.kinds()[PartKind::kSkin], 13 * Balls::kTriangles);
}

TEST(PartKinds, TheIctHeadIsTheSameWithoutItsNames) {
  const std::filesystem::path head = std::filesystem::path(MOUTHPIECE_SOURCE_DIR) / "../shared/faces/ict_head.obj";
  if (!std::filesystem::exists(head)) GTEST_SKIP() << "the ICT head is not beside the project (../shared/faces)";
  std::ifstream file(head);
  std::string nameless;
  for (std::string line; std::getline(file, line);) {
    if (!line.starts_with("usemtl") && !line.starts_with("g ") && !line.starts_with("o ")) nameless += line + "\n";
  }
  const auto kindsOf = [](const FaceMesh& mesh) {
    std::map<Triangle, PartKind> kinds;
    for (const MeshPart& part : mesh.parts) {
      for (const Triangle& triangle : trianglesOf(mesh, part)) kinds[triangle] = part.kind;
    }
    return kinds;
  };
  const auto named = kindsOf(readFaceMesh(head)), found = kindsOf(parseFaceMesh(nameless, "nameless.obj"));
  ASSERT_EQ(found.size(), named.size());
  std::map<PartKind, std::array<std::size_t, 2>> alike;  // of the named ones
  for (const auto& [triangle, kind] : named) ++alike[kind][found.at(triangle) == kind ? 1 : 0];
  for (const PartKind kind : {PartKind::kUpperTeeth, PartKind::kLowerTeeth, PartKind::kTongue})
    EXPECT_EQ(alike[kind][0], 0U) << nameOf(kind);
  EXPECT_GT(alike[PartKind::kEye][1], 5 * alike[PartKind::kEye][0]) << "but for fluids that are no balls";
  EXPECT_EQ(alike[PartKind::kSkin][0], 0U);
}

TEST(PartKinds, TheIctHeadComesApartAsItShould) {
  const std::filesystem::path head = std::filesystem::path(MOUTHPIECE_SOURCE_DIR) / "../shared/faces/ict_head.obj";
  if (!std::filesystem::exists(head)) GTEST_SKIP() << "the ICT head is not beside the project (../shared/faces)";
  const FaceMesh mesh = readFaceMesh(head);
  EXPECT_EQ(mesh.vertices.rows(), 26719);
  EXPECT_EQ(mesh.triangles.size(), 52220U);
  std::map<PartKind, std::size_t> triangles;
  for (const MeshPart& part : mesh.parts) triangles[part.kind] += part.triangle_count;
  for (const PartKind kind : {PartKind::kSkin, PartKind::kUpperTeeth, PartKind::kLowerTeeth, PartKind::kTongue,
                              PartKind::kMouthInside, PartKind::kEye}) {
    EXPECT_GT(triangles[kind], 500U) << static_cast<int>(kind);
  }
}

TEST(PartKinds, TheMakeHumanHeadIsRead) {
  const std::filesystem::path head =
      std::filesystem::path(MOUTHPIECE_SOURCE_DIR) / "../shared/faces/makehuman_male.obj";
  if (!std::filesystem::exists(head)) GTEST_SKIP() << "the MakeHuman head is not beside the project (../shared/faces)";
  const FaceMesh mesh = readFaceMesh(head);
  EXPECT_GT(mesh.vertices.rows(), 4000);
  EXPECT_GT(mesh.triangles.size(), 8000U);
}

TEST(PartKinds, TheIctGlbIsTheSameHeadInMetres) {
  const std::filesystem::path glb = std::filesystem::path(MOUTHPIECE_SOURCE_DIR) / "../shared/faces/ict_arkit.glb";
  if (!std::filesystem::exists(glb)) GTEST_SKIP() << "the ICT head is not beside the project (../shared/faces)";
  const FaceMesh mesh = readFaceMesh(glb);
  EXPECT_EQ(mesh.triangles.size(), 52220U);
  EXPECT_EQ(mesh.metres_per_unit, 1.0);
  const FaceMesh obj = readFaceMesh(glb.parent_path() / "ict_head.obj");
  EXPECT_LT((1000 * mesh.vertices.colwise().maxCoeff() - obj.vertices.colwise().maxCoeff()).norm(), 0.1F);
}

}  // namespace
}  // namespace mouthpiece
