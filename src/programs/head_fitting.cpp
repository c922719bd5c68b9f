#include "programs/head_fitting.h"

#include <fmt/format.h>

#include "base/child_process.h"
#include "base/errors.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

constexpr Seconds kLongestFit = 300;

fs::path programBeside(std::string_view name) {
  std::error_code error;
  const fs::path beside = fs::read_symlink("/proc/self/exe", error).parent_path() / name;
  if (!error && fs::exists(beside)) return beside;
  if (const auto found = findProgram(name)) return *found;
  throw InputError(fmt::format("the program {} is missing; expected it beside this one", name));
}

/// The last line that a program of ours has said, without its name.
std::string lastLineOf(const ChildResult& result, std::string_view program) {
  std::string_view text = result.output;
  while (text.ends_with('\n')) text.remove_suffix(1);
  text = text.substr(text.rfind('\n') + 1);
  const std::string prefix = std::string(program) + ": ";
  if (text.starts_with(prefix)) text.remove_prefix(prefix.size());
  return text.empty() ? fmt::format("{} has failed", program) : std::string(text);
}

}  // namespace

void runBeside(std::string_view name, const std::vector<std::string>& arguments, const fs::path& folder,
               Seconds limit) {
  const ChildResult result = runChild(programBeside(name), arguments, folder, limit);
  if (result.timed_out) throw InputError(fmt::format("{} took over {:.0f} s", name, limit));
  if (result.exit_code != 0) throw InputError(lastLineOf(result, name));
}

fs::path fitHead(const fs::path& mesh, const fs::path& corpus, const std::function<void(std::string_view)>& tell) {
  const fs::path face = fs::path(mesh).replace_extension(".face");
  const fs::path anchors = fs::path(mesh).replace_extension(".anchors.json");
  tell("finding the mouth");
  if (!fs::exists(anchors))
    runBeside("retarget", {"anchors", mesh.string(), "--out", anchors.string()}, mesh.parent_path(), kLongestFit);
  tell("fitting the head");
  runBeside("retarget",
            {"fit", "--mesh", mesh.string(), "--anchors", anchors.string(), "--corpus", corpus.string(), "--out",
             face.string()},
            mesh.parent_path(), kLongestFit);
  return face;
}

}  // namespace mouthpiece
