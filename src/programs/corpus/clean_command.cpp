#include <fmt/format.h>

#include "base/counted.h"
#include "corpus_tools/takes/cleaning.h"
#include "motion/formats/motion_file.h"
#include "programs/corpus/command_support.h"
#include "programs/corpus/commands.h"
#include "programs/outputs.h"

namespace mouthpiece {
namespace {

struct CleanArguments {
  bool quiet = false;
  std::filesystem::path input, output, layout;
  CleaningOptions cleaning;
};

int runClean(const CleanArguments& given) {
  MotionClip motion = readMotion(given.input);
  renameMarkers(motion, markerMapFrom({}, given.layout));
  const CleanedFace clean = cleanClip(motion, layoutFrom(given.layout), given.input.string(), given.cleaning);
  writeMotionWithEvents(given.output, clean.motion, given.input);
  const TakeReport& report = clean.report;
  printNotice(fmt::format("{}: {} and {} repaired; head by jig {}, by skin {}, bridged {}; {} "
                          "filled, {} still missing; noise {:.3f} mm, smoothed by {:.3f} mm",
                          counted(report.frames, "frame"), counted(report.swaps, "swap"),
                          counted(report.spikes, "spike"), report.jig_frames, report.skin_frames, report.bridged_frames,
                          counted(report.filled_samples, "sample"), report.missing_samples, report.noise_mm,
                          report.smoothed_mm),
              given.quiet);
  return kExitDone;
}

void addOptions(CLI::App& command, CleanArguments& options) {
  command.add_option("in", options.input, "Motion to read (c3d csv trc)")->required();
  command.add_option("out", options.output, "Motion to write (c3d csv trc)")->required();
  checkOutputs(command, {{"out"}});
  addLayoutOption(command, options.layout);
  addCleaningOptions(command, options.cleaning);
}

}  // namespace

Command cleanCommand() {
  return makeCommand("clean", "One take's motion with the head still and short gaps filled",
                     "corpus clean take.c3d still.csv", addOptions, runClean);
}

}  // namespace mouthpiece
