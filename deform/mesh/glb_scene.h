#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "deform/mesh/bone_roles.h"
#include "deform/mesh/triangles.h"

namespace mouthpiece {

/// Vertices of a FaceMesh that come from one list of positions in its GLB, shown by one node.
struct GlbRun {
  int node = -1;  ///< -1: the file has no scene
  int mesh = 0;
  std::vector<std::size_t> primitives;  ///< of the mesh: those over these positions
  std::size_t first_vertex = 0;         ///< of the FaceMesh
  std::size_t count = 0;
  /// Takes a move in the mesh's own space to the scene's, as node or skin show it: one for all, or one a vertex.
  std::vector<Eigen::Matrix3f> scene_from_mesh;

  [[nodiscard]] const Eigen::Matrix3f& sceneFromMesh(std::size_t vertex) const {
    return scene_from_mesh[scene_from_mesh.size() == 1 ? 0 : vertex];
  }
};

/// Where the vertices of parseFaceMesh(glb) come from, in their order. `object`: as parseFaceMesh takes it. Throws
/// InputError as parseFaceMesh does.
std::vector<GlbRun> glbRuns(std::string_view glb, std::string_view file, std::string_view object = {});

/// Bones and empties of a GLB's scene, and what of the mesh they carry.
struct GlbBones {
  struct Node {
    std::string name;
    int parent = -1;                                  ///< its place in `nodes`; -1: none
    Eigen::Vector3d place = Eigen::Vector3d::Zero();  ///< at rest, in the scene
    BoneRole role = BoneRole::kUnknown;               ///< its own, or of what it hangs on
  };
  std::vector<Node> nodes;
  /// Of each vertex of the FaceMesh: what carries most of it, and the share of it that bones of the jaw carry.
  std::vector<BoneRole> roles;
  std::vector<float> jaw_share;
};
/// Those of parseFaceMesh(glb)'s scene, its vertices in their order. Throws InputError likewise.
GlbBones glbBones(std::string_view glb, std::string_view file, std::string_view object = {});

/// What the shapes of each mesh of a GLB are called, target by target (shapeNames()). Throws InputError likewise.
std::vector<std::vector<std::string>> glbShapeNames(std::string_view glb, std::string_view file);

/// The picture that colours a material, as the file holds it.
struct GlbPicture {
  std::string mime;   ///< "image/png", "image/jpeg", "image/webp", or "image/ktx2", which no browser shows
  std::string bytes;  ///< empty for KTX2
};
/// Base colour pictures by the number of the material; those kept outside the file, or in formats unknown here, are
/// left out. Throws InputError likewise.
std::map<int, GlbPicture> glbPictures(std::string_view glb, std::string_view file);

/// What some scalar accessors of a GLB hold, as numbers. Throws InputError likewise.
std::vector<std::vector<float>> glbScalars(std::string_view glb, std::string_view file,
                                           const std::vector<std::size_t>& accessors);

}  // namespace mouthpiece
