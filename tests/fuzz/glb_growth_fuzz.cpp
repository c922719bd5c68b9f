// A GLB of any bytes, behind a byte that is not looked at (glb_mutator.cpp), with a part more, and with its lips cut
// along a line through its middle: a GLB that can be read and has more than the given one, or an InputError. And its
// pictures for other files.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "base/errors.h"
#include "deform/mesh/face_mesh.h"
#include "deform/mesh/glb_growth.h"
#include "deform/mesh/mesh_reader.h"
#include "deform/topology/lip_cut.h"
#include "exports/scenes/scene_textures.h"

namespace {

using namespace mouthpiece;

/// Over the middle half of the mesh's width, half way up, at the depth of its nearest vertices.
LipLine lineThrough(const FaceMesh& mesh) {
  constexpr int kPlaces = 20;
  const Eigen::RowVector3f low = mesh.vertices.colwise().minCoeff(), size = mesh.vertices.colwise().maxCoeff() - low;
  LipLine line;
  line.is_parted = false;
  for (int i = 0; i <= kPlaces; ++i) {
    const float across = 0.25F + 0.5F * static_cast<float>(i) / kPlaces;
    Eigen::RowVector3f place = low + Eigen::RowVector3f(across, 0.5F, 0.5F).cwiseProduct(size);
    Eigen::Index nearest = 0;
    (mesh.vertices.leftCols<2>().rowwise() - place.head<2>()).rowwise().squaredNorm().minCoeff(&nearest);
    place.z() = mesh.vertices(nearest, 2);
    line.upper.emplace_back(place.cast<double>().transpose());
  }
  line.lower = line.upper;
  line.corner_right = line.upper.front();
  line.corner_left = line.upper.back();
  return line;
}

/// With a triangle before its last vertex.
GrownMesh withTooth(const FaceMesh& mesh) {
  GrownMesh grown{mesh, {}};
  const auto old = static_cast<std::uint32_t>(mesh.vertexCount());
  grown.parents.assign(3, old - 1);
  grown.mesh.vertices.conservativeResize(old + 3, Eigen::NoChange);
  for (std::uint32_t k = 0; k < 3; ++k) {
    grown.mesh.vertices.row(old + k) = mesh.vertices.row(old - 1) + Eigen::RowVector3f::Unit(static_cast<int>(k));
    if (!mesh.vertex_colors.empty()) grown.mesh.vertex_colors.push_back({1, 1, 1});
  }
  grown.mesh.parts.push_back({.name = "tooth", .first_triangle = mesh.triangles.size(), .triangle_count = 1});
  grown.mesh.triangles.push_back({old, old + 1, old + 2});
  return grown;
}

void expectMore(std::string_view bytes, const FaceMesh& given, const GrownMesh& grown) {
  std::string written;
  try {
    written = grownGlb(bytes, "fuzz.glb", "", given, grown);
  } catch (const InputError&) {
    return;
  }
  const FaceMesh read = parseGlb(written, "grown.glb");  // what was written can be read
  if (read.vertexCount() <= given.vertexCount() || read.triangles.size() <= given.triangles.size()) std::abort();
}

/// Each material shows pictures that there are.
void expectPictures(std::string_view bytes) {
  const SceneTextures textures = sceneTextures(bytes, "fuzz.glb");
  for (const SceneTextures::Material& material : textures.materials) {
    for (const auto& shown : {material.color, material.normal}) {
      if (shown && (shown->picture >= textures.pictures.size() || textures.pictures[shown->picture].bytes.empty()))
        std::abort();
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string_view bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  try {
    expectPictures(bytes);
    const FaceMesh given = parseGlb(bytes, "fuzz.glb");
    if (given.vertexCount() == 0) return 0;
    expectMore(bytes, given, withTooth(given));
    expectMore(bytes, given, cutLips(given, lineThrough(given)));
  } catch (const InputError&) {
  }
  return 0;
}
