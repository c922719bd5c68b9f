#include "programs/corpus/arkit_take.h"
#include "programs/corpus/command_support.h"
#include "motion/formats/landmark_track.h"
#include "motion/formats/motion_file.h"
#include "phonetics/labels/label_files.h"

namespace mouthpiece {
namespace {

struct Arguments {
  bool quiet = false;
  std::filesystem::path input, output, layout;
  std::vector<std::string> renamed;
  LandmarkTrackOptions track;
  ArkitTakeOptions arkit;
};

bool isLandmarkTrack(const std::filesystem::path& path) { return path.extension() == ".json"; }

MotionClip readTrack(const Arguments& given) {
  if (!given.arkit.head.empty()) {
    ArkitTakeOptions arkit = given.arkit;
    arkit.frame_rate_hz = given.track.frame_rate_hz;
    ArkitTake take = readArkitTake(given.input, layoutFrom(given.layout), arkit);
    if (take.left_head_out)
      printNotice("HeadYaw, HeadPitch and HeadRoll are left out: the head stays still, as `corpus build` would make it",
                  given.quiet);
    return std::move(take.motion);
  }
  return isLandmarkTrack(given.input) ? readLandmarkTrack(given.input, layoutFrom(given.layout), given.track)
                                      : readMotion(given.input);
}

MotionClip readInput(const Arguments& given) {
  MotionClip clip = readTrack(given);
  renameMarkers(clip, markerMapFrom(given.renamed, given.layout));
  return clip;
}

int runConvert(const Arguments& given) {
  if (isLabelFileName(given.output)) {
    writeLabels(given.output, readLabels(given.input), {.name = given.output.stem().string()});
    return kExitDone;
  }
  writeMotionWithEvents(given.output, readInput(given), given.input);
  return kExitDone;
}

void addOptions(CLI::App& command, Arguments& options) {
  command.add_option("in", options.input, "What to read")->required();
  command.add_option("out", options.output, "What to write")->required();
  command
      .add_option("--fps", options.track.frame_rate_hz,
                  "Of a landmark track or a Live Link Face CSV that does not tell")
      ->check(CLI::Range(1.0, 1000.0));
  command.add_option("--eye-corners-mm", options.track.eye_corners_mm, "Size of the face in a landmark track")
      ->capture_default_str()
      ->check(CLI::Range(1.0, 1000.0));
  CLI::Option* head = command.add_option("--arkit-head", options.arkit.head,
                                         "Read a Live Link Face CSV: its weights move this head (GLB with ARKit's "
                                         "shapes, or a .face fitted to one) and the markers on it");
  command
      .add_option("--anchors", options.arkit.anchors,
                  "Where markers lie on that GLB; default: HEAD.anchors.json, HEAD.landmarks.json, or the only such "
                  "file beside it")
      ->needs(head);
  addLayoutOption(command, options.layout);
  addMarkerMapOption(command, options.renamed);
}

}  // namespace

Command convertCommand() {
  return makeCommand(
      "convert",
      "Motion (c3d csv trc, FaceMesh json, Live Link Face csv) or labels (TextGrid lab phn ctm) to another format, by "
      "the ending",
      "corpus convert take.c3d take.csv\ncorpus convert track.json take.c3d --layout mediapipe66\n"
      "corpus convert live_link.csv take.c3d --arkit-head head.glb",
      addOptions, runConvert);
}

}  // namespace mouthpiece
