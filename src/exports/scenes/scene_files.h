#pragma once

#include <span>
#include <string>
#include <string_view>

#include "exports/scenes/scene_textures.h"
#include "exports/shapes/principal_shapes.h"

// The moving face as a scene of another program: one mesh with blend shapes and a key of each a frame.
namespace mouthpiece {

struct FaceMesh;

/// Autodesk FBX 7.4, binary: centimetres, Y up. A material for each part, its pictures inside. `shape_names`: one a
/// shape; none: shape_00 and so on. No frames, no animation.
std::string fbxBytes(const FaceMesh& mesh, const PrincipalShapes& shapes, std::string_view name,
                     const SceneTextures& textures = {}, std::span<const std::string> shape_names = {});

/// USD as text (UsdSkel): metres, Y up. A file alone: materials have colours and no pictures.
std::string usdaText(const FaceMesh& mesh, const PrincipalShapes& shapes, std::string_view name,
                     std::span<const std::string> shape_names = {});
/// The same with its pictures (USDZ: an archive).
std::string usdzBytes(const FaceMesh& mesh, const PrincipalShapes& shapes, std::string_view name,
                      const SceneTextures& textures = {}, std::span<const std::string> shape_names = {});

}  // namespace mouthpiece
