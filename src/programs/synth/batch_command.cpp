// synth batch: every line of a list, each in a folder of its own.
#include <fmt/format.h>

#include "programs/synth/batch_list.h"
#include "programs/synth/commands.h"

namespace mouthpiece {
namespace {

struct BatchOptions : SharedOptions {
  std::filesystem::path list;
  std::filesystem::path out_folder = "out";
  std::string shard = "1/1";
};

void addOptions(CLI::App& app, BatchOptions& options) {
  app.add_option("list", options.list, "The list")->required();
  app.add_option("--out", options.out_folder, "Folder for the folders")->capture_default_str();
  app.add_option("--shard", options.shard, "I/N: this run makes every N-th line, starting at the I-th")
      ->capture_default_str();
  addSharedOptions(app, options);
}

/// A line that cannot be spoken is named and left out; the others are made all the same.
int runBatch(const BatchOptions& options) {
  const std::vector<BatchLine> lines = linesOfShard(readBatchList(options.list), parseShard(options.shard));
  Speaker speaker(options.speaker);
  ProgressBar progress("synth batch", lines.size(), options.quiet);
  std::size_t failed = 0;
  for (const BatchLine& each : lines) {
    try {
      const Performance performance = speaker.perform(each.line);
      save(performance, usualFiles(options.out_folder / each.id));
      for (const std::string& warning : performance.warnings())
        printNotice(fmt::format("{}: {}", each.id, warning), options.quiet);
    } catch (const InputError& error) {
      ++failed;
      printNotice(fmt::format("{}: {}", each.id, error.what()), false);
    }
    progress.advance();
  }
  if (!options.quiet)
    printText(
        fmt::format("{} of {} lines made in {}\n", lines.size() - failed, lines.size(), options.out_folder.string()));
  return failed == 0 ? kExitDone : kExitBadInput;
}

}  // namespace

Command batchCommand() {
  return makeCommand<BatchOptions>("batch",
                                   "Makes every line of a CSV list (id,text, id,audio, id,audio,transcript, "
                                   "id,audio,phones or id,audio,times) in a folder of its own",
                                   "synth batch lines.csv --out lines --shard 1/4", addOptions, runBatch);
}

}  // namespace mouthpiece
