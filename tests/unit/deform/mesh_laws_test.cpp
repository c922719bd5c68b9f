// Laws of polygons, readers, normals and slits on random meshes.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "base/index.h"
#include "deform/mesh/bone_roles.h"
#include "deform/mesh/face_mesh.h"
#include "deform/mesh/mesh_reader.h"
#include "deform/topology/lip_slit.h"
#include "motion/arkit_shapes.h"

namespace mouthpiece {
namespace {

using Polygon = std::vector<std::uint32_t>;

class MeshLaws : public ::testing::TestWithParam<unsigned> {
 protected:
  std::mt19937 random_{GetParam()};
  double number(double least, double most) { return std::uniform_real_distribution<double>(least, most)(random_); }
  std::size_t count(std::size_t least, std::size_t most) {
    return std::uniform_int_distribution<std::size_t>(least, most)(random_);
  }
  Eigen::Matrix3d turn() {
    return Eigen::Quaterniond(number(-1, 1), number(-1, 1), number(-1, 1), number(-1, 1))
        .normalized()
        .toRotationMatrix();
  }

  /// Corners round the middle of a tilted plane, as far from it as it happens: many of them turn inwards.
  MeshSoup flower(std::size_t corners, double least_radius) {
    MeshSoup soup;
    soup.parts.resize(3);
    const Eigen::Matrix3d tilt = turn();
    const Eigen::Vector3d middle(number(-50, 50), number(-50, 50), number(-50, 50));
    for (std::size_t k = 0; k < corners; ++k) {
      const double angle = 2 * std::numbers::pi * (asReal(k) + number(0, 0.5)) / asReal(corners);
      const double radius = number(least_radius, 10);
      const Eigen::Vector3d p = middle + tilt * Eigen::Vector3d(radius * std::cos(angle), radius * std::sin(angle), 0);
      for (const double axis : p) soup.positions.push_back(static_cast<float>(axis));
    }
    return soup;
  }

  /// Polygons over random places; every vertex is used.
  struct RandomMesh {
    VertexPositions vertices;
    std::vector<Polygon> polygons;
  };
  RandomMesh randomMesh() {
    RandomMesh mesh;
    mesh.vertices = VertexPositions::NullaryExpr(signedIndex(count(8, 40)), 3, [&] {
      return static_cast<float>(number(-200, 200) * std::pow(10, number(-3, 3)));
    });
    std::vector<std::uint32_t> all(unsignedIndex(mesh.vertices.rows()));
    std::iota(all.begin(), all.end(), 0U);
    for (int round = 0; round < 3; ++round) {
      std::shuffle(all.begin(), all.end(), random_);
      for (std::size_t at = 0; at + 3 <= all.size();) {
        std::size_t corners = std::min(count(3, 7), all.size() - at);
        if (all.size() - at - corners < 3) corners = all.size() - at;
        mesh.polygons.emplace_back(all.begin() + signedIndex(at), all.begin() + signedIndex(at + corners));
        at += corners;
      }
    }
    return mesh;
  }
};
INSTANTIATE_TEST_SUITE_P(Seeds, MeshLaws, ::testing::Range(1U, 21U));

Eigen::Vector3d cornerOf(const MeshSoup& soup, std::uint32_t v) {
  return Eigen::Map<const Eigen::Vector3f>(&soup.positions[3 * std::size_t{v}]).cast<double>();
}
Eigen::Vector3d areaVector(const MeshSoup& soup, const Polygon& corners) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t k = 1; k + 1 < corners.size(); ++k) {
    const Eigen::Vector3d a = cornerOf(soup, corners[0]);
    sum += 0.5 * (cornerOf(soup, corners[k]) - a).cross(cornerOf(soup, corners[k + 1]) - a);
  }
  return sum;
}

/// Triangles that all face as the polygon does, whose areas make its area, and whose edges are its sides once and
/// diagonals once each way, cover it exactly once.
void expectCovered(const MeshSoup& soup, const Polygon& corners) {
  ASSERT_EQ(soup.triangles.size(), corners.size() - 2);
  EXPECT_EQ(soup.part_of_triangle, std::vector<std::uint32_t>(corners.size() - 2, 2));
  const Eigen::Vector3d whole = areaVector(soup, corners);
  double area = 0;
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (const Triangle& t : soup.triangles) {
    const Eigen::Vector3d own = areaVector(soup, {t.begin(), t.end()});
    EXPECT_GT(own.dot(whole), 0);
    area += own.norm();
    for (std::size_t k = 0; k < 3; ++k) ++edges[{t[k], t[(k + 1) % 3]}];
  }
  EXPECT_NEAR(area, whole.norm(), 1e-4 * whole.norm());
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const std::pair side(corners[k], corners[(k + 1) % corners.size()]);
    EXPECT_EQ(edges[side], 1);
    EXPECT_FALSE(edges.contains({side.second, side.first}));
  }
  for (const auto& [edge, uses] : edges) EXPECT_EQ(uses, 1);
}

TEST_P(MeshLaws, PolygonsAreCoveredOnceByTrianglesThatFaceAsTheyDo) {
  const std::size_t corners = GetParam() % 3 == 0 ? 4 : count(5, 64);
  MeshSoup soup = flower(corners, 3);
  Polygon polygon(corners);
  std::iota(polygon.begin(), polygon.end(), 0U);
  std::rotate(polygon.begin(), polygon.begin() + signedIndex(count(0, corners - 1)), polygon.end());
  if (GetParam() % 2 == 0) std::reverse(polygon.begin(), polygon.end());
  appendPolygon(soup, polygon, 2);
  expectCovered(soup, polygon);
}

TEST_P(MeshLaws, RoundPolygonsOfManyCornersAreCoveredToo) {
  const std::size_t corners = count(65, 300);
  MeshSoup soup = flower(corners, 10);
  Polygon polygon(corners);
  std::iota(polygon.begin(), polygon.end(), 0U);
  appendPolygon(soup, polygon, 2);
  expectCovered(soup, polygon);
}

TEST_P(MeshLaws, QuadrilateralsAreCutAlongTheirShorterDiagonal) {
  MeshSoup soup = flower(4, 9);
  appendPolygon(soup, Polygon{0, 1, 2, 3}, 2);
  ASSERT_EQ(soup.triangles.size(), 2U);
  std::vector<std::uint32_t> shared;
  for (std::uint32_t v = 0; v < 4; ++v) {
    const auto has = [v](const Triangle& t) { return std::find(t.begin(), t.end(), v) != t.end(); };
    if (has(soup.triangles[0]) && has(soup.triangles[1])) shared.push_back(v);
  }
  ASSERT_EQ(shared.size(), 2U);
  const auto length = [&](std::uint32_t a, std::uint32_t b) { return (cornerOf(soup, a) - cornerOf(soup, b)).norm(); };
  EXPECT_LE(length(shared[0], shared[1]), std::min(length(0, 2), length(1, 3)) * 1.0001);
}

/// A PLY with types, further numbers and colours as it happens.
struct PlyStyle {
  int encoding = 0;  ///< text, little-endian, big-endian
  bool is_double = false, has_extra = false, wide_counts = false;
  int colors = 0;  ///< none, bytes, reals
};

std::string plyOf(const VertexPositions& vertices, const std::vector<Polygon>& polygons,
                  const std::vector<std::array<int, 3>>& colors, const PlyStyle& style) {
  constexpr std::array kNames{"ascii", "binary_little_endian", "binary_big_endian"};
  const char* real = style.is_double ? "float64" : "float";
  std::string bytes = fmt::format("ply\nformat {} 1.0\ncomment made up\nelement vertex {}\n",
                                  kNames[static_cast<std::size_t>(style.encoding)], vertices.rows());
  if (style.has_extra) bytes += "property short quality\n";
  for (const char* axis : {"x", "y", "z"}) bytes += fmt::format("property {} {}\n", real, axis);
  for (const char* color : {"red", "green", "blue"}) {
    if (style.colors != 0) bytes += fmt::format("property {} {}\n", style.colors == 1 ? "uchar" : "float32", color);
  }
  if (style.has_extra) bytes += "property int8 flags\n";
  bytes += fmt::format("element face {}\n", polygons.size());
  if (style.has_extra) bytes += "property uint16 group\n";
  bytes += fmt::format("property list {} {} vertex_index\nend_header\n", style.wide_counts ? "ushort" : "uint8",
                       style.wide_counts ? "uint" : "int32");
  const auto put = [&](auto value) {
    if (style.encoding == 0) {
      bytes += fmt::format("{} ", value);
      return;
    }
    std::string raw(reinterpret_cast<const char*>(&value), sizeof value);
    if (style.encoding == 2) std::reverse(raw.begin(), raw.end());
    bytes += raw;
  };
  for (Eigen::Index v = 0; v < vertices.rows(); ++v) {
    if (style.has_extra) put(std::int16_t{-7});
    for (const float axis : vertices.row(v)) {
      if (style.is_double) {
        put(double{axis});
      } else {
        put(axis);
      }
    }
    for (const int color : style.colors != 0 ? colors[unsignedIndex(v)] : std::array<int, 3>{}) {
      if (style.colors == 1) put(static_cast<std::uint8_t>(color));
      if (style.colors == 2) put(static_cast<float>(color) / 255.0F);
    }
    if (style.has_extra) put(std::int8_t{1});
    if (style.encoding == 0) bytes.back() = '\n';
  }
  for (const Polygon& polygon : polygons) {
    if (style.has_extra) put(std::uint16_t{60000});
    if (style.wide_counts) {
      put(static_cast<std::uint16_t>(polygon.size()));
      for (const std::uint32_t v : polygon) put(v);
    } else {
      put(static_cast<std::uint8_t>(polygon.size()));
      for (const std::uint32_t v : polygon) put(static_cast<std::int32_t>(v));
    }
    if (style.encoding == 0) bytes.back() = '\n';
  }
  return bytes;
}

/// One mesh in five formats is one mesh: places to the bit, polygons cut alike.
TEST_P(MeshLaws, EveryFormatTellsTheSameMesh) {
  const RandomMesh mesh = randomMesh();
  std::string obj, off = fmt::format("OFF\n{} {} 0\n", mesh.vertices.rows(), mesh.polygons.size());
  for (const auto& p : mesh.vertices.rowwise()) {
    obj += fmt::format("v {} {} {}\n", p.x(), p.y(), p.z());
    off += fmt::format("{} {} {}\n", p.x(), p.y(), p.z());
  }
  for (const Polygon& polygon : mesh.polygons) {
    obj += 'f';
    off += fmt::format("{}", polygon.size());
    const bool backwards = count(0, 1) == 1;
    for (const std::uint32_t v : polygon) {
      obj += backwards ? fmt::format(" {}", std::int64_t{v} - mesh.vertices.rows()) : fmt::format(" {}", v + 1);
      off += fmt::format(" {}", v);
    }
    obj += '\n';
    off += count(0, 1) == 1 ? " 128 20 3\n" : "\n";  // a colour may follow the corners
  }
  const FaceMesh expected = parseObj(obj, "a.obj");
  ASSERT_EQ(expected.vertices, mesh.vertices);
  MeshSoup cut;
  for (const auto& p : mesh.vertices.rowwise()) cut.positions.insert(cut.positions.end(), p.begin(), p.end());
  for (const Polygon& polygon : mesh.polygons) appendPolygon(cut, polygon, 0);
  std::set<Triangle> corners;  // two polygons may have three in common
  for (Triangle triangle : cut.triangles) {
    std::sort(triangle.begin(), triangle.end());
    corners.insert(triangle);
  }
  ASSERT_EQ(expected.triangles.size(), corners.size());
  const auto expectSame = [&](const FaceMesh& read, const std::string& what) {
    EXPECT_EQ(read.vertices, expected.vertices) << what;
    EXPECT_EQ(read.triangles, expected.triangles) << what;
  };
  expectSame(parseOff(off, "a.off"), "OFF");
  expectSame(parseObj(objBytes(expected), "b.obj"), "written OBJ");
  for (const int encoding : {0, 1, 2}) {
    const PlyStyle style{encoding, count(0, 1) == 1, count(0, 1) == 1, count(0, 1) == 1, 0};
    const std::string bytes = plyOf(mesh.vertices, mesh.polygons, {}, style);
    expectSame(parsePly(bytes, "a.ply"), bytes.substr(0, bytes.find("end_header")));
  }
}

/// sRGB to linear, as its standard has it.
double linearOf(int byte) {
  const double s = byte / 255.0;
  return s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4);
}

TEST_P(MeshLaws, ColoursOfPlyAreLinearOnceWhateverTheirType) {
  const RandomMesh mesh = randomMesh();
  std::vector<std::array<int, 3>> colors(unsignedIndex(mesh.vertices.rows()));
  for (auto& color : colors) {
    for (int& channel : color) channel = static_cast<int>(count(0, 255));
  }
  colors[0] = {0, 255, 10};  // the ends, and where the curve is straight
  for (const int encoding : {0, 1, 2}) {
    for (const int kind : {1, 2}) {
      const PlyStyle style{encoding, false, count(0, 1) == 1, false, kind};
      const FaceMesh read = parsePly(plyOf(mesh.vertices, mesh.polygons, colors, style), "a.ply");
      ASSERT_EQ(read.vertex_colors.size(), colors.size());
      for (std::size_t v = 0; v < colors.size(); ++v) {
        for (std::size_t k = 0; k < 3; ++k)
          EXPECT_NEAR(double{read.vertex_colors[v][k]}, linearOf(colors[v][k]), 1e-6)
              << colors[v][k] << (kind == 2 ? " as a real" : " as a byte");
      }
    }
  }
}

/// A dented ball.
FaceMesh ball(std::mt19937& random) {
  constexpr int kRings = 8, kSides = 12;
  std::uniform_real_distribution<float> dent(0.7F, 1.3F);
  FaceMesh mesh;
  mesh.vertices.resize(kRings * kSides + 2, 3);
  const auto at = [](int ring, int side) { return static_cast<std::uint32_t>(ring * kSides + side % kSides); };
  for (int r = 0; r < kRings; ++r) {
    for (int s = 0; s < kSides; ++s) {
      const double theta = std::numbers::pi * (r + 1) / (kRings + 1), phi = 2 * std::numbers::pi * s / kSides;
      mesh.vertices.row(at(r, s)) = dent(random) * Eigen::RowVector3d(std::sin(theta) * std::cos(phi),
                                                                      std::sin(theta) * std::sin(phi), std::cos(theta))
                                                       .cast<float>();
    }
  }
  const auto top = static_cast<std::uint32_t>(kRings * kSides), bottom = top + 1;
  mesh.vertices.row(top) << 0, 0, 1;
  mesh.vertices.row(bottom) << 0, 0, -1;
  for (int s = 0; s < kSides; ++s) {
    mesh.triangles.push_back({top, at(0, s), at(0, s + 1)});
    mesh.triangles.push_back({bottom, at(kRings - 1, s + 1), at(kRings - 1, s)});
    for (int r = 0; r + 1 < kRings; ++r) {
      mesh.triangles.push_back({at(r, s), at(r + 1, s), at(r + 1, s + 1)});
      mesh.triangles.push_back({at(r, s), at(r + 1, s + 1), at(r, s + 1)});
    }
  }
  mesh.parts = {{.name = "skin", .triangle_count = mesh.triangles.size()}};
  return mesh;
}

TEST_P(MeshLaws, NormalsOfAClosedSurfaceCancelOutAndTurnWithIt) {
  const FaceMesh mesh = ball(random_);
  VertexPositions sums = VertexPositions::Zero(mesh.vertices.rows(), 3);
  addNormals(mesh.vertices, mesh.triangles, sums);
  EXPECT_LT(sums.colwise().sum().norm(), 1e-4F) << "a closed surface has as much area on all sides";
  const VertexPositions normals = vertexNormals(mesh.vertices, mesh.triangles);
  EXPECT_LT((normals.rowwise().norm().array() - 1).abs().maxCoeff(), 1e-5F);
  const Eigen::Matrix3f turned = turn().cast<float>();
  const auto scale = static_cast<float>(number(0.1, 10));
  const VertexPositions moved = (scale * mesh.vertices * turned.transpose()).rowwise() + Eigen::RowVector3f(1, 2, 3);
  EXPECT_LT((vertexNormals(moved, mesh.triangles) - normals * turned.transpose()).cwiseAbs().maxCoeff(), 1e-3F);
  std::vector<Triangle> inside_out = mesh.triangles;
  for (Triangle& t : inside_out) std::swap(t[1], t[2]);
  EXPECT_LT((vertexNormals(mesh.vertices, inside_out) + normals).cwiseAbs().maxCoeff(), 1e-5F);
}

/// A sheet of skin whose lower half a shape of the jaw takes down; along the slit its halves are apart.
struct SlitSheet {
  FaceMesh mesh;
  VertexPositions jaw_moves;
  std::vector<bool> is_upper;
};
SlitSheet slitSheet(double step, double gap, double drop, bool is_parted) {
  constexpr double kHalfMm = 25;
  std::vector<Eigen::RowVector3d> places, moves;
  SlitSheet sheet;
  const auto rows = static_cast<int>(30 / step), columns = static_cast<int>(60 / step);
  const auto add = [&](int row, int column, bool is_upper) {
    const double x = (column - 0.5 * columns) * step, away = std::min(1.0, std::abs(x) / kHalfMm);
    const double y = row * step + (is_upper ? 0.5 : -0.5) * gap;
    const double share = is_parted ? (is_upper ? 0 : 1) : std::clamp(0.5 - y / 30, 0.0, 1.0);
    places.emplace_back(x, y, 20 - 0.01 * x * x);
    const double down = drop * share * std::cos(0.5 * std::numbers::pi * away);
    moves.emplace_back(0, -down, 0.2 * down);  // a jaw that goes forward as it opens
    sheet.is_upper.push_back(is_upper);
  };
  for (int row = -rows; row <= 0; ++row) {
    for (int c = 0; c <= columns; ++c) add(row, c, false);
  }
  const auto first_upper = static_cast<std::uint32_t>(places.size());
  for (int row = 0; row <= rows; ++row) {
    for (int c = 0; c <= columns; ++c) add(row, c, true);
  }
  const auto width = static_cast<std::uint32_t>(columns + 1);
  for (std::uint32_t v = 0; v + width + 1 < places.size(); ++v) {
    if (v % width + 1 == width || (v < first_upper && v + width >= first_upper)) continue;
    sheet.mesh.triangles.push_back({v, v + 1, v + width + 1});
    sheet.mesh.triangles.push_back({v, v + width + 1, v + width});
  }
  sheet.mesh.parts = {{.name = "skin", .triangle_count = sheet.mesh.triangles.size()}};
  sheet.mesh.vertices.resize(signedIndex(places.size()), 3);
  sheet.jaw_moves.resize(signedIndex(places.size()), 3);
  for (std::size_t i = 0; i < places.size(); ++i) {
    sheet.mesh.vertices.row(signedIndex(i)) = places[i].cast<float>();
    sheet.jaw_moves.row(signedIndex(i)) = moves[i].cast<float>();
  }
  return sheet;
}

TEST_P(MeshLaws, AJawShapeShowsTheSlitAndOnlyIt) {
  const double step = number(1, 2), gap = number(0.05, 0.4), drop = number(5, 20);
  const SlitSheet parted = slitSheet(step, gap, drop, true);
  const std::vector<SlitPair> slit = lipSlit(parted.mesh, parted.jaw_moves);
  std::set<std::size_t> steps;
  for (const SlitPair& pair : slit) {
    EXPECT_TRUE(parted.is_upper[pair.upper]);
    EXPECT_FALSE(parted.is_upper[pair.lower]);
    const Eigen::RowVector3f up = parted.mesh.vertices.row(pair.upper), low = parted.mesh.vertices.row(pair.lower);
    EXPECT_LT(std::abs(up.x() - low.x()), step) << "they face each other";
    EXPECT_NEAR(double{up.y()}, 0.5 * gap, 1e-4) << "the nearest of the upper lip is its edge";
    EXPECT_LT(pair.step, kSlitSteps);
    steps.insert(pair.step);
  }
  EXPECT_GT(asReal(steps.size()), 0.8 * std::min(asReal(kSlitSteps), 40 / step)) << "from end to end";
  EXPECT_TRUE(
      std::is_sorted(slit.begin(), slit.end(), [](const SlitPair& a, const SlitPair& b) { return a.step < b.step; }));
  for (std::size_t i = 1; i < slit.size(); ++i) {
    if (slit[i].step != slit[i - 1].step) continue;
    EXPECT_LE(parted.mesh.vertices(slit[i].lower, 2), parted.mesh.vertices(slit[i - 1].lower, 2)) << "front first";
  }
  EXPECT_TRUE(std::is_sorted(slit.begin(), slit.end(), [&](const SlitPair& a, const SlitPair& b) {
    return a.step != b.step && parted.mesh.vertices(a.lower, 0) < parted.mesh.vertices(b.lower, 0);
  })) << "from low to high x";
  const SlitSheet whole = slitSheet(step, gap, drop, false);
  EXPECT_TRUE(lipSlit(whole.mesh, whole.jaw_moves).empty()) << "skin that stretches is no slit";
  EXPECT_TRUE(lipSlit(parted.mesh, VertexPositions::Zero(parted.mesh.vertices.rows(), 3)).empty());
}

TEST_P(MeshLaws, SkinVerticesAreThoseOfPartsOfSkin) {
  FaceMesh mesh = ball(random_);
  mesh.parts.clear();
  std::set<std::uint32_t> bare, with_hair;
  constexpr std::array kKinds{PartKind::kSkin,        PartKind::kLips, PartKind::kUpperTeeth, PartKind::kTongue,
                              PartKind::kMouthInside, PartKind::kEye,  PartKind::kHair,       PartKind::kOther};
  for (std::size_t first = 0; first < mesh.triangles.size();) {
    const std::size_t length = std::min(count(1, 40), mesh.triangles.size() - first);
    mesh.parts.push_back({.name = "part",
                          .kind = kKinds[count(0, kKinds.size() - 1)],
                          .first_triangle = first,
                          .triangle_count = length,
                          .stands_off = count(0, 2) == 0});
    for (std::size_t t = first; t < first + length; ++t) {
      for (const std::uint32_t v : mesh.triangles[t]) {
        if (!isSkin(mesh.parts.back().kind)) continue;
        with_hair.insert(v);
        if (!mesh.parts.back().stands_off) bare.insert(v);
      }
    }
    first += length;
  }
  EXPECT_EQ(skinVertices(mesh, false), (std::vector<std::uint32_t>{bare.begin(), bare.end()}));
  EXPECT_EQ(skinVertices(mesh, true), (std::vector<std::uint32_t>{with_hair.begin(), with_hair.end()}));
}

TEST_P(MeshLaws, ShapesOfTheMouthAreToldHoweverTheirNamesAreSpelt) {
  const auto spelt = [&](std::string_view name) {
    std::string text = count(0, 1) == 1 ? "Face." : "";
    for (const char letter : name) {
      if (count(0, 4) == 0) text += count(0, 1) == 1 ? '_' : ' ';
      text += count(0, 1) == 1 ? static_cast<char>(std::toupper(static_cast<unsigned char>(letter))) : letter;
    }
    return text;
  };
  for (const std::string_view name : kArkitNames) {
    const bool is_mouth = name.starts_with("Mouth") || name.starts_with("Jaw") || name.starts_with("Tongue");
    EXPECT_EQ(isMouthShape(spelt(name)), is_mouth) << name;
    EXPECT_EQ(isJawShape(spelt(name)), name == "JawOpen") << name;
  }
  for (const char* name : {"A", "aa", "viseme_aa", "mouthOpen", "V_AA", "M_F00_000_00_Fcl_MTH_A", "あ"})
    EXPECT_TRUE(isJawShape(name)) << name;
  for (const char* name : {"I", "U", "viseme_PP", "MTH_Fun", "Fcl_MTH_Angry", "Smile", "oh"}) {
    EXPECT_TRUE(isMouthShape(name)) << name;
    EXPECT_FALSE(isJawShape(name)) << name;
  }
  for (const char* name : {"Basis", "EYE_Close", "b", "brow_up", ""}) EXPECT_FALSE(isMouthShape(name)) << name;
}

TEST(PartKindNames, GoThereAndBack) {
  std::set<std::string_view> names;
  for (int kind = 0; kind <= static_cast<int>(PartKind::kOther); ++kind) {
    const std::string_view name = nameOf(static_cast<PartKind>(kind));
    EXPECT_EQ(partKindFromName(name), static_cast<PartKind>(kind)) << name;
    EXPECT_TRUE(names.insert(name).second) << name;
  }
  EXPECT_EQ(partKindFromName("nose"), std::nullopt);
}

}  // namespace
}  // namespace mouthpiece
