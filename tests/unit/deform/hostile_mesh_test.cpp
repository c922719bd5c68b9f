// Meshes of every format, damaged at random: a sound mesh or an InputError, never anything else; and what is written in
// one format is read alike in all.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstring>
#include <random>
#include <string>

#include "deform/mesh/face_mesh.h"
#include "support/error_of.h"

namespace mouthpiece {
namespace {

/// A wavy sheet, coloured, in two parts.
FaceMesh randomMesh(std::mt19937& random) {
  const auto rows = static_cast<std::uint32_t>(3 + random() % 5),
             columns = static_cast<std::uint32_t>(3 + random() % 5);
  std::uniform_real_distribution<float> place(-1000, 1000), share(0, 1);
  FaceMesh mesh;
  mesh.vertices.resize(rows * columns, 3);
  for (Eigen::Index i = 0; i < mesh.vertices.size(); ++i) mesh.vertices.data()[i] = place(random);
  for (std::uint32_t i = 0; i < rows * columns; ++i)
    mesh.vertex_colors.push_back({share(random), share(random), share(random)});
  for (std::uint32_t r = 0; r + 1 < rows; ++r) {
    for (std::uint32_t c = 0; c + 1 < columns; ++c) {
      const std::uint32_t a = r * columns + c, d = a + columns;
      mesh.triangles.push_back({a, a + 1, d});
      mesh.triangles.push_back({a + 1, d + 1, d});
    }
  }
  const std::size_t half = mesh.triangles.size() / 2;
  mesh.parts = {{.name = "skin", .triangle_count = half},
                {.name = "other", .first_triangle = half, .triangle_count = mesh.triangles.size() - half}};
  return mesh;
}

std::string plyHeader(const FaceMesh& mesh, std::string_view encoding) {
  return fmt::format(
      "ply\nformat {} 1.0\ncomment made for a test\nelement vertex {}\nproperty float x\nproperty float y\n"
      "property float z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
      encoding, mesh.vertices.rows(), mesh.triangles.size());
}

std::string textBody(const FaceMesh& mesh) {
  std::string text;
  for (Eigen::Index i = 0; i < mesh.vertices.rows(); ++i)
    text += fmt::format("{} {} {}\n", mesh.vertices(i, 0), mesh.vertices(i, 1), mesh.vertices(i, 2));
  for (const auto& [a, b, c] : mesh.triangles) text += fmt::format("3 {} {} {}\n", a, b, c);
  return text;
}

template <typename Number>
void append(std::string& bytes, Number value, bool is_big) {
  std::array<char, sizeof value> raw{};
  std::memcpy(raw.data(), &value, sizeof value);
  if (is_big) std::reverse(raw.begin(), raw.end());
  bytes.append(raw.data(), raw.size());
}

std::string binaryPly(const FaceMesh& mesh, bool is_big) {
  std::string bytes = plyHeader(mesh, is_big ? "binary_big_endian" : "binary_little_endian");
  for (Eigen::Index i = 0; i < mesh.vertices.size(); ++i) append(bytes, mesh.vertices.data()[i], is_big);
  for (const Triangle& triangle : mesh.triangles) {
    bytes.push_back(3);
    for (const std::uint32_t v : triangle) append(bytes, v, is_big);
  }
  return bytes;
}

std::string off(const FaceMesh& mesh) {
  return fmt::format("OFF\n# a comment\n{} {} 0\n", mesh.vertices.rows(), mesh.triangles.size()) + textBody(mesh);
}

class RandomMeshes : public ::testing::TestWithParam<unsigned> {};
INSTANTIATE_TEST_SUITE_P(Seeds, RandomMeshes, ::testing::Range(1U, 9U));

TEST_P(RandomMeshes, AreReadAlikeFromEveryFormat) {
  std::mt19937 random(GetParam());
  const FaceMesh mesh = randomMesh(random);
  const std::string text = plyHeader(mesh, "ascii") + textBody(mesh);
  for (const auto& [name, bytes] : {std::pair<const char*, std::string>{"a.ply", text},
                                    {"b.ply", binaryPly(mesh, false)},
                                    {"c.ply", binaryPly(mesh, true)},
                                    {"d.off", off(mesh)},
                                    {"e.obj", objBytes(mesh)}}) {
    SCOPED_TRACE(name);
    const FaceMesh read = parseFaceMesh(bytes, name);
    EXPECT_EQ(read.vertices, mesh.vertices);
    EXPECT_EQ(read.triangles, mesh.triangles);
  }
  const FaceMesh again = parseFaceMesh(objBytes(mesh), "a.obj");
  ASSERT_EQ(again.vertex_colors.size(), mesh.vertex_colors.size());
  for (std::size_t v = 0; v < mesh.vertex_colors.size(); ++v) {
    for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(again.vertex_colors[v][k], mesh.vertex_colors[v][k], 2e-5);
  }
  EXPECT_EQ(objBytes(again), objBytes(mesh)) << "written, read and written again";
}

/// Whatever is read can be used.
void expectSound(const FaceMesh& mesh) {
  ASSERT_TRUE(mesh.vertices.allFinite());
  ASSERT_FALSE(mesh.triangles.empty());
  for (const Triangle& triangle : mesh.triangles) {
    for (const std::uint32_t v : triangle) ASSERT_LT(v, mesh.vertexCount());
  }
  std::size_t next = 0;
  for (const MeshPart& part : mesh.parts) {
    ASSERT_EQ(part.first_triangle, next);
    next += part.triangle_count;
  }
  ASSERT_EQ(next, mesh.triangles.size());
  ASSERT_TRUE(mesh.vertex_colors.empty() || mesh.vertex_colors.size() == mesh.vertexCount());
}

TEST_P(RandomMeshes, DamagedOnesAreSoundOrRefused) {
  std::mt19937 random(GetParam());
  const FaceMesh mesh = randomMesh(random);
  const std::string text = plyHeader(mesh, "ascii") + textBody(mesh);
  constexpr std::string_view kTelling = "0123456789-+.eEnaif/ \n\t#vfplyOFF";
  std::size_t refused = 0;
  for (const auto& [name, bytes] : {std::pair<const char*, std::string>{"a.ply", text},
                                    {"b.ply", binaryPly(mesh, false)},
                                    {"d.off", off(mesh)},
                                    {"e.obj", objBytes(mesh)}}) {
    for (int i = 0; i < 150; ++i) {
      std::string damaged = bytes;
      const std::size_t places = 1 + random() % 6;
      for (std::size_t k = 0; k < places; ++k) {
        const std::size_t at = random() % damaged.size();
        switch (random() % 4) {
          case 0:
            damaged[at] = static_cast<char>(random());
            break;
          case 1:
            damaged[at] = kTelling[random() % kTelling.size()];
            break;
          case 2:
            damaged.erase(at, 1 + random() % 9);
            break;
          default:
            damaged.insert(at, bytes, random() % bytes.size(), 1 + random() % 40);
        }
        if (damaged.empty()) break;
      }
      SCOPED_TRACE(fmt::format("{}, damage {}", name, i));
      try {
        expectSound(parseFaceMesh(damaged, name));
      } catch (const InputError& error) {
        ++refused;
        EXPECT_EQ(std::string(error.what()).rfind(name, 0), 0U) << error.what();
      }
    }
  }
  EXPECT_GT(refused, 150U);
}

TEST(PlyReader, TakesColoursAsBytesAndAsShares) {
  const auto ply = [](std::string_view type, std::string_view color) {
    return fmt::format(
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty double x\nproperty double y\nproperty double z\n"
        "property {0} red\nproperty {0} green\nproperty {0} blue\nproperty {0} alpha\nelement face 1\n"
        "property list uchar uint vertex_index\nproperty float quality\nend_header\n"
        "0 0 0 {1}\n1 0 0 {1}\n0 1 0 {1}\n3 0 1 2 0.5\n",
        type, color);
  };
  const FaceMesh bytes = parseFaceMesh(ply("uchar", "255 0 128 9"), "a.ply");
  ASSERT_EQ(bytes.vertex_colors.size(), 3U);
  EXPECT_FLOAT_EQ(bytes.vertex_colors[2][0], 1);
  EXPECT_FLOAT_EQ(bytes.vertex_colors[2][1], 0);
  EXPECT_NEAR(bytes.vertex_colors[2][2], 0.2159, 1e-4) << "sRGB";
  const FaceMesh shares = parseFaceMesh(ply("float", "1 0 0.50196078431372549 1"), "b.ply");
  EXPECT_EQ(shares.vertex_colors, bytes.vertex_colors);
}

/// A file, and what is said of it.
struct BadMesh {
  const char* name;
  std::string bytes, said;
};

class BadMeshes : public ::testing::TestWithParam<BadMesh> {};
TEST_P(BadMeshes, AreRefusedWithFilePlaceFoundAndExpected) {
  const BadMesh& mesh = GetParam();
  EXPECT_EQ(errorOf([&] { parseFaceMesh(mesh.bytes, mesh.name); }), mesh.said);
}

std::string plyOf(std::string_view header, std::string_view body = "") {
  return fmt::format("ply\nformat ascii 1.0\n{}end_header\n{}", header, body);
}
/// Three vertices and a face, the properties of which come behind its count.
std::string plyOfFace(std::string_view properties, std::string_view body) {
  return plyOf(fmt::format("element vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n{}",
                           properties),
               body);
}
constexpr const char* kCorners = "property list uchar int vertex_indices\n";
constexpr const char* kPlaces = "0 0 0\n1 0 0\n0 1 0\n";
constexpr const char* kNoPly = "a.ply:1: found no 'ply'; expected a PLY file";
constexpr const char* kNoEnd = ": found no end_header; expected a PLY file";
constexpr const char* kFormats = ": expected 'format ascii 1.0' or 'format binary_little_endian 1.0', once";
constexpr const char* kNoList = ": found no usable list; expected 'property list uchar int vertex_indices', once";

INSTANTIATE_TEST_SUITE_P(
    PlyHeaders, BadMeshes,
    ::testing::Values(
        BadMesh{"a.ply", "", kNoPly}, BadMesh{"a.ply", "plywood\n", kNoPly},
        BadMesh{"a.ply", "ply\nelement vertex 3\n", "a.ply:2: found no format first"},
        BadMesh{"a.ply", "ply\nformat ascii 1.0\n", std::string("a.ply:3") + kNoEnd},
        BadMesh{"a.ply", "ply\ncomment " + std::string(1000, 'x') + "\n", std::string("a.ply:2") + kNoEnd},
        BadMesh{"a.ply", "ply\nformat ascii 2.0\n", std::string("a.ply:2") + kFormats},
        BadMesh{"a.ply", "ply\nformat utf8 1.0\n", std::string("a.ply:2") + kFormats},
        BadMesh{"a.ply", plyOf("format ascii 1.0\n"), std::string("a.ply:3") + kFormats},
        BadMesh{"a.ply", plyOf("elephant\n"),
                "a.ply:3: found 'elephant'; expected format, comment, element, property or end_header"},
        BadMesh{"a.ply", plyOf("element vertex many\n"), "a.ply:3: found an element without a count"},
        BadMesh{"a.ply", plyOf("element vertex -1\n"), "a.ply:3: found an element without a count"},
        BadMesh{"a.ply", plyOf("element face 1\n"), "a.ply:3: found the element 'face'; expected vertices, then faces"},
        BadMesh{"a.ply", plyOf("element edge 1\n"), "a.ply:3: found the element 'edge'; expected vertices, then faces"},
        BadMesh{"a.ply", plyOf("element vertex 1\nelement vertex 1\n"),
                "a.ply:4: found the element 'vertex'; expected vertices, then faces"},
        BadMesh{"a.ply", plyOf("property float x\n"), "a.ply:3: found a property of nothing"},
        BadMesh{"a.ply", plyOf("element vertex 1\nproperty quad x\n"), "a.ply:4: found a property of type 'quad'"},
        BadMesh{"a.ply", plyOf("element vertex 1\nproperty float\n"), "a.ply:4: found a property of type 'float'"},
        BadMesh{"a.ply", plyOf("element vertex 1\nproperty list float int x\n"), std::string("a.ply:4") + kNoList},
        BadMesh{"a.ply", plyOfFace("property list uchar float vertex_indices\n", ""), std::string("a.ply:8") + kNoList},
        BadMesh{"a.ply", plyOfFace(std::string(kCorners) + kCorners, ""), std::string("a.ply:9") + kNoList},
        BadMesh{"a.ply", plyOfFace("", ""), "a.ply:8: found no list of corners at the faces"},
        BadMesh{"a.ply",
                plyOf("element vertex 3\nproperty float x\nproperty float z\nelement face 1\n" + std::string(kCorners)),
                "a.ply:8: found vertices without x, y and z"}));

INSTANTIATE_TEST_SUITE_P(
    PlyBodies, BadMeshes,
    ::testing::Values(BadMesh{"a.ply", plyOfFace(kCorners, ""),
                              "a.ply: found 3 vertices and 1 faces in 0 bytes; expected counts that the file can hold"},
                      BadMesh{"a.ply", plyOfFace(kCorners, std::string(kPlaces) + "3 0 1"),
                              "a.ply: ends or breaks off at face 0"},
                      BadMesh{"a.ply", plyOfFace(kCorners, "0 0 0\n1 zero 0\n0 1 0\n3 0 1 2\n"),
                              "a.ply: vertex 1: found 'zero'; expected a number"},
                      BadMesh{"a.ply", plyOfFace(kCorners, "0 0 0\n1 0 0\n0 1e8 0\n3 0 1 2\n"),
                              "a.ply: vertex 2: found a coordinate that is no number between -1e7 and 1e7"},
                      BadMesh{"a.ply", plyOfFace(kCorners, std::string(kPlaces) + "2 0 1\n"),
                              "a.ply: face 0: found 2 corners; expected 3 to 4096"},
                      BadMesh{"a.ply", plyOfFace(kCorners, std::string(kPlaces) + "4097 0 1\n"),
                              "a.ply: face 0: found 4097 corners; expected 3 to 4096"},
                      BadMesh{"a.ply", plyOfFace(kCorners, std::string(kPlaces) + "3 0 1 3\n"),
                              "a.ply: face 0: found vertex index 3; expected 0 to 2"},
                      BadMesh{"a.ply", plyOfFace(kCorners, std::string(kPlaces) + "3 0 1 -1\n"),
                              "a.ply: face 0: found vertex index -1; expected 0 to 2"}));

INSTANTIATE_TEST_SUITE_P(
    Others, BadMeshes,
    ::testing::Values(
        BadMesh{"a.off", "COFF\n3 1 0\n", "a.off:1: found no 'OFF'; expected a plain OFF file as text"},
        BadMesh{"a.off", "OFFICE\n", "a.off:1: found no 'OFF'; expected a plain OFF file as text"},
        BadMesh{"a.off", std::string("OFF\n3 1 0\n\0", 11), "a.off: found a zero byte; expected OFF as text"},
        BadMesh{"a.off", "OFF\n3\n", "a.off: ends or breaks off at the count of faces, 1"},
        BadMesh{"a.off", "OFF\n3 0 0\n0 0 0\n1 0 0\n0 1 0\n",
                "a.off: found no faces; expected a surface of triangles or polygons"},
        BadMesh{"a.off", "OFF\n3.5 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n",
                "a.off: found 3.5 vertices and 1 faces in 27 bytes; expected counts that the file can hold"},
        BadMesh{"a.off", "OFF\n1e12 1 0\n0 0 0\n",
                "a.off: found 1000000000000 vertices and 1 faces in 7 bytes; expected counts that the file can hold"},
        BadMesh{
            "head.fbx", "Kaydara",
            "head.fbx: found .fbx; expected .glb, .vrm, .obj, .ply or .off: docs/guides/convert_a_head.md says how to "
            "make a GLB of it"},
        BadMesh{"head.stl", "solid", "head.stl: found the ending '.stl'; expected .obj, .ply, .off, .glb or .vrm"}));

TEST(MeshFiles, OnlyAGlbHasObjectsToChooseFrom) {
  EXPECT_EQ(errorOf([] { parseFaceMesh("v 0 0 0\n", "a.obj", "Head"); }),
            "a.obj: holds no scene to choose an object of; expected a GLB");
}

TEST(OffReader, PassesOverColoursBehindTheCorners) {
  const FaceMesh mesh = parseFaceMesh("OFF 4 2 0\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n3 0 1 2 255 0 0\n3 3 2 1\n", "a.off");
  EXPECT_EQ(mesh.triangles.size(), 2U);
}

}  // namespace
}  // namespace mouthpiece
