#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

namespace mouthpiece {

/// The whole file as bytes. Throws InputError when it cannot be read, is a folder, or is larger than
/// `max_bytes` (checked before anything is allocated).
std::string readFile(const std::filesystem::path& path, std::uint64_t max_bytes = std::uint64_t{1} << 31);

/// Writes under a temporary name in the same folder that nobody can foresee, flushes to disk, then renames over `path`;
/// on any failure (full disk, no permission) the old file is untouched, the temporary one removed, and InputError names
/// the file and the reason. Makes missing parent folders, and removes what killed processes left of the same file. A
/// new file has the mode of the one that it replaces, a write-protected one is refused, and a link is replaced itself.
void writeFileAtomically(const std::filesystem::path& path, std::string_view bytes);

/// The same for a writer that needs a path (SQLite, libsndfile): `write` fills the temporary file.
void writeFileAtomically(const std::filesystem::path& path,
                         const std::function<void(const std::filesystem::path&)>& write);

/// Files that appear together: while one lives, what its thread and those that join it write atomically waits
/// under its temporary names, and commit() renames all of it, in the order of writing. Without commit() nothing was
/// written. For tens of files, each of which stays open; those of a set within a set wait for the outer one.
class FilesTogether {
 public:
  FilesTogether();
  FilesTogether(const FilesTogether&) = delete;
  FilesTogether& operator=(const FilesTogether&) = delete;
  ~FilesTogether();
  /// Throws InputError when a file cannot take its name; those that stood under the others' names stand there again
  /// (unless the file system has no hard links).
  void commit();

  /// While one lives, its thread writes into `set`.
  class Joined {
   public:
    explicit Joined(FilesTogether& set);
    Joined(const Joined&) = delete;
    Joined& operator=(const Joined&) = delete;
    ~Joined();

   private:
    FilesTogether* before_;
  };

 private:
  struct Waiting;
  friend void writeFileAtomically(const std::filesystem::path& path,
                                  const std::function<void(const std::filesystem::path&)>& write);
  FilesTogether* outer_;
  std::mutex mutex_;  ///< of waiting_
  std::vector<std::unique_ptr<Waiting>> waiting_;
};

/// SHA-256 of `bytes`, lower-case hexadecimal.
std::string sha256Hex(std::string_view bytes);

}  // namespace mouthpiece
