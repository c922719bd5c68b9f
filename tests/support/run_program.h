#pragma once

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace mouthpiece::test {

struct ProgramResult {
  int exit_code = -1;  ///< 128 + signal when a signal ended it
  std::string out;
  std::string err;
};

/// Runs build/bin/`program` with `arguments` (no shell) in `working_directory`; "" is the present one. `kill_after`: a
/// run that lasts longer is killed (exit code 137).
ProgramResult runProgram(const std::string& program, const std::vector<std::string>& arguments,
                         const std::filesystem::path& working_directory = {},
                         std::optional<std::chrono::microseconds> kill_after = {});

/// A folder of its own for a test, removed with everything in it afterwards.
class ScratchFolder {
 public:
  ScratchFolder();
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  ~ScratchFolder();
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  /// Writes `bytes` to `name` in the folder and returns its path.
  [[nodiscard]] std::filesystem::path write(const std::string& name, const std::string& bytes) const;

 private:
  std::filesystem::path path_;
};

std::string readAll(const std::filesystem::path& path);

}  // namespace mouthpiece::test
