// retarget apply: a fitted face moved by motion, as GLB, point caches or ARKit curves.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <optional>

#include "base/errors.h"
#include "base/files.h"
#include "base/index.h"
#include "exports/arkit.h"
#include "exports/format_bytes.h"
#include "exports/gltf/glb.h"
#include "exports/shapes/principal_shapes.h"
#include "motion/formats/motion_file.h"
#include "motion/resample.h"
#include "phonetics/labels/label_files.h"
#include "programs/retarget/commands.h"
#include "retarget/rig/face_file.h"
#include "retarget/rig/face_rig.h"
#include "synthesis/lips.h"
#include "synthesis/tongue.h"
#include "units/file/corpus.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

/// Vertex positions of all frames are held at once.
constexpr double kMaxAnimationBytes = 6e9;
constexpr std::uint64_t kMaxMeshBytes = std::uint64_t{1} << 30;

struct Arguments {
  fs::path face, motion, out, corpus, phones;
  bool arkit = false, quiet = false;
};

/// A motion in another place than the neutral pose would tear the face: head motion was left in, or it is another
/// actor's.
void refuseFarMotion(const MotionClip& motion, const std::vector<std::string>& names, const MarkerPositions& neutral,
                     const fs::path& file) {
  constexpr double kFarMm = 25;
  double sum = 0;
  double count = 0;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto marker = motion.findMarker(names[i]);
    if (!marker) continue;
    for (Eigen::Index frame = 0; frame < motion.positions_mm.rows(); ++frame) {
      const Eigen::RowVector3d place =
          motion.positions_mm.block<1, 3>(frame, 3 * signedIndex(marker->value));
      if (!place.allFinite()) continue;
      sum += (place - neutral.row(signedIndex(i))).squaredNorm();
      count += 1;
    }
  }
  const double rms = count > 0 ? std::sqrt(sum / count) : 0;
  if (rms > kFarMm) {
    throw InputError(file.string(), "",
                     fmt::format("lies {:.0f} mm from the actor's neutral pose; expected motion with the head still "
                                 "(`corpus clean`), of the actor whom --corpus names",
                                 rms));
  }
}

/// What the phones tell of a motion's frames; where they are not known lips stick wherever they touch.
struct SpokenFrames {
  std::vector<TonguePose> tongue;  ///< a frame each
  std::vector<LipPose> lips;       ///< FaceRig::retarget's; none: not known
};

SpokenFrames spokenFrames(const fs::path& phones, const MotionClip& motion) {
  SpokenFrames frames{std::vector<TonguePose>(motion.frameCount()), {}};
  if (phones.empty()) return frames;
  const SpeechLabels labels = readLabels(phones);
  const std::vector<Seconds> times = frameTimes(0, motion.frameCount(), motion.frame_rate_hz);
  frames.tongue = tongueFromPhones(labels, times);
  frames.lips = lipsFromPhones(labels, times);
  return frames;
}

FaceAnimation animate(const FaceRig& rig, const FaceMotion& motion, std::span<const TonguePose> tongue,
                      double frame_rate_hz, bool quiet) {
  const double bytes =
      12.0 * asReal(motion.frameCount()) * asReal(rig.mesh().vertices.rows());
  if (bytes > kMaxAnimationBytes) {
    throw InputError(fmt::format("{} frames of {} vertices need {:.1f} GB; expected at most {:.0f} (cut the motion)",
                                 motion.frameCount(), rig.mesh().vertices.rows(), bytes / 1e9,
                                 kMaxAnimationBytes / 1e9));
  }
  FaceAnimation animation{frame_rate_hz, {}};
  animation.positions.resize(signedIndex(motion.frameCount()), 3 * rig.mesh().vertices.rows());
  ProgressBar progress("retarget apply", motion.frameCount(), quiet);
  VertexPositions frame;
  for (FrameIndex f; f.value < motion.frameCount(); ++f) {
    rig.deform(motion.pose(f), tongue[f.value], frame);
    animation.positions.row(signedIndex(f.value)) =
        Eigen::Map<const Eigen::RowVectorXf>(frame.data(), frame.size());
    progress.advance();
  }
  return animation;
}

enum class OutputKind { kGlb, kPc2, kMdd, kLiveLink, kObjFolder };

OutputKind outputKind(const fs::path& out) {
  const std::string ending = out.extension().string();
  if (ending == ".glb") return OutputKind::kGlb;
  if (ending == ".pc2") return OutputKind::kPc2;
  if (ending == ".mdd") return OutputKind::kMdd;
  if (ending == ".csv") return OutputKind::kLiveLink;
  if (ending.empty()) return OutputKind::kObjFolder;
  throw InputError(out.string(), "",
                   "expected a name that ends in .glb, .pc2, .mdd or .csv, or a folder for one OBJ a frame");
}

/// Positions as the mesh file has them: a face is fitted upright.
void turnBack(const Eigen::Matrix3d& upright_from_mesh, FaceAnimation& animation) {
  if (upright_from_mesh.isIdentity(0)) return;
  const Eigen::Matrix3f turn = upright_from_mesh.cast<float>();
  for (Eigen::Index v = 0; v < animation.positions.cols() / 3; ++v)
    animation.positions.middleCols<3>(3 * v) = (animation.positions.middleCols<3>(3 * v) * turn).eval();
}

/// ARKit's curves that move the face's own shapes as `animation` moves its vertices.
void writeArkit(const Arguments& given, const FaceFile& face, const FaceMesh& mesh, const FaceAnimation& animation) {
  const fs::path mesh_path = given.face.parent_path() / face.mesh_file;
  const std::string bytes = readFile(mesh_path, kMaxMeshBytes);
  FaceShapes shapes = parseFaceShapes(bytes, mesh_path);
  for (VertexPositions& moves : shapes.moves) moves = (moves * face.upright_from_mesh.cast<float>().transpose()).eval();
  if (shapes.names.empty())
    throw InputError(mesh_path.string(), "", "has no morph targets; expected a GLB with ARKit's shapes");
  const ArkitCurves curves = fitArkit(animation, mesh, shapes);
  writeFileAtomically(given.out, given.out.extension() == ".csv"
                                    ? liveLinkCsv(curves)
                                    : glbWithArkitAnimation(bytes, mesh_path.string(), curves));
  if (!given.quiet) {
    printText(fmt::format("{} of 52 ARKit shapes, {:.2f} mm RMS off the full motion of {:.2f} mm ({:.1f} mm at most)\n",
                          std::count(curves.has_shape.begin(), curves.has_shape.end(), true), curves.rms_error_mm,
                          curves.rms_motion_mm, curves.largest_error_mm));
  }
}

/// The animation as shapes of its own; into the GLB that the face was fitted to, if it was one.
void writeOwnShapes(const Arguments& given, const FaceFile& face, const FaceRig& rig, const FaceAnimation& animation) {
  const PrincipalShapes shapes = principalShapes(animation, rig.mesh().vertices, rig.mesh().metres_per_unit);
  const fs::path mesh_path = given.face.parent_path() / face.mesh_file;
  if (mesh_path.extension() == ".glb") {
    const auto glb =
        glbWithShapes(readFile(mesh_path, kMaxMeshBytes), mesh_path.string(), shapes, face.upright_from_mesh);
    if (glb) return writeFileAtomically(given.out, *glb);
  }
  writeFileAtomically(given.out, glbBytes(rig.mesh(), shapes, rig.name()));
}

int runApply(const Arguments& given) {
  const OutputKind kind = outputKind(given.out);
  if (given.arkit && kind != OutputKind::kGlb && kind != OutputKind::kLiveLink)
    throw InputError(given.out.string(), "", "expected .glb or .csv with --arkit");
  const FaceRig rig = FaceRig::load(given.face);
  const FaceFile face = readFaceFile(given.face);
  const MotionClip motion = readMotion(given.motion);
  MarkerPositions neutral = face.actor_neutral_mm;
  std::vector<std::string> names = face.marker_names;
  std::optional<ActorPose> other;
  if (!given.corpus.empty()) {
    const Corpus corpus = readCorpus(given.corpus);
    names = corpus.layout.markerNames();
    neutral = corpus.neutral_pose_mm;
    other = ActorPose{MarkerPositions::Zero(signedIndex(motion.markerCount()), 3), closedLipsMm(corpus)};
    for (std::size_t i = 0; i < names.size(); ++i) {
      if (const auto marker = motion.findMarker(names[i])) {
        other->neutral_mm.row(signedIndex(marker->value)) = neutral.row(signedIndex(i));
      }
    }
  }
  refuseFarMotion(motion, names, neutral, given.motion);
  const SpokenFrames spoken = spokenFrames(given.phones, motion);
  const FaceMotion face_motion = rig.retarget(motion, other ? &*other : nullptr, spoken.lips);
  FaceAnimation animation = animate(rig, face_motion, spoken.tongue, motion.frame_rate_hz, given.quiet);
  const bool is_arkit = given.arkit || kind == OutputKind::kLiveLink;
  if (!is_arkit && kind != OutputKind::kGlb) turnBack(face.upright_from_mesh, animation);
  switch (kind) {
    case OutputKind::kLiveLink:
      writeArkit(given, face, rig.mesh(), animation);
      break;
    case OutputKind::kGlb:
      is_arkit ? writeArkit(given, face, rig.mesh(), animation) : writeOwnShapes(given, face, rig, animation);
      break;
    case OutputKind::kPc2:
      writeFileAtomically(given.out, pc2Bytes(animation));
      break;
    case OutputKind::kMdd:
      writeFileAtomically(given.out, mddBytes(animation));
      break;
    case OutputKind::kObjFolder:
      objFrames(rig.mesh(), animation, [&](std::size_t frame, const std::string& bytes) {
        writeFileAtomically(given.out / fmt::format("{}.{:04}.obj", rig.name(), frame), bytes);
      });
      break;
  }
  if (!given.quiet)
    printText(fmt::format("{} frames on '{}' -> {}\n", motion.frameCount(), rig.name(), given.out.string()));
  return kExitDone;
}

void addOptions(CLI::App& command, Arguments& options) {
  command.add_option("--face", options.face, "Made by `retarget fit`")->required();
  command.add_option("--motion", options.motion, "Marker motion, head still: .c3d .csv .trc")->required();
  command.add_option("--out", options.out, ".glb .pc2 .mdd, .csv (Live Link Face), or a folder for one OBJ a frame")
      ->required();
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
