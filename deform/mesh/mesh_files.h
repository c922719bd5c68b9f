#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "deform/mesh/triangles.h"

namespace mouthpiece {

// For those who hand a mesh on and do not look into it.
struct FaceMesh;

/// parseFaceMesh() (face_mesh.h).
std::shared_ptr<const FaceMesh> sharedFaceMesh(std::string_view bytes, const std::filesystem::path& path,
                                               std::string_view object = {});

/// Morph targets of a head, by name; a vertex of `moves` is one of the mesh that parseFaceMesh gives for the same
/// bytes.
struct FaceShapes {
  std::vector<std::string> names;
  std::vector<VertexPositions> moves;  ///< displacement at weight 1, the mesh's unit
};

/// What the files that parseFaceMesh() reads end with, in small letters.
inline constexpr std::array<std::string_view, 5> kHeadMeshEndings{".glb", ".vrm", ".obj", ".ply", ".off"};
/// Whether a file of that name can hold a head, in small or capital letters.
bool isHeadMesh(const std::filesystem::path& name);
/// Whether `path` ends as a GLB does.
bool isGlb(const std::filesystem::path& path);
/// Those of a GLB; none for other formats. Throws InputError as parseFaceMesh does.
FaceShapes parseFaceShapes(std::string_view bytes, const std::filesystem::path& path, std::string_view object = {});

}  // namespace mouthpiece
