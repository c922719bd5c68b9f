#include "programs/corpus/arkit_take.h"
#include "programs/corpus/command_support.h"
#include "motion/formats/landmark_track.h"
#include "motion/formats/motion_file.h"
#include "phonetics/labels/lab_file.h"
#include "phonetics/labels/label_files.h"

namespace mouthpiece {
namespace {

struct ConvertCommand {
  bool quiet = false;
  std::filesystem::path input, output, layout;
  std::vector<std::string> renamed;
  LandmarkTrackOptions track;
  ArkitTakeOptions arkit;
};

bool isLandmarkTrack(const std::filesystem::path& path) { return path.extension() == ".json"; }

MotionClip readTrack(const ConvertCommand& command) {
  if (!command.arkit.head.empty()) {
    ArkitTakeOptions arkit = command.arkit;
    arkit.frame_rate_hz = command.track.frame_rate_hz;
    ArkitTake take = readArkitTake(command.input, layoutFrom(command.layout), arkit);
    if (take.left_head_out)
      printNotice("HeadYaw, HeadPitch and HeadRoll are left out: the head stays still, as `corpus build` would make it",
                  command.quiet);
    return std::move(take.motion);
  }
  return isLandmarkTrack(command.input) ? readLandmarkTrack(command.input, layoutFrom(command.layout), command.track)
                                        : readMotion(command.input);
}

MotionClip readInput(const ConvertCommand& command) {
  MotionClip clip = readTrack(command);
  renameMarkers(clip, markerMapFrom(command.renamed, command.layout));
  return clip;
}

int runConvert(const ConvertCommand& command) {
  if (isLabelFileName(command.output)) {
    writeLabels(command.output, readLabels(command.input), {.name = command.output.stem().string()});
    return kExitDone;
  }
  writeMotionWithEvents(command.output, readInput(command), command.input);
  return kExitDone;
}

}  // namespace

void addConvertCommand(CLI::App& app, ChosenAction& chosen) {
  const auto options = std::make_shared<ConvertCommand>();
  CLI::App& convert =
      addCommand(app, chosen, "convert",
                 "Motion (c3d csv trc, FaceMesh json, Live Link Face csv) or labels (TextGrid lab phn ctm) to another "
                 "format, by the "
                 "ending",
                 "corpus convert take.c3d take.csv\ncorpus convert track.json take.c3d --layout mediapipe66\n"
                 "corpus convert live_link.csv take.c3d --arkit-head head.glb",
                 options, runConvert);
  convert.add_option("in", options->input, "What to read")->required();
  convert.add_option("out", options->output, "What to write")->required();
  convert
      .add_option("--fps", options->track.frame_rate_hz,
                  "Of a landmark track or a Live Link Face CSV that does not tell")
      ->check(CLI::Range(1.0, 1000.0));
  convert.add_option("--eye-corners-mm", options->track.eye_corners_mm, "Size of the face in a landmark track")
      ->capture_default_str()
      ->check(CLI::Range(1.0, 1000.0));
  CLI::Option* head = convert.add_option("--arkit-head", options->arkit.head,
                                         "Read a Live Link Face CSV: its weights move this head (GLB with ARKit's "
                                         "shapes, or a .face fitted to one) and the markers on it");
  convert
      .add_option("--anchors", options->arkit.anchors,
                  "Where markers lie on that GLB; default: HEAD.anchors.json, HEAD.landmarks.json, or the only such "
                  "file beside it")
      ->needs(head);
  addLayoutOption(convert, options->layout);
  addMarkerMapOption(convert, options->renamed);
}

}  // namespace mouthpiece
