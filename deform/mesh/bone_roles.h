#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace tinygltf {
class Model;
}

namespace mouthpiece {

/// What a vertex hangs on, told by the bones of a skin or the node that holds it.
enum class BoneRole : std::uint8_t { kUnknown, kBody, kHead, kJaw, kEye, kHair };

/// What each node of a skeleton carries: VRM's list of human bones, else the bones' names and what hangs on the head.
/// Nodes that are no joint of a skin and hang on none are kUnknown, as all are where no head can be told.
std::vector<BoneRole> boneRoles(const tinygltf::Model& model, const std::vector<int>& parents);

/// What the shapes of each mesh are called, target by target: as its own extras.targetNames say, else those of its
/// first primitive (UniVRM's way), else by number. One whose name tells neither mouth nor lids is called by the
/// expression of a VRM (blink, aa ...) that binds it and no other of the mesh.
std::vector<std::vector<std::string>> shapeNames(const tinygltf::Model& model);

/// Whether a shape of this name moves the mouth: ARKit's, visemes of Oculus, VRM, VRoid, Character Creator.
bool isMouthShape(std::string_view name);
/// Whether it opens the jaw.
bool isJawShape(std::string_view name);

}  // namespace mouthpiece
