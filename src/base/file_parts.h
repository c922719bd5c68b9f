#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>

namespace mouthpiece {

/// Takes the next bytes of a file.
using AppendBytes = std::function<void(std::string_view)>;
/// writeFileAtomically() for a file whose bytes come one part after the other.
void writeFileInParts(const std::filesystem::path& path, const std::function<void(const AppendBytes&)>& write);

/// Reads bytes from a place on and says how many there were: fewer than asked for where no more can be read.
using ReadBytes = std::function<std::size_t(std::uint64_t at, std::span<char> to)>;
/// A file of which some bytes are read at a time. Throws InputError as readFile() does when it cannot be opened.
class FileReader {
 public:
  explicit FileReader(const std::filesystem::path& path, std::uint64_t max_bytes = std::uint64_t{1} << 31);
  FileReader(const FileReader&) = delete;
  FileReader& operator=(const FileReader&) = delete;
  ~FileReader();
  [[nodiscard]] std::uint64_t size() const { return size_; }
  /// What ReadBytes promises; errno says why there were fewer before the end.
  std::size_t read(std::uint64_t at, std::span<char> to) const;
  /// At most `count` bytes from `at` on, fewer at the end. Throws InputError where they cannot be read.
  [[nodiscard]] std::string bytes(std::uint64_t at, std::uint64_t count) const;

 private:
  std::filesystem::path path_;
  int descriptor_;
  std::uint64_t size_ = 0;
};

}  // namespace mouthpiece
