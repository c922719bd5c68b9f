#include "deform/mesh/face_mesh.h"

#include <fmt/format.h>
#include <cmath>

#include <Eigen/Geometry>
#include <algorithm>
#include <iterator>
#include <string>

#include "base/errors.h"
#include "base/files.h"
#include "base/text_encoding.h"
#include "deform/mesh/mesh_reader.h"

namespace mouthpiece {
namespace {

constexpr std::array<std::string_view, 9> kPartKindNames{"skin",         "lips", "upper_teeth", "lower_teeth", "tongue",
                                                         "mouth_inside", "eye",  "hair",        "other"};

}  // namespace

std::string_view nameOf(PartKind kind) { return kPartKindNames[static_cast<std::size_t>(kind)]; }

std::optional<PartKind> partKindFromName(std::string_view name) {
  const auto found = std::find(kPartKindNames.begin(), kPartKindNames.end(), name);
  if (found == kPartKindNames.end()) return std::nullopt;
  return static_cast<PartKind>(found - kPartKindNames.begin());
}

std::span<const Triangle> trianglesOf(const FaceMesh& mesh, const MeshPart& part) {
  return std::span(mesh.triangles).subspan(part.first_triangle, part.triangle_count);
}

std::vector<Triangle> trianglesOf(const FaceMesh& mesh, std::initializer_list<PartKind> kinds) {
  std::vector<Triangle> triangles;
  for (const MeshPart& part : mesh.parts) {
    if (std::find(kinds.begin(), kinds.end(), part.kind) == kinds.end()) continue;
    const std::span<const Triangle> own = trianglesOf(mesh, part);
    triangles.insert(triangles.end(), own.begin(), own.end());
  }
  return triangles;
}

bool isHeadMesh(const std::filesystem::path& name) {
  const std::string ending = lowerCase(name.extension().string());
  return std::find(kHeadMeshEndings.begin(), kHeadMeshEndings.end(), ending) != kHeadMeshEndings.end();
}

bool isGlb(const std::filesystem::path& path) {
  const std::string extension = lowerCase(path.extension().string());
  return extension == ".glb" || extension == ".vrm";
}

FaceMesh parseFaceMesh(std::string_view bytes, const std::filesystem::path& path, std::string_view object) {
  const std::string extension = lowerCase(path.extension().string());
  const std::string file = path.string();
  if (isGlb(path)) return parseGlb(bytes, file, object);
  if (!object.empty()) throw InputError(file, "", "holds no scene to choose an object of; expected a GLB");
  if (extension == ".obj" || extension == ".ply" || extension == ".off")
    expectText(bytes, file, fmt::format("a {}, as its name says", extension));
  if (extension == ".obj") return parseObj(bytes, file);
  if (extension == ".ply") return parsePly(bytes, file);
  if (extension == ".off") return parseOff(bytes, file);
  if (extension == ".fbx" || extension == ".gltf" || extension == ".blend" || extension == ".dae") {
    throw InputError(file, "",
                     fmt::format("found {}; expected .glb, .vrm, .obj, .ply or .off: docs/guides/convert_a_head.md "
                                 "says how to make a GLB of it",
                                 extension));
  }
  throw InputError(
      file, "",
      fmt::format("found the ending '{}'; expected .obj, .ply, .off, .glb or .vrm", printable(extension, 20)));
}

std::shared_ptr<const FaceMesh> sharedFaceMesh(std::string_view bytes, const std::filesystem::path& path,
                                               std::string_view object) {
  return std::make_shared<const FaceMesh>(parseFaceMesh(bytes, path, object));
}

FaceShapes parseFaceShapes(std::string_view bytes, const std::filesystem::path& path, std::string_view object) {
  return isGlb(path) ? parseGlbShapes(bytes, path.string(), object) : FaceShapes{};
}

FaceMesh readFaceMesh(const std::filesystem::path& path, std::string_view object) {
  const std::string extension = lowerCase(path.extension().string());
  if (extension != ".obj" && extension != ".ply" && extension != ".off" && !isGlb(path))
    return parseFaceMesh("", path, object);
  return parseFaceMesh(readFile(path, kMaxMeshBytes), path, object);
}

void writeObj(const std::filesystem::path& path, const FaceMesh& mesh) { writeFileAtomically(path, objBytes(mesh)); }

std::string objBytes(const FaceMesh& mesh) {
  std::string text = "# A face of Mouthpiece\n";
  text.reserve(mesh.vertexCount() * 64 + mesh.triangles.size() * 24);
  auto out = std::back_inserter(text);
  const bool colored = !mesh.vertex_colors.empty();
  for (Eigen::Index i = 0; i < mesh.vertices.rows(); ++i) {
    fmt::format_to(out, "v {} {} {}", mesh.vertices(i, 0), mesh.vertices(i, 1), mesh.vertices(i, 2));
    if (colored) {
      const auto& color = mesh.vertex_colors[unsignedIndex(i)];
      for (const float channel : color) fmt::format_to(out, " {:.5g}", srgbFromLinear(channel));
    }
    text.push_back('\n');
  }
  const bool textured = !mesh.texture_coordinates.empty();
  for (const auto& uv : mesh.texture_coordinates) fmt::format_to(out, "vt {} {}\n", uv[0], uv[1]);
  for (const MeshPart& part : mesh.parts) {
    fmt::format_to(out, "usemtl {}\n", part.name);
    for (const auto& [a, b, c] : trianglesOf(mesh, part)) {
      if (textured) {
        fmt::format_to(out, "f {0}/{0} {1}/{1} {2}/{2}\n", a + 1, b + 1, c + 1);
      } else {
        fmt::format_to(out, "f {} {} {}\n", a + 1, b + 1, c + 1);
      }
    }
  }
  return text;
}

double linearFromSrgb(double share) {
  return share <= 0.04045 ? share / 12.92 : std::pow((share + 0.055) / 1.055, 2.4);
}

double srgbFromLinear(double share) {
  return share <= 0.0031308 ? 12.92 * share : 1.055 * std::pow(share, 1 / 2.4) - 0.055;
}

std::array<float, 4> meanColor(const FaceMesh& mesh, const MeshPart& part) {
  if (mesh.vertex_colors.empty() || part.triangle_count == 0) return part.base_color;
  std::array<float, 4> mean{0, 0, 0, part.base_color[3]};
  for (const Triangle& t : trianglesOf(mesh, part)) {
    for (const std::uint32_t v : t) {
      for (std::size_t k = 0; k < 3; ++k)
        mean[k] += mesh.vertex_colors[v][k] * part.base_color[k] / asFloat(3 * part.triangle_count);
    }
  }
  return mean;
}

void addNormals(const VertexPositions& vertices, const std::vector<Triangle>& triangles, VertexPositions& sums) {
  for (const auto& [a, b, c] : triangles) {
    // The cross product's length is twice the area: adding it as it is weighs by area.
    const Eigen::RowVector3f normal = (vertices.row(b) - vertices.row(a)).cross(vertices.row(c) - vertices.row(a));
    sums.row(a) += normal;
    sums.row(b) += normal;
    sums.row(c) += normal;
  }
}

VertexPositions vertexNormals(const VertexPositions& vertices, const std::vector<Triangle>& triangles) {
  VertexPositions normals = VertexPositions::Zero(vertices.rows(), 3);
  addNormals(vertices, triangles, normals);
  for (Eigen::Index i = 0; i < normals.rows(); ++i) {
    const float length = normals.row(i).norm();
    if (length > 0.0F) normals.row(i) /= length;
  }
  return normals;
}

}  // namespace mouthpiece
