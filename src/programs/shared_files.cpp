#include "programs/shared_files.h"

#include <fmt/format.h>

#include <cstdlib>

#include "base/errors.h"

namespace mouthpiece {
namespace fs = std::filesystem;

fs::path findSharedFile(std::string_view name, std::string_view how_to_make) {
  if (const char* folder = std::getenv("MOUTHPIECE_SHARE"); folder != nullptr && *folder != '\0') {
    const fs::path path = fs::path(folder) / name;
    if (fs::exists(path)) return path;
  }
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  const fs::path path = program.parent_path().parent_path() / "share" / "mouthpiece" / name;
  if (error || !fs::exists(path, error))
    throw InputError(path.string(), "", fmt::format("no such file; {}", how_to_make));
  return path;
}

}  // namespace mouthpiece
