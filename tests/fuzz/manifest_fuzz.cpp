// What a batch finds in its folder of an earlier run: manifest, players and journal, between form feeds. What can be
// read can be written and read again.
#include <unistd.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include "base/errors.h"
#include "programs/synth/batch_manifest.h"

namespace mouthpiece {
extern const std::string_view kBatchPage;
const std::string_view kBatchPage =
    "<html><head><meta charset=\"utf-8\"></head><body><!-- batch:data --></body></html>";
}  // namespace mouthpiece

namespace {

namespace fs = std::filesystem;
constexpr std::array<std::string_view, 3> kEndings{".json", ".players.json", ".journal"};

/// A folder of this process, which goes with it.
class OwnFolder {
 public:
  OwnFolder() {
    std::string pattern = (fs::temp_directory_path() / "mouthpiece_fuzz.XXXXXX").string();
    MOUTHPIECE_EXPECT(mkdtemp(pattern.data()) != nullptr);
    path_ = pattern;
  }
  ~OwnFolder() {
    std::error_code error;
    fs::remove_all(path_, error);
  }
  OwnFolder(const OwnFolder&) = delete;
  OwnFolder& operator=(const OwnFolder&) = delete;
  void write(std::string_view ending, std::string_view bytes) const {
    std::ofstream(path_ / ("manifest" + std::string(ending)), std::ios::binary) << bytes;
  }
  [[nodiscard]] const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const OwnFolder folder;
  std::string_view rest(reinterpret_cast<const char*>(data), size);
  for (const std::string_view ending : kEndings) {
    const std::size_t end = std::min(rest.find('\f'), rest.size());
    folder.write(ending, rest.substr(0, end));
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  std::string json;
  try {
    const auto manifest = mouthpiece::readManifest(folder.path(), "manifest");
    MOUTHPIECE_EXPECT(manifest.has_value());
    json = mouthpiece::manifestJson(*manifest);
    mouthpiece::manifestCsv(*manifest);
    mouthpiece::manifestPage(*manifest);
  } catch (const mouthpiece::InputError&) {
    return 0;
  }
  folder.write(".json", json);
  folder.write(".journal", "");
  folder.write(".players.json", "{\"players\": []}");
  MOUTHPIECE_EXPECT(mouthpiece::manifestJson(*mouthpiece::readManifest(folder.path(), "manifest")) == json);
  return 0;
}
