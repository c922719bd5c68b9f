// The frame around a GLB's chunks.
#include "deform/mesh/glb_chunks.h"

#include <fmt/format.h>
#include <tiny_gltf.h>

#include <cstdint>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "base/errors.h"
#include "base/json_text.h"
#include "deform/mesh/glb_scene.h"

namespace mouthpiece {
namespace {

constexpr int kDeepestJson = 96;
constexpr std::size_t kHeaderBytes = 12, kChunkHeaderBytes = 8;

std::uint32_t wordAt(std::string_view bytes, std::size_t offset) {
  std::uint32_t word = 0;
  std::memcpy(&word, bytes.data() + offset, sizeof word);
  return word;
}

void appendWord(std::string& bytes, std::size_t word) {
  MOUTHPIECE_EXPECT(word <= std::numeric_limits<std::uint32_t>::max());
  for (int shift = 0; shift < 32; shift += 8) bytes.push_back(static_cast<char>(word >> shift));
}

/// Whether brackets outside of text are nested deeper than `limit`: what walks the tree later calls itself.
bool isDeeperThan(std::string_view json, int limit) {
  int depth = 0;
  bool in_text = false;
  for (std::size_t i = 0; i < json.size(); ++i) {
    if (in_text && json[i] == '\\')
      ++i;
    else if (json[i] == '"')
      in_text = !in_text;
    else if (!in_text && (json[i] == '{' || json[i] == '[') && ++depth > limit)
      return true;
    else if (!in_text && (json[i] == '}' || json[i] == ']'))
      --depth;
  }
  return false;
}

/// The number of the image that a page shows of a texture: what any reader knows, before what an extension brings.
const nlohmann::json& sourceOf(const nlohmann::json& texture) {
  if (texture.contains("source")) return texture["source"];
  const nlohmann::json& extensions = texture.at("extensions");
  const char* const kExtension = extensions.contains("EXT_texture_webp") ? "EXT_texture_webp" : "KHR_texture_basisu";
  return extensions.at(kExtension).at("source");
}

/// A picture whose address is a data URI, its kind with it; empty where it is none.
GlbPicture pictureIn(std::string_view uri) {
  constexpr std::string_view kBegin = "data:", kCoding = ";base64,";
  const std::size_t coding = uri.find(kCoding);
  if (!uri.starts_with(kBegin) || coding == std::string_view::npos) return {};
  // The library knows fewer kinds of pictures than browsers do.
  const std::string bytes = "data:application/octet-stream" + std::string(uri.substr(coding));
  std::vector<unsigned char> picture;
  std::string of_library;
  tinygltf::DecodeDataURI(&picture, of_library, bytes, 0, false);
  return {std::string(uri.substr(kBegin.size(), coding - kBegin.size())), {picture.begin(), picture.end()}};
}

bool isShownByBrowsers(const std::string& mime) {
  return mime == "image/png" || mime == "image/jpeg" || mime == "image/webp";
}

}  // namespace

GlbChunks glbChunks(std::string_view glb, std::string_view file) {
  const auto fail = [&](std::string_view what) { throw InputError(std::string(file), "", what); };
  if (glb.size() < kHeaderBytes + kChunkHeaderBytes || !glb.starts_with("glTF"))
    fail("found no 'glTF' at the start; expected a GLB file");
  if (glb.size() > std::numeric_limits<std::uint32_t>::max()) fail("is larger than 4 GB");
  if (wordAt(glb, 4) != 2) fail(fmt::format("found glTF version {}; expected 2", wordAt(glb, 4)));
  if (wordAt(glb, 8) > glb.size())
    fail(fmt::format("is {} bytes long; its header says {}", glb.size(), wordAt(glb, 8)));
  glb = glb.substr(0, wordAt(glb, 8));
  const std::string_view kJson = "JSON", kBinary("BIN\0", 4);
  const std::size_t json_bytes = wordAt(glb, kHeaderBytes);
  const std::size_t json_at = kHeaderBytes + kChunkHeaderBytes;
  if (glb.size() < json_at || glb.substr(kHeaderBytes + 4, 4) != kJson || json_bytes > glb.size() - json_at)
    fail("is no GLB that can be read: found no whole JSON chunk");
  const std::string_view json = glb.substr(json_at, json_bytes);
  if (isDeeperThan(json, kDeepestJson)) fail(fmt::format("holds JSON nested deeper than {} levels", kDeepestJson));
  GlbChunks chunks;
  chunks.json = json;
  const std::string_view rest = glb.substr(json_at + json_bytes);
  if (rest.size() < kChunkHeaderBytes) return chunks;
  if (rest.substr(4, 4) != kBinary) return chunks;  // a chunk of another kind is to be passed over
  if (wordAt(rest, 0) > rest.size() - kChunkHeaderBytes) fail("is no GLB that can be read: its data is cut off");
  chunks.binary = rest.substr(kChunkHeaderBytes, wordAt(rest, 0));
  return chunks;
}

std::string glbOf(std::string json, std::string binary) {
  binary.append((4 - binary.size() % 4) % 4, '\0');
  json.append((4 - json.size() % 4) % 4, ' ');
  const std::size_t data_bytes = binary.empty() ? 0 : kChunkHeaderBytes + binary.size();
  std::string head = "glTF";
  appendWord(head, 2);
  appendWord(head, kHeaderBytes + kChunkHeaderBytes + json.size() + data_bytes);
  appendWord(head, json.size());
  head.append("JSON").append(json);
  if (binary.empty()) return head;
  appendWord(head, binary.size());
  head.append("BIN\0", 4);
  binary.insert(0, head);  // in place where there is room: of a long line a copy would be the largest of all
  return binary;
}

std::map<int, GlbPicture> glbPictures(std::string_view glb, std::string_view file) {
  const GlbChunks chunks = glbChunks(glb, file);
  const nlohmann::json root = looseJson(chunks.json);
  std::map<int, GlbPicture> pictures;
  if (!root.is_object()) return pictures;
  const auto at = [&](const char* list, const nlohmann::json& number) -> const nlohmann::json& {
    return root.at(list).at(number.get<std::size_t>());
  };
  const nlohmann::json none = nlohmann::json::array();
  const nlohmann::json& materials = root.contains("materials") ? root["materials"] : none;
  for (std::size_t m = 0; m < materials.size(); ++m) {
    try {
      const nlohmann::json& texture =
          at("textures", materials[m].at("pbrMetallicRoughness").at("baseColorTexture").at("index"));
      const nlohmann::json& image = at("images", sourceOf(texture));
      if (const auto uri = image.find("uri"); uri != image.end() && uri->is_string()) {
        GlbPicture picture = pictureIn(uri->get_ref<const std::string&>());
        if (picture.mime == "image/ktx2") picture.bytes.clear();
        if (picture.mime == "image/ktx2" || (isShownByBrowsers(picture.mime) && !picture.bytes.empty()))
          pictures[static_cast<int>(m)] = std::move(picture);
        continue;
      }
      const std::string mime = image.value("mimeType", "");
      if (mime == "image/ktx2") pictures[static_cast<int>(m)].mime = mime;
      if (!isShownByBrowsers(mime)) continue;
      const nlohmann::json& view = at("bufferViews", image.at("bufferView"));
      const std::size_t begin = view.value("byteOffset", std::size_t{0}),
                        length = view.at("byteLength").get<std::size_t>();
      if (view.value("buffer", 0) != 0 || begin > chunks.binary.size() || length > chunks.binary.size() - begin)
        continue;
      pictures[static_cast<int>(m)] = {mime, std::string(chunks.binary.substr(begin, length))};
    } catch (const nlohmann::json::exception&) {
      continue;  // a material without a picture of its own
    }
  }
  return pictures;
}

}  // namespace mouthpiece
