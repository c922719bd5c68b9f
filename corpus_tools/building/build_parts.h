#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "corpus_tools/takes/take_files.h"
#include "corpus_tools/takes/take_report.h"
#include "motion/marker_layout.h"
#include "units/file/corpus.h"

namespace mouthpiece {

/// A take, cleaned and labelled.
struct CleanedTake {
  CorpusTake take;
  TakeReport report;
};

/// SHA-256 over the bytes of all files of a take and over `settings`.
std::string takeKey(const TakeFiles& files, const std::string& settings);

/// Takes that a build has done, kept in a folder until the corpus is whole: what a run that is killed leaves, the next
/// one takes up. Each is a corpus file of one take, written atomically, checksums and all. Thread-safe.
class BuildParts {
 public:
  /// `frame` names the coordinates that the takes are in: parts of another frame are not found.
  BuildParts(std::filesystem::path folder, const MarkerLayout& layout, std::string frame);

  /// nullopt when it was not done, or is damaged.
  [[nodiscard]] std::optional<CleanedTake> find(const std::string& key) const;
  void store(const CleanedTake& take) const;
  /// A take that was found or stored before. Throws InputError when it has gone or is damaged.
  [[nodiscard]] CorpusTake load(const std::string& key) const;
  /// The folder with all parts, once they are in a corpus.
  void remove() const;

 private:
  [[nodiscard]] std::filesystem::path pathOf(const std::string& key) const;

  std::filesystem::path folder_;
  const MarkerLayout& layout_;
  std::string frame_;
};

/// Removes what killed runs left beside `output`: its temporary files whose process is gone.
void removeStaleTemporaries(const std::filesystem::path& output);

}  // namespace mouthpiece
