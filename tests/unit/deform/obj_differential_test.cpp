// OBJ as two readers of others understand it: tinyobjloader and OpenMesh.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <tiny_obj_loader.h>

#include <OpenMesh/Core/IO/MeshIO.hh>
#include <OpenMesh/Core/Mesh/PolyMesh_ArrayKernelT.hh>
#include <algorithm>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "deform/mesh/face_mesh.h"

namespace mouthpiece {
namespace {

constexpr float kSameNumber = 2e-6F;  ///< relative: both read decimals in their own ways

/// A bumpy sheet whose cells are triangles, quads and hexagons, written in the many ways that OBJ allows.
class RandomObj {
 public:
  explicit RandomObj(unsigned seed) : random_(seed) {
    const std::size_t columns = 2 + below(9), rows = 2 + below(9);
    has_texture_ = below(2) == 0;
    has_normals_ = below(2) == 0;
    counts_back_ = below(2) == 0;
    line_end_ = below(3) == 0 ? "\r\n" : "\n";
    say("# a sheet");
    if (below(2) == 0) say("mtllib none.mtl");
    if (has_normals_) say("vn 0 0 1");
    for (std::size_t row = 0; row <= rows; ++row) {
      for (std::size_t column = 0; column <= columns; ++column) addVertex(column, row);
      if (row == 0) continue;
      if (below(4) == 0) say(fmt::format("{} part {}", below(2) == 0 ? "g" : "usemtl", below(3)));
      if (below(4) == 0) say("s 1");
      for (std::size_t column = 0; column < columns;) {
        const std::size_t low = (row - 1) * (columns + 1) + column, high = low + columns + 1;
        switch (below(3)) {
          case 0:
            addFace({low, low + 1, high + 1});
            addFace({low, high + 1, high});
            break;
          case 1:
            if (column + 1 < columns) {
              addFace({low, low + 1, low + 2, high + 2, high + 1, high});
              ++column;
              break;
            }
            [[fallthrough]];
          default:
            addFace({low, low + 1, high + 1, high});
        }
        ++column;
      }
    }
  }

  std::string text;
  std::vector<std::vector<std::size_t>> faces;

 private:
  std::size_t below(std::size_t count) { return std::uniform_int_distribution<std::size_t>(0, count - 1)(random_); }
  void say(const std::string& line) { text += line + line_end_; }
  std::string blank() { return below(5) == 0 ? "  \t" : " "; }

  std::string number(double value) {
    switch (below(3)) {
      case 0:
        return fmt::format("{:.6f}", value);
      case 1:
        return fmt::format("{:.7e}", value);
      default:
        return fmt::format("{:.7g}", value);
    }
  }

  void addVertex(std::size_t column, std::size_t row) {
    std::uniform_real_distribution<double> jitter(-0.3, 0.3);
    const std::string x = number(asReal(column) + jitter(random_)), y = number(asReal(row) + jitter(random_));
    say("v" + blank() + x + blank() + y + blank() + number(jitter(random_)));
    if (has_texture_) say("vt" + blank() + number(asReal(column) / 10) + blank() + number(asReal(row) / 10));
    ++vertices_;
  }

  void addFace(std::vector<std::size_t> corners) {
    std::string line = "f";
    for (const std::size_t corner : corners) {
      const std::string place = counts_back_ ? fmt::format("-{}", vertices_ - corner) : fmt::format("{}", corner + 1);
      line += blank() + place;
      if (has_texture_) line += "/" + place;
      if (has_normals_) line += has_texture_ ? "/1" : "//1";
    }
    say(line);
    faces.push_back(std::move(corners));
  }

  std::mt19937 random_;
  std::size_t vertices_ = 0;
  bool has_texture_ = false, has_normals_ = false, counts_back_ = false;
  std::string line_end_;
};

using Points = std::vector<Eigen::Vector3f>;

/// Twice the area of a polygon as a vector, which no cutting into triangles changes.
Eigen::Vector3f areaOf(const Points& points, const std::vector<std::size_t>& corners) {
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  for (std::size_t k = 2; k < corners.size(); ++k)
    sum += (points[corners[k - 1]] - points[corners[0]]).cross(points[corners[k]] - points[corners[0]]);
  return sum;
}

/// `mesh` has the other reader's vertices, and of each of its faces as many triangles as it has corners less two, which
/// together cover it.
void expectSame(const FaceMesh& mesh, const Points& points, const std::vector<std::vector<std::size_t>>& faces) {
  ASSERT_EQ(mesh.vertexCount(), points.size());
  for (std::size_t v = 0; v < points.size(); ++v) {
    const Eigen::Vector3f ours = mesh.vertices.row(signedIndex(v)).transpose();
    ASSERT_LE((ours - points[v]).norm(), kSameNumber * std::max(1.0F, points[v].norm())) << "vertex " << v;
  }
  std::size_t triangles = 0;
  Eigen::Vector3f theirs = Eigen::Vector3f::Zero(), ours = Eigen::Vector3f::Zero();
  for (const std::vector<std::size_t>& face : faces) {
    triangles += face.size() - 2;
    theirs += areaOf(points, face);
  }
  ASSERT_EQ(mesh.triangles.size(), triangles);
  for (const Triangle& t : mesh.triangles) {
    const auto holds = [&](const std::vector<std::size_t>& face) {
      return std::all_of(t.begin(), t.end(),
                         [&](std::size_t corner) { return std::find(face.begin(), face.end(), corner) != face.end(); });
    };
    ASSERT_TRUE(std::any_of(faces.begin(), faces.end(), holds)) << t[0] << ' ' << t[1] << ' ' << t[2];
    ours += areaOf(points, {t[0], t[1], t[2]});
  }
  EXPECT_LE((ours - theirs).norm(), 1e-4F * theirs.norm());
}

class ObjOfOthers : public ::testing::TestWithParam<unsigned> {};
INSTANTIATE_TEST_SUITE_P(Seeds, ObjOfOthers, ::testing::Range(1U, 41U));

TEST_P(ObjOfOthers, IsReadAsTinyobjloaderReadsIt) {
  const RandomObj obj(GetParam());
  SCOPED_TRACE(obj.text);
  tinyobj::ObjReaderConfig config;
  config.triangulate = false;
  tinyobj::ObjReader reader;
  ASSERT_TRUE(reader.ParseFromString(obj.text, "", config)) << reader.Error();
  Points points;
  const auto& numbers = reader.GetAttrib().vertices;
  for (std::size_t v = 0; v + 2 < numbers.size(); v += 3)
    points.emplace_back(static_cast<float>(numbers[v]), static_cast<float>(numbers[v + 1]),
                        static_cast<float>(numbers[v + 2]));
  std::vector<std::vector<std::size_t>> faces;
  for (const tinyobj::shape_t& shape : reader.GetShapes()) {
    std::size_t at = 0;
    for (const std::size_t corners : shape.mesh.num_face_vertices) {
      faces.emplace_back();
      for (std::size_t k = 0; k < corners; ++k)
        faces.back().push_back(unsignedIndex(shape.mesh.indices[at++].vertex_index));
    }
  }
  ASSERT_EQ(faces.size(), obj.faces.size());
  expectSame(parseFaceMesh(obj.text, "sheet.obj"), points, faces);
}

TEST_P(ObjOfOthers, IsReadAsOpenMeshReadsIt) {
  const RandomObj obj(GetParam());
  SCOPED_TRACE(obj.text);
  OpenMesh::PolyMesh_ArrayKernelT<> read;
  std::istringstream stream(obj.text);
  OpenMesh::IO::Options options;
  ASSERT_TRUE(OpenMesh::IO::read_mesh(read, stream, ".obj", options));
  Points points;
  for (const auto v : read.vertices()) {
    const auto at = read.point(v);
    points.emplace_back(at[0], at[1], at[2]);
  }
  std::vector<std::vector<std::size_t>> faces;
  for (const auto f : read.faces()) {
    faces.emplace_back();
    for (const auto v : f.vertices()) faces.back().push_back(unsignedIndex(v.idx()));
  }
  ASSERT_EQ(faces.size(), obj.faces.size());
  expectSame(parseFaceMesh(obj.text, "sheet.obj"), points, faces);
}

}  // namespace
}  // namespace mouthpiece
