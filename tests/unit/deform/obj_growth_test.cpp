// What a text of an OBJ keeps when its lips are cut and parts are added.
#include "deform/mesh/obj_growth.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "base/errors.h"
#include "deform/mesh/face_mesh.h"
#include "deform/mesh/mesh_reader.h"
#include "support/error_of.h"

namespace mouthpiece {
namespace {

/// Two rows of two quads, read upwards; vertices of the middle row are 3, 4, 5.
const std::string kVertices =
    "# from a modeller\r\nmtllib head.mtl\no face\nv 0 0 0 1 0 0\nv 1 0 0 1 0 0\nv 2 0 0 1 0 0\nv 0 1 0 0 1 0\nv 1 1 0 "
    "0 "
    "1 0\nv 2 1 0 0 1 0\nv 0 2 0 0 0 1\nv 1 2 0 0 0 1\nv 2 2 0 0 0 1\nvt 0 0\nvt 1 1\nvn 0 0 1\n";
const std::string kFaces =
    "usemtl skin of face\ns 1\nf 1/1/1 2/2/1 5/2/1 4/1/1\nf 2 3 6 5\nf 4//1 5//1 8//1 7//1\nf 5 6 9 8\n";

/// `given` with vertex 4 doubled for the triangles that are wholly below the middle row, both `apart` from where it
/// was, and a part on the new vertex.
GrownMesh cutInTheMiddle(const FaceMesh& given, float apart) {
  GrownMesh grown{given, {4, static_cast<std::uint32_t>(given.vertexCount())}};
  const auto old = static_cast<Eigen::Index>(given.vertexCount());
  grown.mesh.vertices.conservativeResize(old + 2, Eigen::NoChange);
  grown.mesh.vertices.row(old) << 1, 1 - apart, 0;
  grown.mesh.vertices.row(old + 1) << 1, 0.5F, -1;
  grown.mesh.vertices.row(4) << 1, 1 + apart, 0;
  for (Triangle& triangle : grown.mesh.triangles) {
    bool is_below = true;
    for (const std::uint32_t v : triangle) is_below = is_below && v <= 5;
    for (std::uint32_t& v : triangle) v = is_below && v == 4 ? static_cast<std::uint32_t>(old) : v;
  }
  grown.mesh.parts.push_back(
      {.name = "mouth_inside", .first_triangle = grown.mesh.triangles.size(), .triangle_count = 1});
  grown.mesh.triangles.push_back({4, static_cast<std::uint32_t>(old), static_cast<std::uint32_t>(old + 1)});
  return grown;
}

std::string cut(const std::string& text, float apart) {
  const FaceMesh given = parseObj(text, "head.obj");
  return grownObj(text, "head.obj", given, cutInTheMiddle(given, apart)).text;
}

TEST(GrownObj, KeepsWhatNothingChanges) {
  EXPECT_EQ(
      cut(kVertices + kFaces, 0.25F),
      "# from a modeller\r\nmtllib head.mtl\no face\nv 0 0 0 1 0 0\nv 1 0 0 1 0 0\nv 2 0 0 1 0 0\nv 0 1 0 0 1 0\nv 1 "
      "1.25 0 0 1 0\nv 2 1 0 0 1 0\nv 0 2 0 0 0 1\nv 1 2 0 0 0 1\nv 2 2 0 0 0 1\nv 1 0.75 0 0 1 0\nv 1 0.5 -1 0 1 "
      "0\nvt 0 0\nvt 1 1\nvn 0 0 1\nusemtl skin of face\ns 1\nf 1/1/1 2/2/1 10/2/1 4/1/1\nf 2 3 6 10\nf 4//1 5//1 "
      "8//1 7//1\nf 5 6 9 8\ng mouth_inside\nusemtl mouth_inside\nf 5/2 10/2 11/2\ng\nusemtl skin of face\n");
}

/// What is written is read as the mesh that was grown; a quadrilateral whose corner has moved might have the other two
/// triangles.
void expectGrown(const std::string& text) {
  const FaceMesh given = parseObj(text, "head.obj"), written = parseObj(cut(text, 0), "cut.obj");
  const GrownMesh grown = cutInTheMiddle(given, 0);
  EXPECT_EQ(written.vertices, grown.mesh.vertices);
  EXPECT_EQ(written.triangles.size(), grown.mesh.triangles.size());
  for (const Triangle& triangle : grown.mesh.triangles) {
    const bool is_there = std::any_of(written.triangles.begin(), written.triangles.end(), [&](Triangle own) {
      std::rotate(own.begin(), std::find(own.begin(), own.end(), triangle[0]), own.end());
      return own == triangle;
    });
    EXPECT_TRUE(is_there) << triangle[0] << " " << triangle[1] << " " << triangle[2];
  }
}

TEST(GrownObj, CountsBackFromTheLatestVertexAsBefore) {
  expectGrown(kVertices + "f -9 -8 -5 -6\nf 2 3 6 5\nf -6/-2 -5/-1 -2/-1 -3/-2\nf 5 6 9 8");
}

/// As Blender writes objects: each with its vertices, its faces, a material.
TEST(GrownObj, StaysInItsObjectAndCountsLaterOnesOn) {
  const std::string head = "o Head\nv 0 0 0\nv 1 0 0\nv 2 0 0\nv 0 1 0\nv 1 1 0\nv 2 1 0\nv 0 2 0\nv 1 2 0\nv 2 2 0\n";
  const std::string eye =
      "o Eye\nv 5 5 5\nv 6 5 5\nv 5 6 5\nusemtl eye\nf 10 11 12\nl 10 12\np 1 11\nf -3 -2 -1\nf -12 -11 -9\n";
  EXPECT_EQ(cut(head + "f 1 2 5 4\nf 2 3 6 5\nf 4 5 8 7\nf 5 6 9 \\\n8\n" + eye, 0),
            head +
                "v 1 1 0\nv 1 0.5 -1\nf 1 2 10 4\nf 2 3 6 10\nf 4 5 8 7\nf 5 6 9 \\\n8\ng mouth_inside\nf 5 10 11\ng\n"
                "o Eye\nv 5 5 5\nv 6 5 5\nv 5 6 5\nusemtl eye\nf 12 13 14\nl 12 14\np 1 13\nf 12 13 14\nf 1 2 4\n");
}

TEST(GrownObj, PartsAFaceWhoseTrianglesComeApart) {
  // One polygon over both rows: some of its triangles lie below.
  expectGrown(kVertices + "f 1 2 3 6 9 8 7 4\nf 4 5 8\nf 4 2 5\nf 1 5 9 3\n");
}

TEST(GrownObj, RefusesAnotherText) {
  const FaceMesh given = parseObj(kVertices + kFaces, "head.obj");
  EXPECT_EQ(errorOf([&] { grownObj("v 0 0 0\n", "other.obj", given, cutInTheMiddle(given, 0)); }),
            "other.obj: has 1 vertices; expected 9");
}

}  // namespace
}  // namespace mouthpiece
