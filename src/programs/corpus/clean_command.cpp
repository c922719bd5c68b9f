#include <fmt/format.h>

#include "programs/corpus/command_support.h"
#include "motion/formats/motion_file.h"

namespace mouthpiece {
namespace {

struct CleanCommand {
  bool quiet = false;
  std::filesystem::path input, output, layout;
  CleaningOptions cleaning;
};

int runClean(const CleanCommand& command) {
  MotionClip motion = readMotion(command.input);
  renameMarkers(motion, markerMapFrom({}, command.layout));
  const CleanedFace clean = cleanClip(motion, layoutFrom(command.layout), command.input.string(), command.cleaning);
  writeMotionWithEvents(command.output, clean.motion, command.input);
  const TakeReport& report = clean.report;
  printNotice(
      fmt::format("{} frames: {} swaps and {} spikes repaired; head by jig {}, by skin {}, bridged {}; {} samples "
                  "filled, {} still missing; noise {:.3f} mm, smoothed by {:.3f} mm",
                  report.frames, report.swaps, report.spikes, report.jig_frames, report.skin_frames,
                  report.bridged_frames, report.filled_samples, report.missing_samples, report.noise_mm,
                  report.smoothed_mm),
      command.quiet);
  return kExitDone;
}

}  // namespace

void addCleanCommand(CLI::App& app, ChosenAction& chosen) {
  const auto options = std::make_shared<CleanCommand>();
  CLI::App& clean = addCommand(app, chosen, "clean", "One take's motion with the head still and short gaps filled",
                               "corpus clean take.c3d still.csv", options, runClean);
  clean.add_option("in", options->input, "Motion to read (c3d csv trc)")->required();
  clean.add_option("out", options->output, "Motion to write (c3d csv trc)")->required();
  addLayoutOption(clean, options->layout);
  addCleaningOptions(clean, options->cleaning);
}

}  // namespace mouthpiece
