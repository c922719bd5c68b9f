#pragma once

#include <filesystem>
#include <string>

#include "deform/kernel/face_animation.h"
#include "deform/mesh/face_mesh.h"

namespace mouthpiece {

/// Every vertex of every frame, in the mesh's own vertex order and unit (docs/formats/pc2_mdd.md).
/// PC2, little-endian: 3ds Max, Blender's mesh cache, Houdini.
std::string pc2Bytes(const FaceAnimation& animation);
/// MDD, big-endian: LightWave, Blender, Maya plug-ins.
std::string mddBytes(const FaceAnimation& animation);

/// Into a file, atomically. Throw InputError when it cannot be written.
void writePc2(const std::filesystem::path& path, const FaceAnimation& animation);
void writeMdd(const std::filesystem::path& path, const FaceAnimation& animation);

/// One OBJ a frame in `folder`: STEM.0000.obj, STEM.0001.obj ..., each with area-weighted normals (`vn`), all
/// triangles, parts as `usemtl`.
void writeObjSequence(const std::filesystem::path& folder, std::string_view stem, const FaceMesh& mesh,
                      const FaceAnimation& animation);

}  // namespace mouthpiece
