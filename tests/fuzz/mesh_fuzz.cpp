// Any bytes as PLY, OFF or GLB (the first byte chooses): a mesh with sound indices and finite places, or an InputError.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "base/errors.h"
#include "deform/mesh/face_mesh.h"
#include "deform/mesh/mesh_files.h"
#include "deform/mesh/mesh_reader.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string_view bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  using namespace mouthpiece;
  try {
    const FaceMesh mesh = data[0] % 3 == 0   ? parsePly(bytes, "fuzz.ply")
                          : data[0] % 3 == 1 ? parseOff(bytes, "fuzz.off")
                                             : parseGlb(bytes, "fuzz.glb");
    if (!mesh.vertices.allFinite()) std::abort();
    for (const auto& triangle : mesh.triangles) {
      for (const std::uint32_t corner : triangle) {
        if (corner >= static_cast<std::size_t>(mesh.vertices.rows())) std::abort();
      }
    }
  } catch (const InputError&) {
  }
  if (data[0] % 3 != 2) return 0;
  try {
    for (const VertexPositions& moves : parseFaceShapes(bytes, "fuzz.glb").moves) {
      if (!moves.allFinite()) std::abort();
    }
  } catch (const InputError&) {
  }
  return 0;
}
