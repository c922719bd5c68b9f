#include <fmt/format.h>

#include "base/counted.h"
#include "corpus_tools/takes/video_takes.h"
#include "programs/corpus/command_support.h"
#include "programs/corpus/commands.h"
#include "speaker/shared_files.h"

namespace mouthpiece {
namespace {

constexpr Seconds kLongestSound = 3600;

struct TrackArguments {
  bool quiet = false;
  std::vector<std::filesystem::path> clips;
  std::filesystem::path folder, layout, sound;
  VideoTakesOptions options;
};

int runTrack(const TrackArguments& given) {
  VideoTakesOptions options = given.options;
  options.layout = layoutFrom(given.layout);
  if (!given.sound.empty()) options.recorder = readAudio(given.sound, {.most = kLongestSound});
  const auto models =
      findSharedFile("face_tracker/face_landmarks.tflite", "make it with `make build` in the checkout").parent_path();
  VideoTakes result;
  {
    CallbackBar bar("tracking", given.quiet);
    result = trackVideos(given.clips, given.folder, models, options, std::ref(bar));
  }
  noteLeftOut(result.left_out, given.quiet);
  for (const VideoTake& take : result.takes) {
    if (!take.had_even_steps)
      printNotice(fmt::format("{}: the video's frame rate varies; taken at {:.2f} Hz", take.name, take.frame_rate_hz),
                  given.quiet);
    if (take.recorder && !given.quiet)
      printText(fmt::format("{}: {} begins {:.3f} s {} it (alike by {:.2f}, elsewhere by {:.2f}){}\n", take.name,
                            given.sound.string(), std::abs(take.recorder->late),
                            take.recorder->late < 0 ? "before" : "after", take.recorder->likeness,
                            take.recorder->likeness_apart, tellDrift(*take.recorder)));
  }
  if (!given.quiet) {
    const std::string size =
        result.takes.empty() ? "" : fmt::format(", outer eye corners {:.1f} mm apart", result.person.eye_corners_mm);
    printText(fmt::format("{} tracked, {} left out ({} done before){}: {}\n", counted(result.takes.size(), "take"),
                          result.left_out.size(), result.kept, size, given.folder.string()));
  }
  return result.takes.empty() && result.kept == 0 ? kExitBadInput : kExitDone;
}

void addOptions(CLI::App& command, TrackArguments& options) {
  command.add_option("clips", options.clips, "Videos of one person speaking, any that ffmpeg opens")->required();
  command.add_option("--out,-o", options.folder, "Folder for NAME.c3d and NAME.wav, as `corpus build` reads them")
      ->required();
  command
      .add_option("--eye-corners-mm", options.options.eye_corners_mm,
                  "Size of the face; default: from the size of the irises")
      ->check(CLI::Range(40.0, 140.0));
  command.add_flag("--plain", options.options.plain_markers, "Markers just as the tracker gives them");
  command.add_flag("--again", options.options.again, "Track also what is done already");
  command.add_option("--least-seen", options.options.least_seen, "Share of a clip's images that must show a face")
      ->capture_default_str()
      ->check(CLI::Range(0.1, 1.0));
  command.add_option("--sound-rate-hz", options.options.sound_rate_hz, "Of the sound written")
      ->capture_default_str()
      ->check(CLI::Range(8000, 96000));
  command.add_option("--sound", options.sound,
                     "What a recorder beside the cameras heard, all clips in one file: found by each clip's own sound "
                     "(else by the lips), and taken for it");
  addLayoutOption(command, options.layout);
  addJobsOption(command, options.options.jobs);
}

}  // namespace

Command trackCommand() {
  return makeCommand("track", "Videos of a speaking face -> takes, by following the face (MediaPipe's networks)",
                     "corpus track clips/*.mp4 --out takes\ncorpus build takes --out mine.corpus", addOptions,
                     runTrack);
}

}  // namespace mouthpiece
