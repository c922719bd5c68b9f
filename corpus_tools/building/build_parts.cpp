#include "corpus_tools/building/build_parts.h"

#include <signal.h>

#include <cerrno>
#include <charconv>

#include "base/errors.h"
#include "base/files.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

/// Changes when the cleaning or labelling of takes does, so that no part of an older program is taken up.
constexpr const char* kPartsVersion = "2";

}  // namespace

std::string takeKey(const TakeFiles& files, const std::string& settings) {
  std::string hashes = kPartsVersion + settings + "\n" + files.name;
  for (const fs::path& path : {files.motion, files.audio, files.labels, files.text.value_or(fs::path())}) {
    hashes += "\n" + path.extension().string() + " " + (path.empty() ? "" : sha256Hex(readFile(path)));
  }
  return sha256Hex(hashes);
}

BuildParts::BuildParts(fs::path folder, const MarkerLayout& layout, std::string frame)
    : folder_(std::move(folder)), layout_(layout), frame_(std::move(frame)) {}

fs::path BuildParts::pathOf(const std::string& key) const { return folder_ / (sha256Hex(frame_ + key) + ".corpus"); }

std::optional<CleanedTake> BuildParts::find(const std::string& key) const {
  std::error_code error;
  if (!fs::exists(pathOf(key), error)) return std::nullopt;
  try {
    Corpus part = readCorpus(pathOf(key), CorpusAudio::kLoad);
    const std::vector<TakeReport> reports = reportsFromJson(part.build_log[kTakeReportsKey]);
    if (part.takes.size() != 1 || reports.size() != 1 || reports[0].key != key) return std::nullopt;
    return CleanedTake{std::move(part.takes[0]), reports[0]};
  } catch (const InputError&) {
    return std::nullopt;
  }
}

void BuildParts::store(const CleanedTake& take) const {
  Corpus part;
  part.layout = layout_;
  part.neutral_pose_mm = MarkerPositions::Zero(static_cast<Eigen::Index>(layout_.markers.size()), 3);
  part.takes.push_back(take.take);
  part.build_log[kTakeReportsKey] = reportsToJson({take.report});
  writeCorpus(pathOf(take.report.key), part);
}

CorpusTake BuildParts::load(const std::string& key) const {
  Corpus part = readCorpus(pathOf(key), CorpusAudio::kLoad);
  if (part.takes.size() != 1) throw InputError(pathOf(key).string(), "takes", "is no part of this build");
  return std::move(part.takes[0]);
}

void BuildParts::remove() const {
  std::error_code error;  // a folder that stays costs room, nothing else
  fs::remove_all(folder_, error);
}

void removeStaleTemporaries(const fs::path& output) {
  // writeFileAtomically() names them ".NAME.PROCESS.tmp".
  const std::string prefix = "." + output.filename().string() + ".", suffix = ".tmp";
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(fs::absolute(output).parent_path(), error)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with(prefix) || !name.ends_with(suffix) || name.size() <= prefix.size() + suffix.size()) continue;
    int process = 0;
    const char* const end = name.data() + name.size() - suffix.size();
    const auto read = std::from_chars(name.data() + prefix.size(), end, process);
    const bool is_gone = read.ptr == end && process > 0 && ::kill(process, 0) != 0 && errno == ESRCH;
    if (is_gone) fs::remove(entry.path(), error);
  }
}

}  // namespace mouthpiece
