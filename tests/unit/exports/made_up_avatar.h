#pragma once

#include <string>

namespace mouthpiece::test {

/// Who names the face's shapes: the mesh, its primitive (UniVRM's way), or the expressions of a VRM alone.
enum class ShapesNamedBy { kMesh, kPrimitive, kExpressions };

/// How a made-up avatar is written.
struct AvatarStyle {
  bool quantised = false;    ///< KHR_mesh_quantization: positions in 16 bits under a node's or bone's scale
  bool sparse = false;       ///< base positions partly in a sparse accessor
  bool meshopt = false;      ///< EXT_meshopt_compression of vertex data and indices
  bool draco = false;        ///< KHR_draco_mesh_compression of the face
  bool shared_lash = false;  ///< both lashes are one mesh, shown by two nodes
  double bind_scale = 1;     ///< of the mesh, taken back in its bind matrices
  int vrm = -1;              ///< 0 or 1; else no VRM
  ShapesNamedBy named = ShapesNamedBy::kMesh;
  bool two_heads = false;  ///< a second person two metres aside
};

/// A person of simple shapes, put together as games have them, as a GLB: a skeleton of hips, head, jaw and eye; a
/// skinned face with a slit for a mouth, own shapes jawOpen and eyeBlinkLeft; an eye on its bone; teeth; a lash; shoes
/// on the hips; a texture in KTX2, an idle animation of bone and weights, an extension nobody knows, extras everywhere.
/// Made by this file alone: nobody else's work is in it.
std::string madeUpAvatar(const AvatarStyle& style = {});

}  // namespace mouthpiece::test
