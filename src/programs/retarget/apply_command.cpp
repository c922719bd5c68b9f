// retarget apply: a fitted face moved by motion, as GLB, point caches or ARKit curves.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <memory>
#include <optional>

#include "base/counted.h"
#include "base/errors.h"
#include "base/files.h"
#include "base/index.h"
#include "deform/mesh/mesh_files.h"
#include "deform/mesh/mesh_limits.h"
#include "exports/arkit.h"
#include "exports/format_bytes.h"
#include "motion/formats/motion_file.h"
#include "motion/resample.h"
#include "mouthpiece/save.h"
#include "phonetics/labels/label_files.h"
#include "programs/outputs.h"
#include "programs/retarget/actor_motion.h"
#include "programs/retarget/commands.h"
#include "retarget/rig/face_judge.h"
#include "speaker/speaker_data.h"
#include "synthesis/lips.h"
#include "synthesis/tongue.h"
#include "units/file/corpus.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

struct ApplyArguments {
  fs::path face, motion, out, corpus, phones;
  bool arkit = false, quiet = false;
};

/// Of markers alone a CSV is not asked for here: the motion is one.
bool isLiveLink(const fs::path& out) {
  if (out.extension() != ".csv") return false;
  const std::string_view kind = formatOf(out).usual_name;
  return kind == "motion.csv" || kind == "arkit.csv";
}

/// What motion alone does not give: its sound, and what only a line that was made here has.
bool isOfLine(const Format& format) {
  constexpr std::array<std::string_view, 6> kOfLines{"speech.wav",  "curves.csv",    "curve_frames.csv",
                                                     "curves.json", "ablation.html", "report.json"};
  return std::find(kOfLines.begin(), kOfLines.end(), format.usual_name) != kOfLines.end();
}

/// The motion as a performance of the face, without sound.
std::shared_ptr<Performance::Data> performanceOf(const ApplyArguments& given) {
  auto made = std::make_shared<Performance::Data>();
  made->face.emplace(given.face);
  const FaceFile& face = made->face->data().file;
  MarkerPositions neutral = face.actor_neutral_mm;
  std::vector<std::string> names = face.marker_names;
  std::optional<Corpus> corpus;
  if (!given.corpus.empty()) {
    corpus = readCorpus(given.corpus);
    names = corpus->layout.markerNames();
    neutral = corpus->neutral_pose_mm;
  }
  ActorMotion actor = actorMotion(readMotion(given.motion), names, neutral, corpus ? corpus->layout : defaultLayout(),
                                  given.motion.string());
  for (const std::string& notice : actor.notices) printNotice(notice, given.quiet);
  MotionClip& motion = made->animation.motion;
  motion = std::move(actor.motion);
  if (corpus) {
    made->actor = ActorPose{MarkerPositions::Zero(signedIndex(motion.markerCount()), 3), closedLipsMm(*corpus),
                            unseenRounding(*corpus)};
    for (std::size_t i = 0; i < names.size(); ++i) {
      if (const auto marker = motion.findMarker(names[i]))
        made->actor->neutral_mm.row(marker->row()) = neutral.row(signedIndex(i));
    }
  }
  // Where the phones are not known lips stick wherever they touch.
  made->animation.tongue.resize(motion.frameCount());
  if (!given.phones.empty()) {
    made->animation.labels = readLabels(given.phones);
    const std::vector<Seconds> times = frameTimes(0, motion.frameCount(), motion.frame_rate_hz);
    made->animation.tongue = tongueFromPhones(made->animation.labels, times);
    made->animation.lips = lipsFromPhones(made->animation.labels, times);
  }
  made->animation.audio.sample_rate_hz = 16'000;  // the page's clock is its sound: silence
  return made;
}

/// A fitted face keeps the limits of its judge in speech; what breaks them is told whoever wants to hear it or not.
void tellOfTornSkin(const Performance::Data& performance, const fs::path& motion) {
  const SharedFace::Data& face = performance.needFace();
  constexpr std::size_t kMostFrames = 2000;
  const std::size_t frames = performance.animation.motion.frameCount(), every = frames / kMostFrames + 1;
  const auto fault = mostTorn(face.rig(), face.file, (frames + every - 1) / every,
                              [&](std::size_t k) { return performance.verticesAt(FrameIndex{k * every}); });
  if (!fault) return;
  printNotice(fmt::format("{}: tears the face: {} at {:.2f} s; expected no more than {} {}", motion.string(),
                          fault->what, performance.animation.motion.timeOf(FrameIndex{*fault->pose * every}),
                          limitNamed(fault->limit), fault->limit == "stretch" ? "mm more" : "times"),
              false);
}

/// The shapes of a GLB that the face was fitted to, as it holds them.
FaceShapes shapesOf(const SharedFace::Data& face, const std::string& bytes) {
  return parseFaceShapes(bytes, face.meshPath(), face.file.mesh_object);
}

bool hasArkit(const SharedFace::Data& face) {
  const std::vector<std::string> names = shapesOf(face, readFile(face.meshPath(), kMaxMeshBytes)).names;
  return std::any_of(names.begin(), names.end(), [](const std::string& name) { return arkitIndex(name) >= 0; });
}

/// ARKit's curves that move the face's own shapes as the motion moves its vertices.
void writeArkit(const ApplyArguments& given, const Performance::Data& performance) {
  const SharedFace::Data& face = performance.needFace();
  const fs::path mesh_path = face.meshPath();
  const std::string bytes = readFile(mesh_path, kMaxMeshBytes);
  FaceShapes shapes = shapesOf(face, bytes);
  for (VertexPositions& moves : shapes.moves)
    moves = (moves * face.file.upright_from_mesh.cast<float>().transpose()).eval();
  if (shapes.names.empty())
    throw InputError(mesh_path.string(), "",
                     "has no morph targets; expected a GLB with ARKit's shapes, or --out NAME.arkit.csv, whose weights "
                     "follow the markers where a head has none");
  const ArkitCurves curves = fitArkit(performance.uprightFrames(), face.rig().mesh(), shapes);
  writeFileAtomically(given.out, isLiveLink(given.out)
                                     ? liveLinkCsv(curves)
                                     : glbWithArkitAnimation(bytes, mesh_path.string(), curves, face.file.mesh_object));
  if (!given.quiet) {
    printText(fmt::format("{} of 52 ARKit shapes, {:.2f} mm RMS off the full motion of {:.2f} mm ({:.1f} mm at most)\n",
                          std::count(curves.has_shape.begin(), curves.has_shape.end(), true), curves.rms_error_mm,
                          curves.rms_motion_mm, curves.largest_error_mm));
    printText(fmt::format("lips meet in {}, with the shapes in {} of these; {:.1f} shapes over 0 a frame\n",
                          counted(curves.closures, "frame"), curves.closures_kept,
                          asReal((curves.weights.array() > 0).count()) / std::max(1.0, asReal(curves.weights.rows()))));
  }
}

/// What a motion can be saved as, of all formats.
std::string endings() {
  std::string all;
  for (const Format& format : formats()) {
    if (!isOfLine(format)) all += std::string(format.ending) + " ";
  }
  return all + "(.csv alone: Live Link Face's), or a folder for one OBJ a frame";
}

void refuseUnknownEnding(const ApplyArguments& given) {
  if (given.arkit && given.out.extension() != ".glb" && !isLiveLink(given.out))
    throw InputError(given.out.string(), "", "expected .glb or .csv with --arkit");
  if (given.out.extension().empty() || isLiveLink(given.out)) return;
  const std::string name = given.out.filename().string();
  for (const Format& format : formats()) {
    if (name.ends_with(format.ending) && !isOfLine(format)) return;
    if (name.ends_with(format.ending)) break;  // the longest that fits
  }
  throw InputError(given.out.string(), "", "found an unknown ending; expected " + endings());
}

int runApply(const ApplyArguments& given) {
  refuseUnknownEnding(given);
  const auto performance = performanceOf(given);
  const SharedFace::Data& face = performance->needFace();
  if (isSameFile(given.out, face.meshPath()))
    throw InputError(given.out.string(), "", "is the head that the face was fitted to; expected another name");
  tellOfTornSkin(*performance, given.motion);
  // A head without ARKit's shapes gets weights by the markers where they are asked for by their name, as synth's are.
  const bool by_markers = given.out.filename().string().ends_with("arkit.csv") && !given.arkit && !hasArkit(face);
  if (given.arkit || (isLiveLink(given.out) && !by_markers)) {
    writeArkit(given, *performance);
  } else if (given.out.extension().empty()) {
    objFrames(face.rig().mesh(), performance->frames(), [&](std::size_t frame, const std::string& bytes) {
      writeFileAtomically(given.out / fmt::format("{}.{:04}.obj", face.rig().name(), frame), bytes);
    });
  } else {
    save(Performance(performance), given.out);
  }
  if (!given.quiet)
    printText(fmt::format("{} on '{}' -> {}\n", counted(performance->animation.motion.frameCount(), "frame"),
                          face.rig().name(), given.out.string()));
  return kExitDone;
}

void addOptions(CLI::App& command, ApplyArguments& options) {
  command.add_option("--face", options.face, "Made by `retarget fit`")->required();
  command.add_option("--motion", options.motion, "Marker motion: .c3d .csv .trc; a head that moves is held still")
      ->required();
  command.add_option("-o,--out", options.out, endings())->required();
  checkOutputs(command, {{"--out"}});
  command.add_flag("--arkit", options.arkit,
                   "Animate the ARKit shapes of the GLB that the face was fitted to, instead of shapes of its own");
  command.add_option("--corpus", options.corpus,
                     "Corpus of the actor who moves, when it is another than the face was fitted with");
  command.add_option("--phones", options.phones,
                     "Labels of what is said (.TextGrid .lab .phn ...): lips stick in B P M alone, the tongue moves");
}

}  // namespace

Command applyCommand() {
  return makeCommand("apply", "Move a fitted face with motion",
                     "retarget apply --face head.face --motion motion.c3d --out talk.glb", addOptions, runApply);
}

}  // namespace mouthpiece
