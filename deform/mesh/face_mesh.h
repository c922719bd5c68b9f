#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "deform/mesh/mesh_files.h"
#include "deform/mesh/part_kind.h"
#include "deform/mesh/triangles.h"

namespace mouthpiece {

/// Consecutive triangles [first_triangle, first_triangle + triangle_count) with one material.
struct MeshPart {
  std::string name;  ///< material or group
  PartKind kind = PartKind::kSkin;
  std::size_t first_triangle = 0;
  std::size_t triangle_count = 0;
  std::array<float, 4> base_color{0.8F, 0.6F, 0.5F, 1.0F};  ///< linear RGBA
  float roughness = 0.6F;
  int material = -1;        ///< of a GLB's, its number
  bool stands_off = false;  ///< lashes, brows, beards: hair rooted in the skin, a piece of its own
};

/// A head's surface at rest. Triangles only (polygons are split when read).
struct FaceMesh {
  VertexPositions vertices;
  std::vector<Triangle> triangles;
  std::vector<MeshPart> parts;                            ///< cover all triangles, in order
  std::vector<std::array<float, 2>> texture_coordinates;  ///< empty, or one a vertex
  std::vector<std::array<float, 3>> vertex_colors;        ///< empty, or one a vertex: linear RGB, multiplies base_color
  double metres_per_unit = 0.001;

  [[nodiscard]] std::size_t vertexCount() const { return unsignedIndex(vertices.rows()); }
};

/// A mesh with vertices and parts more than another one has, whose own come first, numbered as they were.
struct GrownMesh {
  FaceMesh mesh;
  /// Of each vertex after the other's: one before it that it goes with.
  std::vector<std::uint32_t> parents;
};

/// The triangles of one part, which must not be outlived; all those of parts of some kinds, in the mesh's order.
std::span<const Triangle> trianglesOf(const FaceMesh& mesh, const MeshPart& part);
std::vector<Triangle> trianglesOf(const FaceMesh& mesh, std::initializer_list<PartKind> kinds);

/// Of a share in [0, 1] of sRGB, as files keep colours, its linear one, and back (IEC 61966-2-1).
double linearFromSrgb(double share);
double srgbFromLinear(double share);

/// Linear RGBA of a part, with its vertices' colours where they have some: what files tell that keep one colour a part.
std::array<float, 4> meanColor(const FaceMesh& mesh, const MeshPart& part);

/// Reads OBJ, PLY, OFF or GLB (also named VRM) by the name's ending; `usemtl`/`g`/`o` (OBJ) and materials (GLB) make
/// the parts, whose kind is told by bones, shapes and name (mesh_reader.h). `object`: of a GLB's scene only what hangs
/// on the node, or shows the mesh, of this name; empty: all. Throws InputError with the line or byte for no faces, NaN
/// or infinite coordinates, an index out of range, or counts larger than the file can hold.
FaceMesh readFaceMesh(const std::filesystem::path& path, std::string_view object = {});
/// The same for bytes already in memory; `path` gives the format and the name in messages.
FaceMesh parseFaceMesh(std::string_view bytes, const std::filesystem::path& path, std::string_view object = {});

void writeObj(const std::filesystem::path& path, const FaceMesh& mesh);
/// What writeObj writes; parseFaceMesh gives the same mesh back, colours to five digits of their sRGB.
std::string objBytes(const FaceMesh& mesh);

}  // namespace mouthpiece
