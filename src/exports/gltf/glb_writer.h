#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "deform/mesh/face_mesh.h"
#include "exports/shapes/principal_shapes.h"

namespace mouthpiece {

/// glTF 2.0, binary (docs/formats/glb.md): one mesh with a primitive for each part that has triangles, a morph target
/// (positions and normals, sparse) for each shape and one linear weights animation; metres. `name` is the node's and
/// the mesh's. `shapes` must come from an animation of `mesh`.
std::string glbBytes(const FaceMesh& mesh, const PrincipalShapes& shapes, std::string_view name);

/// glbBytes() into a file, atomically.
void writeGlb(const std::filesystem::path& path, const FaceMesh& mesh, const PrincipalShapes& shapes,
              std::string_view name);

}  // namespace mouthpiece
