#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace mouthpiece {

/// A GLB's two chunks: all of its JSON, whatever extensions it holds, and a view of its binary data.
struct GlbChunks {
  nlohmann::json root;
  std::string_view binary;
};
/// Takes a GLB apart. Throws InputError that begins with `file` for a damaged frame, for no JSON object, and for JSON
/// nested deeper than any tool writes it.
GlbChunks glbChunks(std::string_view glb, std::string_view file);

/// Puts the chunks together; `binary` is taken, and its memory used for the file where there is room.
std::string glbOf(const nlohmann::json& root, std::string binary);

/// `glb` without EXT_meshopt_compression and KHR_draco_mesh_compression: the same accessors over plain data in one
/// buffer. Empty where neither is there. Throws InputError for what cannot be decoded.
std::string unpackedGlb(std::string_view glb, std::string_view file);

}  // namespace mouthpiece
