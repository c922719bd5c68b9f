#include "base/unfinished.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstddef>
#include <cstring>
#include <ctime>
#include <mutex>
#include <new>
#include <set>
#include <string_view>
#include <system_error>
#include <utility>

#include "base/errors.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

/// Between making a temporary and locking it, it is nobody's, and empty; no process takes longer for that.
constexpr std::time_t kYoungest = 60;

template <typename Thing>
struct Noted {
  std::mutex mutex;
  std::list<Thing> things;
  std::set<fs::path> swept;
};

/// Never destroyed: threads may still be at work while the process ends. In memory of its own: the process may end for
/// want of any other.
auto& noted() {
  using All = Noted<std::variant<fs::path, pid_t>>;
  alignas(All) static std::array<std::byte, sizeof(All)> memory;
  static All& all = *new (memory.data()) All;
  return all;
}

/// Whether the part of a name between its prefix and its suffix is what mkdtemp, or a file's maker, puts there.
bool isDrawn(std::string_view part, LeftoverKind kind) {
  const auto isDigit = [](char c) { return c >= '0' && c <= '9'; };
  if (kind == LeftoverKind::kFile)
    return part.size() == 16 &&
           std::all_of(part.begin(), part.end(), [&](char c) { return isDigit(c) || (c >= 'a' && c <= 'f'); });
  return part.size() == 6 && std::all_of(part.begin(), part.end(), [&](char c) {
           return isDigit(c) || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
         });
}

bool isLeftover(const fs::path& path, LeftoverKind kind) {
  struct stat facts {};
  if (::lstat(path.c_str(), &facts) != 0 || facts.st_uid != ::geteuid()) return false;
  const bool is_own_folder = S_ISDIR(facts.st_mode) && (facts.st_mode & (S_IRWXG | S_IRWXO)) == 0;
  if (kind == LeftoverKind::kFile ? !S_ISREG(facts.st_mode) : !is_own_folder) return false;
  const bool was_locked = S_ISREG(facts.st_mode) && facts.st_size > 0;
  if (!was_locked && facts.st_mtime + kYoungest > std::time(nullptr)) return false;
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_CLOEXEC | O_NONBLOCK);
  if (descriptor < 0) return false;
  const bool is_free = ::flock(descriptor, LOCK_EX | LOCK_NB) == 0;
  ::close(descriptor);
  return is_free;
}

}  // namespace

Unfinished::Unfinished(const std::function<Thing()>& begin) {
  std::list<Thing> own(1);  // all the memory that it takes to note what is begun
  const std::scoped_lock lock(noted().mutex);
  own.front() = begin();
  place_ = own.begin();
  noted().things.splice(noted().things.end(), own);
}

Unfinished::~Unfinished() {
  const std::scoped_lock lock(noted().mutex);
  noted().things.erase(place_);
}

void endUnfinished() {
  noted().mutex.lock();
  // Newest first: a process before the folder that it works in.
  for (auto thing = noted().things.rbegin(); thing != noted().things.rend(); ++thing) {
    if (const auto* group = std::get_if<pid_t>(&*thing)) ::kill(-*group, SIGKILL);
    const auto* path = std::get_if<fs::path>(&*thing);
    if (path == nullptr || ::unlink(path->c_str()) == 0) continue;
    try {
      fs::remove_all(*path);
    } catch (const std::exception&) {  // no memory for that: the next start sweeps it
    }
  }
}

FileLock::FileLock(int descriptor)
    : descriptor_(descriptor), is_ours_(::flock(descriptor, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK) {}

FileLock FileLock::ofFolder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  const int descriptor = error ? -1 : ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
  if (descriptor < 0)
    throw InputError(folder.string(), "",
                     fmt::format("cannot be made: {}", std::strerror(error ? error.value() : errno)));
  return FileLock(descriptor);
}

FileLock::~FileLock() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

void sweepLeftovers(const fs::path& folder, const std::string& prefix, const std::string& suffix, LeftoverKind kind) {
  std::error_code error;
  {
    const std::scoped_lock lock(noted().mutex);
    if (!noted().swept.insert(fs::absolute(folder / (prefix + "*" + suffix), error)).second) return;
  }
  for (auto entry = fs::directory_iterator(folder.empty() ? "." : folder, error);
       !error && entry != fs::directory_iterator(); entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    if (name.size() <= prefix.size() + suffix.size() || !name.starts_with(prefix) || !name.ends_with(suffix)) continue;
    const std::string_view drawn =
        std::string_view(name).substr(prefix.size(), name.size() - prefix.size() - suffix.size());
    std::error_code ignored;
    if (isDrawn(drawn, kind) && isLeftover(entry->path(), kind)) fs::remove_all(entry->path(), ignored);
  }
}

}  // namespace mouthpiece
