// Any bytes as an OBJ: a mesh that keeps its promises, or an InputError.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "base/errors.h"
#include "deform/mesh/face_mesh.h"
#include "deform/mesh/mesh_reader.h"

namespace {

void require(bool condition) {
  if (!condition) std::abort();
}

/// What finishMesh promises, and that writing and reading again changes nothing.
void checkMesh(const mouthpiece::FaceMesh& mesh) {
  const auto vertices = static_cast<std::size_t>(mesh.vertices.rows());
  require(!mesh.triangles.empty() && mesh.vertices.allFinite());
  for (const auto& triangle : mesh.triangles) {
    for (const std::uint32_t corner : triangle) require(corner < vertices);
  }
  std::size_t next = 0;
  for (const auto& part : mesh.parts) {
    require(part.first_triangle == next);
    next += part.triangle_count;
  }
  require(next == mesh.triangles.size());
  require(mesh.vertex_colors.empty() || mesh.vertex_colors.size() == vertices);
  require(mesh.texture_coordinates.empty() || mesh.texture_coordinates.size() == vertices);
  const mouthpiece::FaceMesh again = mouthpiece::parseObj(mouthpiece::objBytes(mesh), "again.obj");
  require(again.vertices == mesh.vertices && again.triangles.size() == mesh.triangles.size());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  try {
    checkMesh(mouthpiece::parseObj(bytes, "fuzz.obj"));
  } catch (const mouthpiece::InputError&) {
  }
  return 0;
}
