#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

namespace mouthpiece {

/// The whole file as bytes. Throws InputError when it cannot be read, is a folder, or is larger than
/// `max_bytes` (checked before anything is allocated).
std::string readFile(const std::filesystem::path& path, std::uint64_t max_bytes = std::uint64_t{1} << 31);

/// Writes under a temporary name in the same folder, flushes to disk, then renames over `path`; on any
/// failure (full disk, no permission) the old file is untouched, the temporary one removed, and
/// InputError names the file and the reason. Makes missing parent folders.
void writeFileAtomically(const std::filesystem::path& path, std::string_view bytes);

/// The same for a writer that needs a path (SQLite, libsndfile): `write` fills the temporary file.
void writeFileAtomically(const std::filesystem::path& path,
                         const std::function<void(const std::filesystem::path&)>& write);

/// SHA-256 of `bytes`, lower-case hexadecimal.
std::string sha256Hex(std::string_view bytes);

}  // namespace mouthpiece
