#include "exports/scenes/scene_textures.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

#include "base/errors.h"
#include "base/files.h"
#include "base/index.h"
#include "base/json_text.h"
#include "deform/mesh/glb_chunks.h"
#include "deform/mesh/mesh_files.h"
#include "deform/mesh/mesh_limits.h"

namespace mouthpiece {
namespace {

using nlohmann::json;
using Wrap = SceneTexture::Wrap;

/// The field of an object, or null where there is none.
const json& field(const json& object, const char* name) {
  static const json kNone;
  if (!object.is_object()) return kNone;
  const auto found = object.find(name);
  return found == object.end() ? kNone : *found;
}

std::optional<std::size_t> wholeOf(const json& number) {
  return number.is_number_unsigned() ? std::optional(number.get<std::size_t>()) : std::nullopt;
}

/// The element of a list, or null where there is none.
const json& element(const json& list, const json& number) {
  static const json kNone;
  const auto at = wholeOf(number);
  return at && list.is_array() && *at < list.size() ? list[*at] : kNone;
}

std::string_view endingOf(std::string_view bytes) {
  if (bytes.starts_with("\x89PNG\r\n\x1A\n")) return "png";
  return bytes.starts_with("\xFF\xD8\xFF") ? "jpg" : "";
}

Wrap wrapOf(const json& sampler, const char* axis) {
  switch (wholeOf(field(sampler, axis)).value_or(0)) {
    case 33'071:
      return Wrap::kClamp;
    case 33'648:
      return Wrap::kMirror;
    default:
      return Wrap::kRepeat;
  }
}

class TexturesOfGlb {
 public:
  TexturesOfGlb(const GlbChunks& chunks, const json& root) : chunks_(chunks), root_(root) {}

  SceneTextures made() && {
    for (const json& material : field(root_, "materials")) {
      SceneTextures::Material& made = made_.materials.emplace_back();
      const json& alpha = field(material, "alphaMode");
      made.alpha = alpha == "MASK"    ? SceneTextures::Material::Alpha::kCutOut
                   : alpha == "BLEND" ? SceneTextures::Material::Alpha::kBlended
                                      : SceneTextures::Material::Alpha::kOpaque;
      if (const json& cut_off = field(material, "alphaCutoff"); cut_off.is_number())
        made.cut_off = std::clamp(cut_off.get<double>(), 0.0, 1.0);
      made.color = textureOf(field(field(material, "pbrMetallicRoughness"), "baseColorTexture"));
      made.normal = textureOf(field(material, "normalTexture"));
    }
    return std::move(made_);
  }

 private:
  std::optional<SceneTexture> textureOf(const json& shown) {
    if (wholeOf(field(shown, "texCoord")).value_or(0) != 0) return std::nullopt;
    if (!field(field(shown, "extensions"), "KHR_texture_transform").is_null()) return std::nullopt;
    const json& texture = element(field(root_, "textures"), field(shown, "index"));
    const auto picture = pictureOf(field(texture, "source"));
    if (!picture) return std::nullopt;
    const json& sampler = element(field(root_, "samplers"), field(texture, "sampler"));
    return SceneTexture{*picture, wrapOf(sampler, "wrapS"), wrapOf(sampler, "wrapT")};
  }

  std::optional<std::size_t> pictureOf(const json& number) {
    const json& image = element(field(root_, "images"), number);
    if (image.is_null()) return std::nullopt;
    const auto [known, is_new] = pictures_.try_emplace(number.get<std::size_t>());
    if (!is_new) return known->second;
    const json& view = element(field(root_, "bufferViews"), field(image, "bufferView"));
    const std::size_t offset = wholeOf(field(view, "byteOffset")).value_or(0),
                      length = wholeOf(field(view, "byteLength")).value_or(0), room = chunks_.binary.size();
    if (length == 0 || offset > room || length > room - offset) return std::nullopt;
    const std::string_view bytes = chunks_.binary.substr(offset, length);
    const std::string_view ending = endingOf(bytes);
    if (ending.empty()) return std::nullopt;
    known->second = made_.pictures.size();
    made_.pictures.push_back({fmt::format("texture_{}.{}", made_.pictures.size(), ending), std::string(bytes)});
    return known->second;
  }

  const GlbChunks& chunks_;
  const json& root_;
  SceneTextures made_;
  std::map<std::size_t, std::optional<std::size_t>> pictures_;  ///< by the image's number
};

}  // namespace

SceneTextures::Material SceneTextures::of(int material) const {
  return material >= 0 && unsignedIndex(material) < materials.size() ? materials[unsignedIndex(material)] : Material();
}

SceneTextures sceneTextures(std::string_view glb, std::string_view file) {
  const GlbChunks chunks = glbChunks(glb, file);
  const json root = looseJson(chunks.json);
  if (root.is_discarded()) throw InputError(file, "", "has JSON that is damaged");
  return TexturesOfGlb(chunks, root).made();
}

SceneTextures sceneTexturesOf(const std::filesystem::path& mesh) {
  return isGlb(mesh) ? sceneTextures(readFile(mesh, kMaxMeshBytes), mesh.string()) : SceneTextures();
}

}  // namespace mouthpiece
