#include "base/unnamed_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <string>

#include "base/child_process.h"
#include "base/errors.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(int error) {
  throw InputError(temporaryFolder().string(), "", fmt::format("takes no temporary file: {}", std::strerror(error)));
}

int openUnnamed() {
  const fs::path folder = temporaryFolder();
#ifdef O_TMPFILE
  const int without = ::open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, S_IRUSR | S_IWUSR);
  if (without >= 0) return without;  // else a file system that knows no files without a name
#endif
  std::string pattern = fs::absolute(folder / "mouthpiece.").string() + "XXXXXX";
  const int named = ::mkstemp(pattern.data());
  if (named < 0) fail(errno);
  ::unlink(pattern.c_str());
  ::fcntl(named, F_SETFD, FD_CLOEXEC);
  return named;
}

}  // namespace

UnnamedFile::UnnamedFile() : descriptor_(openUnnamed()) {}

UnnamedFile::~UnnamedFile() {
  if (mapped_ != nullptr) ::munmap(mapped_, size_);
  ::close(descriptor_);
}

void UnnamedFile::append(std::span<const std::byte> bytes) {
  MOUTHPIECE_EXPECT(mapped_ == nullptr);
  while (!bytes.empty()) {
    const ssize_t written = ::write(descriptor_, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) fail(errno);
    bytes = bytes.subspan(static_cast<std::size_t>(written));
    size_ += static_cast<std::size_t>(written);
  }
}

std::span<const std::byte> UnnamedFile::bytes() {
  if (size_ == 0) return {};
  if (mapped_ == nullptr) {
    void* const mapped = ::mmap(nullptr, size_, PROT_READ, MAP_SHARED, descriptor_, 0);
    if (mapped == MAP_FAILED) fail(errno);
    mapped_ = mapped;
  }
  return {static_cast<const std::byte*>(mapped_), size_};
}

void UnnamedFile::letGo() const {
  if (mapped_ != nullptr) ::madvise(mapped_, size_, MADV_DONTNEED);
}

}  // namespace mouthpiece
