#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "base/time.h"
#include "base/unfinished.h"

namespace mouthpiece {

/// The system's: TMPDIR where it names a folder, else /tmp.
std::filesystem::path temporaryFolder();

/// A folder only we can enter, gone with its content when this goes; what killed processes left goes, too.
class PrivateFolder {
 public:
  /// Throws InputError when the system's temporary folder takes no new one.
  PrivateFolder();
  PrivateFolder(const PrivateFolder&) = delete;
  PrivateFolder& operator=(const PrivateFolder&) = delete;
  ~PrivateFolder();
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
  std::optional<FileLock> lock_;
  std::optional<Unfinished> unfinished_;
};

/// The first executable file of that name on the PATH.
std::optional<std::filesystem::path> findProgram(std::string_view name);

struct ChildResult {
  int exit_code = 0;       ///< 128 + signal when one ended it
  bool timed_out = false;  ///< it was killed after the time limit
  std::string output;      ///< the last 16 KiB of stdout and stderr together
};

/// Runs `program` in `folder`, with no input, `folder` as its home and a minimal environment: the user's configuration
/// files and variables do not reach it. What it starts itself ends with it. No shell is involved. Throws InputError
/// when it cannot be started.
ChildResult runChild(const std::filesystem::path& program, const std::vector<std::string>& arguments,
                     const std::filesystem::path& folder, Seconds time_limit);

/// Takes the next bytes of a child's input; false when it reads no more.
using ChildInput = std::function<bool(std::string_view bytes)>;
/// The same with what `feed` writes as its input; what `feed` throws ends the child and comes out here.
ChildResult runChild(const std::filesystem::path& program, const std::vector<std::string>& arguments,
                     const std::filesystem::path& folder, Seconds time_limit,
                     const std::function<void(const ChildInput&)>& feed);

/// A program that answers requests: they come on its standard input, and it writes a line for each to descriptor 3. It
/// starts as runChild()'s do, in a folder of its own, and ends with this. Not thread-safe.
class AnsweringChild {
 public:
  /// `name` stands for it in messages. Throws InputError when it cannot be started.
  AnsweringChild(const std::filesystem::path& program, const std::vector<std::string>& arguments, std::string name);
  AnsweringChild(const AnsweringChild&) = delete;
  AnsweringChild& operator=(const AnsweringChild&) = delete;
  ~AnsweringChild();

  /// The line that answers `request`, without its end. Throws InputError where it has ended, says more than 1 MiB, or
  /// takes longer than `time_limit`, or until `stop`; it is of no use after that.
  std::string ask(std::string_view request, Seconds time_limit, const std::stop_token& stop = {});

 private:
  struct Running;
  std::unique_ptr<Running> running_;
};

}  // namespace mouthpiece
