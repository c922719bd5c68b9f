#pragma once

#include <cstddef>
#include <span>

namespace mouthpiece {

/// Bytes in a file of the system's temporary folder that has no name, so that nothing of it stays behind, whatever ends
/// the process. They are mapped: they take memory once they are looked at, until they are let go.
class UnnamedFile {
 public:
  /// Throws InputError where the folder takes no file.
  UnnamedFile();
  UnnamedFile(const UnnamedFile&) = delete;
  UnnamedFile& operator=(const UnnamedFile&) = delete;
  ~UnnamedFile();

  /// Throws InputError where they cannot be written: a full disk. Not after bytes().
  void append(std::span<const std::byte> bytes);
  /// All that was appended, for as long as this lives, from a page's start on. Throws InputError where they cannot be
  /// mapped.
  std::span<const std::byte> bytes();
  /// What was looked at takes no memory until it is looked at again.
  void letGo() const;

 private:
  int descriptor_;
  std::size_t size_ = 0;
  void* mapped_ = nullptr;
};

}  // namespace mouthpiece
