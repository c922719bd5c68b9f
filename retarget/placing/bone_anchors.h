#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "deform/mesh/triangles.h"

namespace mouthpiece {

struct FaceMesh;
struct GlbBones;

/// What a head's skeleton, and other named nodes of its file, tell of where its features are.
struct BoneAnchors {
  /// Of the ten suggested anchors (face_page.h) those that a node is called by, in any case, with a number behind or
  /// not ("lip_corner_r.001"), where it stands.
  std::map<std::string, Eigen::Vector3d> named;
  /// Those that bones of a face rig stand at (docs/theory/face_finder/bones.md has their names), on the nearest skin.
  std::map<std::string, Eigen::Vector3d> face_bones;
  /// What the jaw's bones do to each vertex, turned about their joint to open the mouth; no rows without such bones.
  VertexPositions jaw_open;
  /// Vertices that head, jaw and eyes carry, without hair; empty where no head can be told.
  std::vector<std::uint32_t> head;
};

/// `mesh` and `bones` of the same file; Y up, looking along +Z or -Z.
BoneAnchors anchorsFromBones(const FaceMesh& mesh, const GlbBones& bones);

}  // namespace mouthpiece
