#include "speaker/shared_files.h"

#include <dlfcn.h>
#include <fmt/format.h>

#include <cstdlib>
#include <mutex>

#include "base/errors.h"
#include "hearing/network/word_network.h"

namespace mouthpiece {
namespace {
namespace fs = std::filesystem;

/// The program or shared library that this function lies in.
fs::path ownFile() {
  Dl_info info{};
  std::error_code error;
  if (dladdr(reinterpret_cast<const void*>(&ownFile), &info) != 0 && info.dli_fname != nullptr) {
    const fs::path file = fs::canonical(info.dli_fname, error);
    if (!error) return file;
  }
  return fs::read_symlink("/proc/self/exe", error);
}

}  // namespace

fs::path findSharedFile(std::string_view name, std::string_view how_to_make) {
  if (const char* folder = std::getenv("MOUTHPIECE_SHARE"); folder != nullptr && *folder != '\0') {
    const fs::path path = fs::path(folder) / name;
    if (fs::exists(path)) return path;
  }
  // PREFIX/bin/synth, PREFIX/lib/libmouthpiece.so, PREFIX/lib/x86_64-linux-gnu/libmouthpiece.so.
  fs::path first;
  std::error_code error;
  for (const fs::path& own : {ownFile(), fs::read_symlink("/proc/self/exe", error)}) {
    fs::path prefix = own.parent_path();
    for (int up = 0; up < 2; ++up) {
      prefix = prefix.parent_path();
      const fs::path path = prefix / "share" / "mouthpiece" / name;
      if (first.empty()) first = path;
      if (fs::exists(path, error)) return path;
    }
  }
  throw InputError(first.string(), "", fmt::format("no such file; {}", how_to_make));
}

fs::path corpusFile(const fs::path& named) {
  constexpr std::string_view kMake = "make the sample corpus with `make data` in the checkout, or name another";
  const bool is_shipped = named.empty() || ((named == "sample" || named == "clock") && !fs::exists(named));
  return is_shipped ? findSharedFile(named == "clock" ? "clock.corpus" : "sample.corpus", kMake) : named;
}

std::shared_ptr<WordNetwork> sharedWordNetwork() {
  static std::mutex finding;
  static std::weak_ptr<WordNetwork> found;
  const std::scoped_lock lock(finding);
  std::shared_ptr<WordNetwork> network = found.lock();
  if (network) return network;
  fs::path folder;
  try {
    folder = findSharedFile("word_network/hear_words.mjs", "").parent_path();
  } catch (const InputError&) {  // it is not there
  }
  network = std::make_shared<WordNetwork>(folder);
  found = network;
  return network;
}

std::filesystem::path pageEngineFile() {
  return findSharedFile("page_engine.wasm", "make it with `make wasm` in the checkout");
}

}  // namespace mouthpiece
