#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "deform/mesh/bone_roles.h"
#include "deform/mesh/face_mesh.h"
#include "deform/mesh/mesh_limits.h"

namespace mouthpiece {

/// What a file tells of its vertices that their places do not; each list is empty, or has an entry a vertex.
struct VertexEvidence {
  std::vector<BoneRole> bones;
  std::vector<float> mouth_moves;  ///< the furthest that one of the file's own shapes of the mouth moves it
  std::vector<float> jaw_moves;    ///< how far the shape that opens the jaw does
};

/// What a reader collects before the parts are put in order.
struct MeshSoup {
  std::vector<float> positions;  ///< x y z a vertex
  std::vector<Triangle> triangles;
  std::vector<std::uint32_t> part_of_triangle;  ///< index into parts
  std::vector<MeshPart> parts;                  ///< names, colours; the triangle ranges are filled by finishMesh
  std::vector<std::array<float, 2>> texture_coordinates;
  std::vector<std::array<float, 3>> vertex_colors;
  double metres_per_unit = 0.001;
  bool has_colors = false;  ///< the file gives base_color
  VertexEvidence evidence;

  [[nodiscard]] std::size_t vertexCount() const { return positions.size() / 3; }
};

/// The formats, from bytes in memory; `file` is for messages. Each throws InputError and nothing else for bad bytes.
FaceMesh parseObj(std::string_view bytes, std::string_view file);
FaceMesh parsePly(std::string_view bytes, std::string_view file);
FaceMesh parseOff(std::string_view bytes, std::string_view file);
FaceMesh parseGlb(std::string_view bytes, std::string_view file, std::string_view object = {});
FaceShapes parseGlbShapes(std::string_view bytes, std::string_view file, std::string_view object = {});
/// Splits a polygon into triangles that face as it does, along short diagonals; one with more than 64 corners as a fan.
void appendPolygon(MeshSoup& soup, std::span<const std::uint32_t> corners, std::uint32_t part);
/// Makes one of triangles on the same vertices, as programs write them that draw each surface from both sides: of a
/// part that side stays which faces away from the mesh's middle.
void dropBacks(MeshSoup& soup);

/// Sorts the triangles by part, drops empty parts and degenerate index triples, guesses kinds, splits teeth and gums
/// into upper and lower. Throws InputError when there is no triangle.
FaceMesh finishMesh(MeshSoup soup, std::string_view file);

/// The kind that a material's or group's name tells; nullopt when it tells nothing.
std::optional<PartKind> kindFromName(std::string_view name);

/// Sets the kinds of the parts: from the bones and the shapes that move them, else from their names, and splits parts
/// that hold both rows of teeth (or gums and tongue).
void assignPartKinds(FaceMesh& mesh, bool keep_colors, const VertexEvidence& evidence = {});

enum class InnerKind : std::uint8_t { kNone, kEye, kTeeth, kTongue, kGumsAndTongue };
/// Eyes, teeth and tongue of a head whose names tell none of them, by islands of its skin: of each triangle of each
/// part, nothing for parts that are no skin; empty where nothing is found. An eye is one of two balls side by side, the
/// rest lies under the eyes behind skin. Heights along y, the face along +z.
std::vector<std::vector<InnerKind>> innerKinds(const FaceMesh& mesh, const std::vector<MeshPart>& parts);

enum class GumPiece { kUpperGum, kLowerGum, kTongue };
/// Splits gums that come in one piece with the tongue: for each of `gums`, a triangle of `mesh`, what it belongs to.
/// The tongue is what lies under one surface, the palate, together with its own underside, as far as it hangs together;
/// the rest goes with the row of teeth that is nearer. Heights along y.
std::vector<GumPiece> splitGums(const FaceMesh& mesh, std::span<const Triangle> gums,
                                std::span<const Triangle> upper_teeth, std::span<const Triangle> lower_teeth);
/// The middle of a triangle's corners.
inline Eigen::Vector3f centroid(const FaceMesh& mesh, const Triangle& t) {
  return (mesh.vertices.row(t[0]) + mesh.vertices.row(t[1]) + mesh.vertices.row(t[2])).transpose() / 3.0F;
}

}  // namespace mouthpiece
