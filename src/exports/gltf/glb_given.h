#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <string_view>

#include "exports/shapes/principal_shapes.h"

namespace mouthpiece {

/// `glb`, the file that a mesh was read from, with `shapes` as the morph targets of its primitives and one weights
/// animation in the place of those it had; materials, textures, texture coordinates, skins and nodes stay. `shapes` are
/// of the mesh that parseFaceMesh gives for it, turned by `upright_from_mesh`. nullopt when that cannot be said in
/// glTF: a mesh that two nodes show would move in both. Throws InputError that begins with `file`.
std::optional<std::string> glbWithShapes(std::string_view glb, const std::string& file, const PrincipalShapes& shapes,
                                         const Eigen::Matrix3d& upright_from_mesh);

}  // namespace mouthpiece
