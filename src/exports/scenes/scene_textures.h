#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace mouthpiece {

/// A picture as a head's file holds it, and how it goes on beyond its edges.
struct ScenePicture {
  std::string name;   ///< "texture_0.png", "texture_1.jpg"
  std::string bytes;  ///< of a PNG or JPEG, unopened
};

/// A picture on a surface.
struct SceneTexture {
  std::size_t picture = 0;  ///< of SceneTextures::pictures
  enum class Wrap { kRepeat, kClamp, kMirror } u{}, v{};
};

/// What a head's materials show besides their colours.
struct SceneTextures {
  struct Material {
    std::optional<SceneTexture> color;                        ///< multiplies the part's base colour
    std::optional<SceneTexture> normal;                       ///< of the surface, Y up
    enum class Alpha { kOpaque, kCutOut, kBlended } alpha{};  ///< of the colour's picture
    double cut_off = 0.5;
  };
  std::vector<ScenePicture> pictures;
  std::vector<Material> materials;  ///< by MeshPart::material

  /// Of a part's material; nothing where it shows no picture.
  [[nodiscard]] Material of(int material) const;
};

/// Those of a GLB. Left out is what FBX and USD have no place for: WebP and KTX2 (a PNG or JPEG beside one is taken),
/// pictures outside of the file, further sets of texture coordinates and turned ones. Throws InputError that begins
/// with `file` for a damaged file.
SceneTextures sceneTextures(std::string_view glb, std::string_view file);
/// Those of the file that a head was read from; none where it is no GLB.
SceneTextures sceneTexturesOf(const std::filesystem::path& mesh);

}  // namespace mouthpiece
