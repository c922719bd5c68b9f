// Bytes in a file that has no name and takes no memory while nobody looks at it.
#include "base/unnamed_file.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "base/child_process.h"
#include "support/error_of.h"

namespace mouthpiece {
namespace {

/// The temporary folder of this process, for as long as this lives.
class TemporaryFolder {
 public:
  explicit TemporaryFolder(const std::string& path) {
    if (const char* before = std::getenv("TMPDIR"); before != nullptr) before_ = before;
    ::setenv("TMPDIR", path.c_str(), 1);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  ~TemporaryFolder() { before_.empty() ? ::unsetenv("TMPDIR") : ::setenv("TMPDIR", before_.c_str(), 1); }

 private:
  std::string before_;
};

/// KiB of mapped files that are resident in this process.
long residentOfFiles() {
  long kib = 0;
  std::FILE* status = std::fopen("/proc/self/status", "r");
  if (status == nullptr) return 0;
  for (char line[256]; std::fgets(line, sizeof line, status) != nullptr;) std::sscanf(line, "RssFile: %ld", &kib);
  std::fclose(status);
  return kib;
}

TEST(UnnamedFile, KeepsBytesWithoutANameOrMemory) {
  constexpr std::size_t kSize = std::size_t{16} << 20U;
  const PrivateFolder folder;
  const TemporaryFolder temporary(folder.path().string());
  UnnamedFile file;
  EXPECT_TRUE(UnnamedFile().bytes().empty());
  std::vector<std::byte> given(kSize);
  for (std::size_t i = 0; i < kSize; ++i) given[i] = static_cast<std::byte>(i * i >> 8U);
  file.append(std::span(given).first(kSize / 3));
  file.append(std::span(given).subspan(kSize / 3));
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
  EXPECT_TRUE(std::ranges::equal(file.bytes(), given));
  const long looked_at = residentOfFiles();
  file.letGo();
  EXPECT_LT(residentOfFiles(), looked_at - static_cast<long>(kSize / 1024 * 3 / 4));
  EXPECT_TRUE(std::ranges::equal(file.bytes(), given));
}

TEST(UnnamedFile, SaysWhereTheFolderTakesNone) {
  const TemporaryFolder temporary("/proc");
  EXPECT_TRUE(errorOf([] { UnnamedFile(); }).starts_with("/proc: takes no temporary file: "));
}

}  // namespace
}  // namespace mouthpiece
