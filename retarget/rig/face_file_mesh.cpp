// The mesh beside a .face.
#include <fmt/format.h>

#include <filesystem>
#include <string>
#include <system_error>

#include "base/errors.h"
#include "base/files.h"
#include "deform/mesh/face_mesh.h"
#include "deform/mesh/mesh_limits.h"
#include "retarget/rig/face_file.h"

namespace mouthpiece {

void turnMesh(const Eigen::Matrix3d& turn, FaceMesh& mesh) {
  if (turn.isIdentity(0)) return;
  mesh.vertices = (mesh.vertices.cast<double>() * turn.transpose()).cast<float>().eval();
}

std::string readMeshBytesOf(const FaceFile& face, const std::filesystem::path& face_path) {
  const std::filesystem::path mesh_path = face_path.parent_path() / face.mesh_file;
  std::error_code error;
  if (!std::filesystem::is_regular_file(mesh_path, error)) {
    throw InputError(
        face_path.string(), "mesh.file",
        fmt::format("names {}, which is not there; expected the mesh of the fit", printable(mesh_path.string(), 300)));
  }
  std::string bytes = readFile(mesh_path, kMaxMeshBytes);
  // Nothing is told of what the file holds: a stranger's face may name any.
  if (sha256Hex(bytes) != face.mesh_sha256)
    throw InputError(mesh_path.string(), "",
                     fmt::format("has changed since {} was fitted to it; run `retarget fit` again",
                                 printable(face_path.filename().string(), 300)));
  return bytes;
}

std::shared_ptr<const FaceMesh> meshOf(const FaceFile& face, const std::filesystem::path& face_path,
                                       std::string_view bytes) {
  if (face.mesh != nullptr) return face.mesh;
  FaceMesh mesh = parseFaceMesh(bytes, face_path.parent_path() / face.mesh_file, face.mesh_object);
  mesh.metres_per_unit = face.metres_per_unit;
  turnMesh(face.upright_from_mesh, mesh);
  for (MeshPart& part : mesh.parts) {
    if (const auto kind = face.part_kinds.find(part.name); kind != face.part_kinds.end()) part.kind = kind->second;
  }
  return std::make_shared<const FaceMesh>(std::move(mesh));
}

FaceMesh readMeshOf(const FaceFile& face, const std::filesystem::path& face_path) {
  return *meshOf(face, face_path, readMeshBytesOf(face, face_path));
}

}  // namespace mouthpiece
