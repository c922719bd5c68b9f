#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "exports/shapes/principal_shapes.h"

namespace mouthpiece {

struct FaceMesh;

/// How a head turns: a quaternion (x y z w) a frame, about a place in metres.
struct HeadAnimation {
  std::vector<std::array<float, 4>> rotations;
  std::array<double, 3> pivot_m{};
};

/// glTF 2.0, binary (docs/formats/glb.md): one mesh with a primitive for each part that has triangles, a morph target
/// (positions and normals, sparse) for each shape and one linear weights animation; metres. `name` is the node's and
/// the mesh's. `shapes` must come from an animation of `mesh`; without frames there is no animation. `shape_names`: one
/// a shape; none: shape_00 and so on. `head`: null where it is still. `normals`: shapeNormals() of the two; null: they
/// are made.
std::string glbBytes(const FaceMesh& mesh, const PrincipalShapes& shapes, std::string_view name,
                     std::span<const std::string> shape_names = {}, const HeadAnimation* head = nullptr,
                     const ShapeNormals* normals = nullptr);
/// The same in a fifth of the room, for programs that know EXT_meshopt_compression (three.js, Babylon.js, Godot's and
/// Unity's add-ons; not Blender 3.4): places to 8 micrometres, normals to 0.5 degrees.
std::string smallGlbBytes(const FaceMesh& mesh, const PrincipalShapes& shapes, std::string_view name,
                          const HeadAnimation* head = nullptr, const ShapeNormals* normals = nullptr);

/// Weights that some of a head's own morph targets follow: the one called `name` column `column_of(name)` of `weights`
/// (frames x anything), or none where that is -1.
struct OwnShapeWeights {
  RowMajorMatrixF weights;
  std::function<int(std::string_view)> column_of;
};

/// `glb`, the file that a mesh was read from, with `shapes` as further morph targets, speech_00 and so on, of the
/// meshes that they move, and a weights animation "speech" after those that it has; an earlier run's give way.
/// Everything else stays as it was, what no tool here knows included. `shapes` are of the mesh that parseFaceMesh gives
/// for `object`, turned by `upright_from_mesh`. `own`: what the head's own targets do meanwhile; null: they rest.
/// `shape_names`: what the targets are called instead, one a shape; these stay, and nothing is animated. A name that
/// the head's targets have already stays theirs; a shape that moves no vertex rests beside the others. nullopt when
/// there is nothing to add to: no scene, no data in the file, no shape. Throws InputError that begins with `file`.
std::optional<std::string> glbWithShapes(std::string_view glb, const std::string& file, const PrincipalShapes& shapes,
                                         const Eigen::Matrix3d& upright_from_mesh, std::string_view object = {},
                                         const OwnShapeWeights* own = nullptr,
                                         std::span<const std::string> shape_names = {});

/// `glb` with a weights animation "speech" of its own morph targets after the animations that it has, in the place of
/// an earlier run's. Everything else stays, with it what `object`, as parseFaceMesh takes it, does not show. nullopt
/// when no target follows a column. Throws InputError that begins with `file`.
std::optional<std::string> glbWithWeights(std::string_view glb, const std::string& file, double frame_rate_hz,
                                          const OwnShapeWeights& own, std::string_view object = {});

}  // namespace mouthpiece
