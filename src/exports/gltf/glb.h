#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "exports/shapes/principal_shapes.h"

namespace mouthpiece {

struct FaceMesh;

/// glTF 2.0, binary (docs/formats/glb.md): one mesh with a primitive for each part that has triangles, a morph target
/// (positions and normals, sparse) for each shape and one linear weights animation; metres. `name` is the node's and
/// the mesh's. `shapes` must come from an animation of `mesh`.
std::string glbBytes(const FaceMesh& mesh, const PrincipalShapes& shapes, std::string_view name);

/// `glb`, the file that a mesh was read from, with `shapes` as the morph targets of its primitives and one weights
/// animation in the place of those it had; materials, textures, texture coordinates, skins and nodes stay. `shapes` are
/// of the mesh that parseFaceMesh gives for it, turned by `upright_from_mesh`. nullopt when that cannot be said in
/// glTF: a mesh that two nodes show would move in both. Throws InputError that begins with `file`.
std::optional<std::string> glbWithShapes(std::string_view glb, const std::string& file, const PrincipalShapes& shapes,
                                         const Eigen::Matrix3d& upright_from_mesh);

/// `glb` with one weights animation, "speech", in the place of those it had: the morph target called `name` follows
/// column `column_of(name)` of `weights` (frames x anything), or rests where that is -1. Everything else stays. nullopt
/// when no target follows a column. Throws InputError that begins with `file`.
std::optional<std::string> glbWithWeights(std::string_view glb, const std::string& file, double frame_rate_hz,
                                          const RowMajorMatrixF& weights,
                                          const std::function<int(std::string_view)>& column_of);

}  // namespace mouthpiece
