// synth merge: the manifests of a batch's shards as one.
#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "base/counted.h"
#include "base/errors.h"
#include "programs/synth/batch_manifest.h"
#include "programs/synth/commands.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

struct MergeOptions {
  std::vector<fs::path> folders;
  fs::path out_folder;
  bool quiet = false;
};

void addOptions(CLI::App& app, MergeOptions& options) {
  app.add_option("folders", options.folders, "Folders that `synth batch --shard` has written to")->required();
  app.add_option("--out", options.out_folder, "Folder for the one manifest (default: the first of them)");
}

/// The one manifest, and what of it does not fit together.
struct Merger {
  Manifest all;
  std::map<std::string, std::size_t> place;
  std::size_t twice = 0;

  void add(Manifest manifest, const fs::path& folder, const fs::path& out_folder) {
    if (all.list.empty()) {
      all.list = manifest.list;
      all.settings = manifest.settings;
      all.other_columns = manifest.other_columns;
    }
    all.lines_in_list = std::max(all.lines_in_list, manifest.lines_in_list);
    for (LineRecord& line : manifest.lines) {
      for (LineRecord::File& file : line.files)
        file.name = fs::relative(folder / file.name, out_folder).generic_string();
      const auto [found, is_new] = place.try_emplace(line.key, all.lines.size());
      if (is_new) {
        all.lines.push_back(std::move(line));
        continue;
      }
      LineRecord& known = all.lines[found->second];
      const bool is_made = line.status == LineRecord::Status::kMade,
                 was_made = known.status == LineRecord::Status::kMade;
      if (is_made && was_made) ++twice;
      if (is_made && !was_made) known = std::move(line);
    }
    for (LinePlayer& player : manifest.players) {
      if (std::none_of(all.players.begin(), all.players.end(),
                       [&](const LinePlayer& known) { return known.key == player.key; }))
        all.players.push_back(std::move(player));
    }
  }
};

int runMerge(const MergeOptions& options) {
  const fs::path out_folder = options.out_folder.empty() ? options.folders.front() : options.out_folder;
  fs::create_directories(out_folder);
  Merger merger;
  std::size_t manifests = 0;
  for (const fs::path& folder : options.folders) {
    for (const std::string& stem : manifestStems(folder)) {
      if (stem == "manifest") continue;  // what an earlier merge has made
      std::optional<Manifest> manifest = readManifest(folder, stem);
      if (!manifest) continue;
      ++manifests;
      merger.add(std::move(*manifest), folder, out_folder);
    }
  }
  if (manifests == 0)
    throw InputError(options.folders.front().string(), "",
                     "holds no manifest of a shard; expected what `synth batch --shard I/N` writes");
  Manifest& all = merger.all;
  std::stable_sort(all.lines.begin(), all.lines.end(), [](const LineRecord& a, const LineRecord& b) {
    return std::tie(a.row, a.key) < std::tie(b.row, b.key);
  });
  const auto made =
      static_cast<std::size_t>(std::count_if(all.lines.begin(), all.lines.end(), [](const LineRecord& line) {
        return line.status == LineRecord::Status::kMade;
      }));
  const std::size_t missing = all.lines_in_list - std::min(all.lines_in_list, all.lines.size());
  expectOurManifest(out_folder, "manifest");
  writeManifest(out_folder, "manifest", all);
  if (!options.quiet) {
    printText(fmt::format("{}: {} of {} made, {} failed, {} missing, {} in two manifests -> {}\n",
                          counted(manifests, "manifest"), made, counted(all.lines_in_list, "line"),
                          all.lines.size() - made, missing, merger.twice, (out_folder / "manifest.html").string()));
  }
  return made == all.lines_in_list ? kExitDone : kExitBadInput;
}

}  // namespace

Command mergeCommand() {
  return makeCommand<MergeOptions>("merge", "Joins the manifests of a batch's shards into one", "synth merge lines",
                                   addOptions, runMerge);
}

}  // namespace mouthpiece
