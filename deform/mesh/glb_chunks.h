#pragma once

#include <string>
#include <string_view>

namespace mouthpiece {

/// Views of a GLB's two chunks: all of its JSON, whatever extensions it holds, and its binary data.
struct GlbChunks {
  std::string_view json, binary;
};
/// Takes a GLB apart. Throws InputError that begins with `file` for a damaged frame, and for JSON nested deeper
/// than any tool writes it; the JSON itself is not read.
GlbChunks glbChunks(std::string_view glb, std::string_view file);

/// Puts the chunks together; `binary` is taken, and its memory used for the file where there is room.
std::string glbOf(std::string json, std::string binary);

/// `glb` without EXT_meshopt_compression and KHR_draco_mesh_compression: the same accessors over plain data in one
/// buffer. Empty where neither is there. Throws InputError for what cannot be decoded.
std::string unpackedGlb(std::string_view glb, std::string_view file);
/// The same where it uses Draco, whose reader in three.js needs a worker that our pages forbid; else `glb` as it is.
std::string withoutDraco(std::string glb, std::string_view file);

}  // namespace mouthpiece
