#pragma once

#include <Eigen/Core>
#include <array>
#include <map>
#include <string>
#include <vector>

#include "deform/mesh/face_mesh.h"

namespace mouthpiece::test {

/// A bone or an empty of a made-up scene.
struct MadeUpNode {
  std::string name;
  Eigen::Vector3d place;  ///< in the scene
  int parent = -1;        ///< its place in the list, before it; -1: the scene
  bool is_joint = true;
};

/// A mesh on a skeleton. Joints come first in `nodes`, so that a node's number is its joint's.
struct SkinnedHead {
  FaceMesh mesh;
  std::vector<MadeUpNode> nodes;
  std::vector<std::array<int, 2>> carriers;  ///< of each vertex: what carries a share of it, and what the rest
  std::vector<float> shares;
  std::string vrm;                         ///< the extension that lists human bones: "VRM", "VRMC_vrm"; "": none
  std::map<std::string, int> human_bones;  ///< nodes by VRM's names of them
};
/// As a GLB.
std::string skinnedGlb(const SkinnedHead& head);

}  // namespace mouthpiece::test
