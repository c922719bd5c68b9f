#include "motion/formats/motion_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <string>

#include "base/errors.h"
#include "motion/formats/c3d_file.h"
#include "motion/formats/motion_csv.h"

namespace mouthpiece {
namespace {

std::string lowerCaseEnding(const std::filesystem::path& path) {
  std::string ending = path.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return ending;
}

[[noreturn]] void failEnding(const std::filesystem::path& path) {
  throw InputError(
      path.string(), "",
      fmt::format("found the ending \"{}\"; expected .c3d, .csv or .trc", printable(path.extension().string())));
}

}  // namespace

MotionClip readMotion(const std::filesystem::path& path) {
  const std::string ending = lowerCaseEnding(path);
  if (ending == ".c3d") return readC3d(path);
  if (ending == ".csv") return readMotionCsv(path);
  if (ending == ".trc") return readTrc(path);
  failEnding(path);
}

void writeMotion(const std::filesystem::path& path, const MotionClip& clip) {
  const std::string ending = lowerCaseEnding(path);
  if (ending == ".c3d") return writeC3d(path, clip);
  if (ending == ".csv") return writeMotionCsv(path, clip);
  if (ending == ".trc") return writeTrc(path, clip);
  failEnding(path);
}

bool isMotionFileName(const std::filesystem::path& path) {
  const std::string ending = lowerCaseEnding(path);
  return ending == ".c3d" || ending == ".csv" || ending == ".trc";
}

}  // namespace mouthpiece
