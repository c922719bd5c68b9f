#include <fmt/format.h>

#include <cmath>
#include <optional>
#include <vector>

#include "audio/audio_clip.h"
#include "base/errors.h"
#include "base/files.h"
#include "corpus_tools/takes/lip_sync.h"
#include "corpus_tools/takes/sound_sync.h"
#include "deform/mesh/face_mesh.h"
#include "deform/mesh/mesh_limits.h"
#include "exports/arkit.h"
#include "motion/formats/motion_file.h"
#include "motion/lip_gauge.h"
#include "motion/position_limits.h"
#include "phonetics/labels/label_files.h"
#include "programs/corpus/command_support.h"
#include "programs/corpus/commands.h"
#include "programs/outputs.h"
#include "retarget/rig/face_fit.h"
#include "speaker/shared_files.h"
#include "units/file/corpus.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

struct ArkitTakeOptions {
  std::filesystem::path head;     ///< GLB with ARKit's shapes, or a .face that was fitted to one
  std::filesystem::path anchors;  ///< of a GLB; empty: the anchors or landmarks file beside it
  double frame_rate_hz = 0;       ///< 0: the file's time code
};

struct ArkitTake {
  MotionClip motion;
  bool left_head_out = false;  ///< the file turns the head
};

constexpr std::uint64_t kMaxAnchorBytes = 64 << 20;
constexpr std::uint64_t kMaxTrackBytes = std::uint64_t{1} << 30U;
constexpr Seconds kLongestSound = 3600;

/// A head with its markers placed.
struct PlacedHead {
  FaceMesh mesh;  ///< upright
  FaceShapes shapes;
  std::vector<std::string> marker_names;
  MarkerPositions places;  ///< mesh unit
};

FaceShapes shapesOf(std::string_view bytes, const fs::path& path, const Eigen::Matrix3d& upright_from_mesh,
                    std::string_view object = {}) {
  FaceShapes shapes = parseFaceShapes(bytes, path, object);
  for (VertexPositions& moves : shapes.moves) moves = (moves * upright_from_mesh.cast<float>().transpose()).eval();
  return shapes;
}

PlacedHead headOfFace(const fs::path& path) {
  const FaceFile face = readFaceFile(path);
  const fs::path mesh_path = path.parent_path() / face.mesh_file;
  return {readMeshOf(face, path),
          shapesOf(readFile(mesh_path, kMaxMeshBytes), mesh_path, face.upright_from_mesh, face.mesh_object),
          face.marker_names, face.marker_targets};
}

/// HEAD.anchors.json or HEAD.landmarks.json; else the only file with such an ending in the folder.
fs::path anchorsBeside(const fs::path& head) {
  std::vector<fs::path> others;
  for (const char* ending : {".anchors.json", ".landmarks.json"}) {
    const fs::path own = fs::path(head).replace_extension().string() + ending;
    if (fs::exists(own)) return own;
    std::error_code error;
    const fs::path folder = head.has_parent_path() ? head.parent_path() : fs::path(".");
    for (const auto& entry : fs::directory_iterator(folder, error)) {
      if (entry.path().string().ends_with(ending)) others.push_back(entry.path());
    }
  }
  if (others.size() == 1) return others.front();
  throw InputError(head.string(), "", "has no anchors beside it; expected --anchors FILE, or a .face fitted to it");
}

/// The markers that have no anchor are placed as `retarget fit` does, by the sample corpus' actor.
PlacedHead headOfGlb(const ArkitTakeOptions& options) {
  const fs::path anchors_path = options.anchors.empty() ? anchorsBeside(options.head) : options.anchors;
  Anchors anchors = parseAnchors(readFile(anchors_path, kMaxAnchorBytes), anchors_path.string());
  anchors.metres_per_unit.reset();  // of another file of the head: a GLB tells by its size
  const std::string bytes = readFile(options.head, kMaxMeshBytes);
  PlacedHead head{.mesh = parseFaceMesh(bytes, options.head), .shapes = {}, .marker_names = {}, .places = {}};
  const Corpus actor = readCorpus(findSharedFile("sample.corpus", "make it with `make`"));
  FitRequest request;
  request.marker_names = actor.layout.markerNames();
  request.actor_neutral_mm = actor.neutral_pose_mm;
  const FaceFile face = fitFace(head.mesh, anchors, anchors_path.string(), request);
  head.shapes = shapesOf(bytes, options.head, face.upright_from_mesh);
  head.marker_names = face.marker_names;
  head.places = face.marker_targets;
  return head;
}

/// Apple's weight of each of the head's shapes, frames x shapes; shapes that Apple has not rest.
Eigen::MatrixXd weightsOf(const ArkitTrack& track, const std::vector<std::string>& shapes, const std::string& head) {
  Eigen::MatrixXd weights = Eigen::MatrixXd::Zero(track.weights.rows(), signedIndex(shapes.size()));
  bool has_any = false;
  for (std::size_t s = 0; s < shapes.size(); ++s) {
    const int shape = arkitIndex(shapes[s]);
    if (shape < 0) continue;
    has_any = true;
    weights.col(signedIndex(s)) = track.weights.col(shape).cast<double>();
  }
  if (has_any) return weights;
  throw InputError(head, "",
                   fmt::format("has {} shapes, none with an ARKit name; expected a GLB with shapes such as jawOpen and "
                               "mouthSmile_L",
                               shapes.size()));
}

/// Live Link Face's CSV as markers: its weights move the head's shapes, and the layout's markers ride on the head's
/// skin. The head is still, as a corpus would make it again. Throws InputError.
ArkitTake readArkitTake(const fs::path& csv, const MarkerLayout& layout, const ArkitTakeOptions& options) {
  const ArkitTrack track = parseLiveLinkCsv(readFile(csv, kMaxTrackBytes), csv.string(), options.frame_rate_hz);
  expectFrameRate(track.frame_rate_hz, csv.string(), "");
  const PlacedHead head = options.head.extension() == ".face" ? headOfFace(options.head) : headOfGlb(options);
  const MarkerShapes shapes = markerShapes(head.mesh, head.shapes, head.places, options.head.string());
  const MotionClip driven{track.frame_rate_hz, head.marker_names,
                          drivenMarkers(shapes, weightsOf(track, shapes.names, options.head.string()))};
  for (const LayoutMarker& marker : layout.markers) {
    if (!driven.findMarker(marker.name))
      throw InputError(options.head.string(), marker.name,
                       "is not on this head; expected a .face fitted with a corpus of the layout");
  }
  return {selectMarkers(driven, layout.markerNames()), track.turns_head};
}

struct ConvertArguments {
  bool quiet = false;
  std::filesystem::path input, output, layout, sound, own_sound;
  std::optional<Seconds> sound_late, clap_at;
  std::vector<std::string> renamed;
  LandmarkTrackOptions track;
  ArkitTakeOptions arkit;
};

bool isLandmarkTrack(const std::filesystem::path& path) { return path.extension() == ".json"; }

MotionClip readTrack(const ConvertArguments& given) {
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

MotionClip readInput(const ConvertArguments& given) {
  MotionClip clip = readTrack(given);
  renameMarkers(clip, markerMapFrom(given.renamed, given.layout));
  return clip;
}

/// Where the sound lies beside the motion: as told, by the clap, by the device's own sound, or by the lips. Says which.
SoundPlace placeBeside(const MotionClip& motion, const AudioClip& sound, const ConvertArguments& given) {
  if (given.sound_late) return {.late = *given.sound_late};
  const auto tell = [&](Seconds late, std::string_view how) {
    return fmt::format("the sound begins {:.3f} s {} the motion ({})", std::abs(late), late < 0 ? "before" : "after",
                       how);
  };
  if (given.clap_at) {
    const std::optional<Seconds> clap = clapIn(sound);
    if (!clap)
      throw InputError(given.sound.string(), "",
                       "holds no clap that is sharp and loud as nothing else; cut it to one, or give --sound-late");
    if (!given.quiet) printText(tell(*given.clap_at - *clap, fmt::format("clap at {:.3f} s of it", *clap)) + "\n");
    return {.late = *given.clap_at - *clap};
  }
  const bool by_own_sound = !given.own_sound.empty();
  const SoundPlace place = by_own_sound ? placeOfSameSound(readAudio(given.own_sound, {.most = kLongestSound}), sound)
                                        : placeOfSound(motion, sound, LipGauge(motion.marker_names));
  const std::string found = tell(place.late, fmt::format("{} agree to {:.2f}, elsewhere to {:.2f}",
                                                         by_own_sound ? "both sounds" : "lips and loudness",
                                                         place.likeness, place.likeness_apart));
  if (!place.is_sure)
    throw InputError(given.sound.string(), "", "perhaps " + found + "; that is not sure, give it with --sound-late");
  if (!given.quiet) printText(found + tellDrift(place) + "\n");
  return place;
}

/// Writes NAME.wav beside the motion NAME.c3d.
void writeSoundBeside(const MotionClip& motion, const ConvertArguments& given) {
  const fs::path file = fs::path(given.output).replace_extension(".wav");
  for (const fs::path& read : {given.sound, given.own_sound}) {
    if (isSameFile(file, read))
      throw InputError(file.string(), "",
                       "would be written over what is read; expected another name for the motion, or for it");
  }
  const AudioClip sound = readAudio(given.sound, {.most = kLongestSound});
  const SoundPlace place = placeBeside(motion, sound, given);
  writeWav(file, soundBeside(motion.duration(), sound, place.late, place.drift.value_or(0)));
}

int runConvert(const ConvertArguments& given) {
  if (isLabelFileName(given.output)) {
    writeLabels(given.output, readLabels(given.input), {.name = given.output.stem().string()});
    return kExitDone;
  }
  const MotionClip motion = readInput(given);
  FilesTogether files;
  writeMotionWithEvents(given.output, motion, given.input);
  if (!given.sound.empty()) writeSoundBeside(motion, given);
  files.commit();
  return kExitDone;
}

void addOptions(CLI::App& command, ConvertArguments& options) {
  command.add_option("in", options.input, "What to read")->required();
  command.add_option("out", options.output, "What to write")->required();
  checkOutputs(command, {{"out"}});
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
  CLI::Option* sound = command.add_option("--sound", options.sound,
                                          "Sound that another device recorded: laid beside the motion by the lips, and "
                                          "written as NAME.wav from its first frame on");
  CLI::Option* late =
      command
          .add_option("--sound-late", options.sound_late, "By so many seconds it begins after the motion, if you know")
          ->needs(sound)
          ->check(CLI::Range(-3600.0, 3600.0));
  CLI::Option* clap =
      command
          .add_option("--clap-at", options.clap_at,
                      "Seconds after the motion's first frame at which hands clap: laid there is the sound's clap")
          ->needs(sound)
          ->excludes(late)
          ->check(CLI::Range(0.0, 3600.0));
  command
      .add_option("--own-sound", options.own_sound,
                  "What the motion's own device heard from its first frame on: laid beside by it, not by the lips")
      ->needs(sound)
      ->excludes(late)
      ->excludes(clap);
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
