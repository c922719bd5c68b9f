#include "base/files.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <openssl/evp.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <optional>
#include <random>
#include <span>
#include <utility>

#include "base/errors.h"
#include "base/file_parts.h"
#include "base/index.h"
#include "base/text_encoding.h"
#include "base/unfinished.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kTemporarySuffix = ".tmp";

[[noreturn]] void failWriting(const fs::path& path, int error) {
  throw InputError(path.string(), "", fmt::format("cannot be written: {}", std::strerror(error)));
}

/// The mode of the file that would be replaced; nothing where none is, or a link: where that leads says nothing of it.
/// Throws InputError for one that is write-protected, from root, too.
std::optional<mode_t> modeOfReplaced(const fs::path& path) {
  struct stat facts {};
  if (::lstat(path.c_str(), &facts) != 0 || !S_ISREG(facts.st_mode)) return std::nullopt;
  const bool is_kept = facts.st_uid == ::geteuid() && ::access(path.c_str(), W_OK) != 0;
  if ((facts.st_mode & (S_IWUSR | S_IWGRP | S_IWOTH)) == 0 || is_kept)
    throw InputError(path.string(), "", "is write-protected; expected a file to write");
  return facts.st_mode & (S_IRWXU | S_IRWXG | S_IRWXO);
}

/// An empty file of an unforeseeable name beside `final_path` and nobody else's, to be read by those who may read what
/// is there; it is removed unless it was renamed.
class TemporaryFile {
 public:
  explicit TemporaryFile(const fs::path& final_path) : mode_(modeOfReplaced(final_path)) {
    const std::string prefix = "." + final_path.filename().string() + ".";
    sweepLeftovers(final_path.parent_path(), prefix, std::string(kTemporarySuffix), LeftoverKind::kFile);
    unfinished_.emplace([&] { return make(final_path, prefix); });
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  ~TemporaryFile() {
    std::error_code ignored;
    if (!renamed_) fs::remove(path_, ignored);
  }
  [[nodiscard]] const fs::path& path() const { return path_; }
  void renameTo(const fs::path& final_path) {
    std::error_code error;
    fs::rename(path_, final_path, error);
    if (error) failWriting(final_path, error.value());
    renamed_ = true;
  }

 private:
  /// Once the file is there nothing that could fail is left to do.
  fs::path make(const fs::path& final_path, const std::string& prefix) {
    constexpr int kTries = 100;
    std::random_device random;  // the system's own source: not to be foreseen
    for (int tries = 0; tries < kTries; ++tries) {
      path_ = final_path.parent_path() / fmt::format("{}{:08x}{:08x}{}", prefix, random(), random(), kTemporarySuffix);
      fs::path noted = fs::absolute(path_);
      const int descriptor = ::open(path_.c_str(), O_RDWR | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666);
      if (descriptor >= 0) {
        lock_.emplace(descriptor);
        // File systems without modes refuse; there is nothing to keep then.
        if (mode_) static_cast<void>(::fchmod(descriptor, *mode_ | S_IRUSR | S_IWUSR));
        return noted;
      }
      if (errno != EEXIST) failWriting(final_path, errno);
    }
    failWriting(final_path, EEXIST);
  }

  fs::path path_;
  std::optional<mode_t> mode_;
  std::optional<FileLock> lock_;
  std::optional<Unfinished> unfinished_;
  bool renamed_ = false;
};

/// Keeps the file that stands under a name, under a second one, until it is known whether it will be replaced. Where a
/// file system has no second names it cannot be put back.
class EarlierFile {
 public:
  explicit EarlierFile(const fs::path& path) : path_(path), kept_(path) {
    std::error_code ignored;
    was_there_ = fs::exists(fs::symlink_status(path, ignored));
    fs::remove(kept_.path(), ignored);
    if (was_there_) fs::create_hard_link(path, kept_.path(), ignored);
  }
  void putBack() noexcept {
    std::error_code ignored;
    if (!was_there_) {
      fs::remove(path_, ignored);
    } else {
      fs::rename(kept_.path(), path_, ignored);
    }
  }

 private:
  fs::path path_;
  TemporaryFile kept_;
  bool was_there_ = false;
};

void flushToDisk(const fs::path& path, const fs::path& named_in_errors) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) failWriting(named_in_errors, errno);
  const int result = ::fsync(descriptor);
  const int error = errno;
  ::close(descriptor);
  if (result != 0) failWriting(named_in_errors, error);
}

/// A file that is written; what goes wrong is told of the name that it will have.
class OpenFile {
 public:
  OpenFile(const fs::path& path, const fs::path& named_in_errors)
      : named_(named_in_errors), descriptor_(::open(path.c_str(), O_WRONLY | O_NOFOLLOW | O_CLOEXEC)) {
    if (descriptor_ < 0) failWriting(named_, errno);
  }
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;
  ~OpenFile() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }
  void append(std::string_view bytes) const {
    while (!bytes.empty()) {
      const ssize_t written = ::write(descriptor_, bytes.data(), bytes.size());
      if (written < 0 && errno == EINTR) continue;
      if (written <= 0) failWriting(named_, written == 0 ? EIO : errno);
      bytes.remove_prefix(unsignedIndex(written));
    }
  }
  /// Some file systems tell only then that a disk is full.
  void close() {
    if (::close(std::exchange(descriptor_, -1)) != 0) failWriting(named_, errno);
  }

 private:
  const fs::path& named_;
  int descriptor_;
};

thread_local FilesTogether* open_set = nullptr;

}  // namespace

struct FilesTogether::Waiting {
  explicit Waiting(const fs::path& path) : file(path), final_path(path) {}
  TemporaryFile file;
  fs::path final_path;
  std::optional<EarlierFile> earlier;
};

FilesTogether::FilesTogether() : outer_(open_set) { open_set = this; }
FilesTogether::~FilesTogether() { open_set = outer_; }
FilesTogether::Joined::Joined(FilesTogether& set) : before_(std::exchange(open_set, &set)) {}
FilesTogether::Joined::~Joined() { open_set = before_; }

void FilesTogether::commit() {
  if (outer_ != nullptr) {
    for (std::unique_ptr<Waiting>& waiting : waiting_) outer_->waiting_.push_back(std::move(waiting));
    waiting_.clear();
    return;
  }
  if (waiting_.size() > 1) {
    for (const std::unique_ptr<Waiting>& waiting : waiting_) waiting->earlier.emplace(waiting->final_path);
  }
  std::size_t done = 0;
  try {
    for (; done < waiting_.size(); ++done) waiting_[done]->file.renameTo(waiting_[done]->final_path);
  } catch (...) {
    while (done > 0) waiting_[--done]->earlier->putBack();
    throw;
  }
  waiting_.clear();
}

FileReader::FileReader(const fs::path& path, std::uint64_t max_bytes) : path_(path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (!fs::exists(status)) throw InputError(path.string(), "", "no such file");
  if (!fs::is_regular_file(status)) throw InputError(path.string(), "", "is no regular file");
  size_ = fs::file_size(path, error);
  if (error) throw InputError(path.string(), "", fmt::format("cannot be read: {}", error.message()));
  if (size_ > max_bytes) {
    std::string begins(64, '\0');
    std::ifstream(path, std::ios::binary).read(begins.data(), std::ssize(begins));
    const std::string_view kind = kindOfNoText(begins);
    throw InputError(
        path.string(), "",
        fmt::format("is {} bytes long{}{}; expected at most {}", size_, kind.empty() ? "" : ", ", kind, max_bytes));
  }
  descriptor_ = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor_ < 0) throw InputError(path.string(), "", fmt::format("cannot be read: {}", std::strerror(errno)));
}
FileReader::~FileReader() { ::close(descriptor_); }

std::size_t FileReader::read(std::uint64_t at, std::span<char> to) const {
  std::size_t done = 0;
  while (done < to.size()) {
    const ssize_t taken = ::pread(descriptor_, to.data() + done, to.size() - done, static_cast<off_t>(at + done));
    if (taken < 0 && errno == EINTR) continue;
    if (taken <= 0) break;
    done += unsignedIndex(taken);
  }
  return done;
}

std::string FileReader::bytes(std::uint64_t at, std::uint64_t count) const {
  std::string bytes(std::min(count, size_ - std::min(at, size_)), '\0');
  errno = 0;
  if (read(at, bytes) != bytes.size())
    throw InputError(path_.string(), "", fmt::format("cannot be read: {}", std::strerror(errno)));
  return bytes;
}

std::string readFile(const fs::path& path, std::uint64_t max_bytes) {
  const FileReader file(path, max_bytes);
  return file.bytes(0, file.size());
}

void writeFileAtomically(const fs::path& path, const std::function<void(const fs::path&)>& write) {
  std::error_code error;
  if (path.has_parent_path()) {
    fs::create_directories(path.parent_path(), error);
    if (error) throw InputError(path.parent_path().string(), "", fmt::format("cannot be made: {}", error.message()));
  }
  const fs::file_status there = fs::status(path, error);
  if (fs::is_directory(there)) throw InputError(path.string(), "", "is a folder; expected a file name");
  // A device or a pipe would be gone, a file in its place.
  if (fs::exists(there) && !fs::is_regular_file(there))
    throw InputError(path.string(), "", "is no regular file; expected a file name");
  auto waiting = std::make_unique<FilesTogether::Waiting>(path);
  write(waiting->file.path());
  flushToDisk(waiting->file.path(), path);
  if (open_set != nullptr) {
    const std::scoped_lock lock(open_set->mutex_);
    open_set->waiting_.push_back(std::move(waiting));
  } else {
    waiting->file.renameTo(path);
  }
}

void writeFileInParts(const fs::path& path, const std::function<void(const AppendBytes&)>& write) {
  writeFileAtomically(path, [&](const fs::path& temporary) {
    OpenFile file(temporary, path);
    write([&file](std::string_view bytes) { file.append(bytes); });
    file.close();
  });
}

void writeFileAtomically(const fs::path& path, std::string_view bytes) {
  writeFileInParts(path, [&](const AppendBytes& append) { append(bytes); });
}

std::string sha256Hex(std::string_view bytes) {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned int size = 0;
  MOUTHPIECE_EXPECT(EVP_Digest(bytes.data(), bytes.size(), digest.data(), &size, EVP_sha256(), nullptr) == 1);
  return fmt::format("{:02x}", fmt::join(std::span(digest).first(size), ""));
}

}  // namespace mouthpiece
