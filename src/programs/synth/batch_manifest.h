#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/unfinished.h"
#include "exports/line_quality.h"
#include "mouthpiece/performance.h"

namespace mouthpiece {

/// What a batch tells of one line (docs/formats/manifest.md).
struct LineRecord {
  enum class Status { kMade, kFailed, kUnusable };  ///< unusable: the row of the list

  std::string key, id, language, speaker, text;
  std::string heard;  ///< of a recording without a text in the list: what it says
  std::size_t row = 0;
  Status status = Status::kMade;
  std::string hash;  ///< of its words, files and all settings
  std::string error;
  double duration_s = 0;
  std::string method;
  LineQuality quality;
  std::vector<std::string> warnings, notices;
  struct File {
    std::string name;  ///< relative to the manifest's folder
    std::uint64_t bytes = 0;
  };
  std::vector<File> files;
  std::vector<std::string> others;
};

/// What the page needs to show a line: its sound, and where its markers are.
struct LinePlayer {
  std::string key;
  std::string wav;  ///< base64
  double frame_rate_hz = 0;
  std::vector<std::string> markers;
  std::string places;  ///< base64 of int16: frames x (x, y of each marker), tenths of a millimetre
};

/// That of a line, of a long one of its first 30 s.
LinePlayer playerOf(const std::string& key, const Performance& performance);

/// So many lines of a page have players.
inline constexpr std::size_t kMostPlayers = 24;

struct Manifest {
  std::string list;                        ///< name of the list's file
  std::string settings;                    ///< JSON of all that is the same for every line
  std::size_t lines_in_list = 0;           ///< of all shards
  std::vector<std::string> other_columns;  ///< of the list
  std::vector<LineRecord> lines;           ///< in the order of the list
  std::vector<LinePlayer> players;         ///< of the lines with most doubt among those made when it was written
};

/// The one line of JSON that the journal has for a record, and back. Throws InputError that begins with `file`.
std::string recordLine(const LineRecord& record);

std::string manifestJson(const Manifest& manifest);
/// A row a line; texts that a spreadsheet would run as a formula have a ' before them.
std::string manifestCsv(const Manifest& manifest);
/// One page, worst lines first.
std::string manifestPage(const Manifest& manifest);
std::string playersJson(const Manifest& manifest);

/// The names of a manifest's files: STEM.json, .csv, .html and .players.json.
std::vector<std::string> manifestFiles(const std::string& stem);
/// Throws InputError where writeManifest() would replace a file that is none of ours.
void expectOurManifest(const std::filesystem::path& folder, const std::string& stem);

/// manifest.json, manifest.csv, manifest.html and manifest.players.json in `folder`, each whole or as it was; of shard
/// "3/8" `manifest.3-of-8.json` and so on. Players of lines with little doubt are dropped.
void writeManifest(const std::filesystem::path& folder, const std::string& stem, Manifest& manifest);
/// What is there of it, and of the journal beside it, which is newer; nothing where there is none. Throws InputError.
std::optional<Manifest> readManifest(const std::filesystem::path& folder, const std::string& stem);

/// The stems of all manifests and journals in a folder, sorted: "manifest", "manifest.3-of-8".
std::vector<std::string> manifestStems(const std::filesystem::path& folder);

/// Records as they are made, a line each in STEM.journal, which a kill cannot take back.
class ManifestJournal {
 public:
  /// Throws InputError when another process writes it.
  ManifestJournal(const std::filesystem::path& folder, const std::string& stem);
  ManifestJournal(const ManifestJournal&) = delete;
  ManifestJournal& operator=(const ManifestJournal&) = delete;
  void add(const LineRecord& record);
  /// All of it is in the manifest.
  void clear();
  /// Removes it. Nothing can be added after that.
  void remove();

 private:
  std::filesystem::path path_;
  int descriptor_;
  FileLock lock_;
};

}  // namespace mouthpiece
