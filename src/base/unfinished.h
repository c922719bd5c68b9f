#pragma once

#include <sys/types.h>

#include <filesystem>
#include <functional>
#include <list>
#include <string>
#include <variant>

namespace mouthpiece {

/// What a process has begun and must not leave behind: a temporary file or folder, or a process group, noted for as
/// long as this lives. The list of them is the process' own (docs/decisions/0011-one-clean-up-path.md): a signal ends
/// the process, whatever object holds the rest of its work.
class Unfinished {
 public:
  /// The absolute path of a file or folder, or a process group.
  using Thing = std::variant<std::filesystem::path, pid_t>;
  /// `begin` begins it; what it throws is passed on. Nothing is ended while it runs, so that none is ever there that is
  /// not noted.
  explicit Unfinished(const std::function<Thing()>& begin);
  Unfinished(const Unfinished&) = delete;
  Unfinished& operator=(const Unfinished&) = delete;
  ~Unfinished();

 private:
  friend void endUnfinished();
  std::list<Thing>::iterator place_;
};

/// Kills the noted process groups and removes the noted files and folders. Nothing can be begun or ended after it: the
/// caller ends the process. Not for a signal handler, which may not wait for a lock.
void endUnfinished();

/// A file or folder locked by flock() for as long as this lives. On a file system without locks it is as if nobody else
/// held one.
class FileLock {
 public:
  /// Takes the descriptor over, closes it at its end, and does not wait.
  explicit FileLock(int descriptor);
  /// Of a folder, which is made where it is not there. Throws InputError when it cannot be, or is a link (its name with
  /// a / behind it is what that leads to).
  static FileLock ofFolder(const std::filesystem::path& folder);
  FileLock(const FileLock&) = delete;
  FileLock& operator=(const FileLock&) = delete;
  ~FileLock();
  [[nodiscard]] bool isOurs() const { return is_ours_; }

 private:
  int descriptor_;
  bool is_ours_;
};

/// What a process may leave where it was killed: a file whose name is PREFIX, 16 hexadecimal digits and SUFFIX, or a
/// folder whose is PREFIX, six letters or digits (mkdtemp's) and SUFFIX, and into which nobody else may look.
enum class LeftoverKind { kFile, kFolder };

/// Removes this user's leftovers of one kind in `folder` that are older than a minute and locked by nobody. Each folder
/// and name once a process. Never throws: a leftover that stays costs room and nothing else.
void sweepLeftovers(const std::filesystem::path& folder, const std::string& prefix, const std::string& suffix,
                    LeftoverKind kind);

}  // namespace mouthpiece
