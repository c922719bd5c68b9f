// retarget: fits a face mesh to an actor's markers, moves it with motion, judges the fit, makes the sample face.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "base/errors.h"
#include "base/files.h"
#include "exports/glb_writer.h"
#include "exports/point_cache.h"
#include "exports/principal_shapes.h"
#include "motion/motion_file.h"
#include "programs/program.h"
#include "retarget/default_face.h"
#include "retarget/face_fit.h"
#include "retarget/face_rig.h"
#include "units/corpus.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr std::uint64_t kMaxAnchorBytes = 16 << 20;
/// Vertex positions of all frames are held at once.
constexpr double kMaxAnimationBytes = 6e9;

struct CommandLine {
  fs::path mesh, anchors, corpus, out, face, motion, canonical;
  WarpOptions warp;
  BindingOptions binding;
  std::string name;
  bool quiet = false;
  bool json = false;
};

/// `mesh` as the `.face` file at `face_path` names it: relative, so that both can be moved together.
std::string meshNameIn(const fs::path& face_path, const fs::path& mesh) {
  const fs::path folder = fs::absolute(face_path).lexically_normal().parent_path();
  const fs::path relative = fs::absolute(mesh).lexically_normal().lexically_relative(folder);
  return relative.empty() ? fs::absolute(mesh).string() : relative.string();
}

FitRequest requestFor(const CommandLine& line, const Corpus& corpus) {
  return {.name = line.name,
          .mesh_file = "",
          .mesh_sha256 = "",
          .corpus = corpus.name,
          .marker_names = corpus.layout.markerNames(),
          .actor_neutral_mm = corpus.neutral_pose_mm,
          .warp = line.warp,
          .binding = line.binding};
}

json factsOf(const FaceFile& face, const FaceCheck& check) {
  return {{"name", face.name},
          {"mesh", face.mesh_file},
          {"corpus", face.corpus},
          {"metres_per_unit", face.metres_per_unit},
          {"markers", check.markers},
          {"vertices", check.binding.vertices},
          {"bound_vertices", check.binding.bound_vertices},
          {"coverage", check.binding.coverage},
          {"lip_side_errors", check.binding.lip_side_errors},
          {"largest_offset_mm", check.binding.largest_offset},
          {"landmark_rms_mm", check.landmark_rms_mm},
          {"landmark_max_mm", check.landmark_max_mm},
          {"leave_one_out_rms_mm", check.leave_one_out_rms_mm},
          {"marker_to_surface_max_mm", check.marker_to_surface_max_mm},
          {"farthest_marker", check.farthest_marker},
          {"shape_factor", check.shape_factor},
          {"sampled_points", check.sampled_points},
          {"fold_overs", check.fold_overs},
          {"patch_edge_angle_max_deg", check.patch_edge_angle_max_deg},
          {"faults", faultsOf(check)}};
}

std::string textOf(const FaceFile& face, const FaceCheck& check) {
  std::string text = fmt::format(
      "{}: {} vertices, {} markers, actor of {}\n"
      "  landmark error     {:.2e} mm at most, left out one by one {:.2f} mm RMS (shape {:.2f})\n"
      "  markers on skin    {:.2f} mm off at most ({})\n"
      "  fold-overs         {} of {} points\n"
      "  bound              {} vertices, {:.1f} % of the face, {:.1f} mm off the control surface at most\n"
      "  across the lips    {} vertices\n"
      "  patch edges        {:.3g} degrees at most\n",
      face.name, check.binding.vertices, check.markers, face.corpus, check.landmark_max_mm, check.leave_one_out_rms_mm,
      check.shape_factor, check.marker_to_surface_max_mm, check.farthest_marker, check.fold_overs, check.sampled_points,
      check.binding.bound_vertices, 100 * check.binding.coverage, check.binding.largest_offset,
      check.binding.lip_side_errors, check.patch_edge_angle_max_deg);
  for (const std::string& fault : faultsOf(check)) text += "  fault: " + fault + "\n";
  return text;
}

/// Facts, and what is wrong, on stdout.
void report(const FaceFile& face, const FaceCheck& check, const CommandLine& line) {
  if (line.json)
    printJson(factsOf(face, check));
  else if (!line.quiet)
    printText(textOf(face, check));
}

int fit(const CommandLine& line) {
  const Corpus corpus = readCorpus(line.corpus);
  const std::string bytes = readFile(line.mesh);
  FaceMesh mesh = parseFaceMesh(bytes, line.mesh);
  const Anchors anchors = parseAnchors(readFile(line.anchors, kMaxAnchorBytes), line.anchors.string());
  FitRequest request = requestFor(line, corpus);
  if (request.name.empty()) request.name = line.mesh.stem().string();
  request.mesh_file = meshNameIn(line.out, line.mesh);
  request.mesh_sha256 = sha256Hex(bytes);
  const FaceFile face = fitFace(mesh, anchors, line.anchors.string(), request);
  const FaceCheck check = checkFace(face, mesh);
  writeFaceFile(line.out, face);
  report(face, check, line);
  return kExitDone;
}

int check(const CommandLine& line) {
  const FaceFile face = readFaceFile(line.face);
  const FaceMesh mesh = readMeshOf(face, line.face);
  checkBinding(face.binding, mesh, face.control, line.face.string());
  const FaceCheck found = checkFace(face, mesh);
  report(face, found, line);
  return faultsOf(found).empty() ? kExitDone : kExitBadInput;
}

int sample(const CommandLine& line) {
  const Corpus corpus = readCorpus(line.corpus);
  const DefaultFace made = makeDefaultFace(readFaceMesh(line.canonical), line.canonical.string());
  const fs::path mesh_path = line.out / "default.obj";
  const std::string bytes = objBytes(made.mesh);
  FaceMesh mesh = parseFaceMesh(bytes, mesh_path);
  FitRequest request = requestFor(line, corpus);
  request.name = "default";
  request.mesh_file = mesh_path.filename().string();
  request.mesh_sha256 = sha256Hex(bytes);
  const FaceFile face = fitFace(mesh, made.anchors, line.canonical.string(), request);
  writeFileAtomically(mesh_path, bytes);
  writeFaceFile(line.out / "default.face", face);
  report(face, checkFace(face, mesh), line);
  return kExitDone;
}

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
          motion.positions_mm.block<1, 3>(frame, 3 * static_cast<Eigen::Index>(marker->value));
      if (!place.allFinite()) continue;
      sum += (place - neutral.row(static_cast<Eigen::Index>(i))).squaredNorm();
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

FaceAnimation animate(const FaceRig& rig, const PositionMatrix& control, double frame_rate_hz, bool quiet) {
  const double bytes = 12.0 * static_cast<double>(control.rows()) * static_cast<double>(rig.mesh().vertices.rows());
  if (bytes > kMaxAnimationBytes) {
    throw InputError(fmt::format("{} frames of {} vertices need {:.1f} GB; expected at most {:.0f} (cut the motion)",
                                 control.rows(), rig.mesh().vertices.rows(), bytes / 1e9, kMaxAnimationBytes / 1e9));
  }
  FaceAnimation animation{frame_rate_hz, {}};
  animation.positions.resize(control.rows(), 3 * rig.mesh().vertices.rows());
  ProgressBar progress("retarget apply", static_cast<std::size_t>(control.rows()), quiet);
  VertexPositions frame;
  for (Eigen::Index f = 0; f < control.rows(); ++f) {
    rig.deform({control.row(f).data(), static_cast<std::size_t>(control.cols())}, TonguePose{}, frame);
    animation.positions.row(f) = Eigen::Map<const Eigen::RowVectorXf>(frame.data(), frame.size());
    progress.advance();
  }
  return animation;
}

enum class OutputKind { kGlb, kPc2, kMdd, kObjFolder };

OutputKind outputKind(const fs::path& out) {
  const std::string ending = out.extension().string();
  if (ending == ".glb") return OutputKind::kGlb;
  if (ending == ".pc2") return OutputKind::kPc2;
  if (ending == ".mdd") return OutputKind::kMdd;
  if (ending.empty()) return OutputKind::kObjFolder;
  throw InputError(out.string(), "",
                   "expected a name that ends in .glb, .pc2 or .mdd, or a folder for one OBJ a frame");
}

int apply(const CommandLine& line) {
  const OutputKind kind = outputKind(line.out);
  const FaceRig rig = FaceRig::load(line.face);
  const FaceFile face = readFaceFile(line.face);
  const MotionClip motion = readMotion(line.motion);
  MarkerPositions neutral = face.actor_neutral_mm;
  std::vector<std::string> names = face.marker_names;
  std::optional<MarkerPositions> other_neutral;
  if (!line.corpus.empty()) {
    const Corpus corpus = readCorpus(line.corpus);
    names = corpus.layout.markerNames();
    neutral = corpus.neutral_pose_mm;
    other_neutral = MarkerPositions::Zero(static_cast<Eigen::Index>(motion.markerCount()), 3);
    for (std::size_t i = 0; i < names.size(); ++i) {
      if (const auto marker = motion.findMarker(names[i])) {
        other_neutral->row(static_cast<Eigen::Index>(marker->value)) = neutral.row(static_cast<Eigen::Index>(i));
      }
    }
  }
  refuseFarMotion(motion, names, neutral, line.motion);
  const PositionMatrix control = rig.retarget(motion, other_neutral ? &*other_neutral : nullptr);
  const FaceAnimation animation = animate(rig, control, motion.frame_rate_hz, line.quiet);
  switch (kind) {
    case OutputKind::kGlb:
      writeGlb(line.out, rig.mesh(), principalShapes(animation, rig.mesh().vertices, rig.mesh().metres_per_unit),
               rig.name());
      break;
    case OutputKind::kPc2:
      writePc2(line.out, animation);
      break;
    case OutputKind::kMdd:
      writeMdd(line.out, animation);
      break;
    case OutputKind::kObjFolder:
      writeObjSequence(line.out, rig.name(), rig.mesh(), animation);
      break;
  }
  if (!line.quiet)
    printText(fmt::format("{} frames on '{}' -> {}\n", motion.frameCount(), rig.name(), line.out.string()));
  return kExitDone;
}

void addWarpOptions(CLI::App& app, CommandLine& line) {
  app.add_option("--shape", line.warp.shape_factor, "Width of the warp's kernel in mean marker spacings; 0 chooses it")
      ->check(CLI::Range(0.0, 100.0))
      ->capture_default_str();
  app.add_option("--smooth", line.warp.regularization, "Regularisation of the warp; 0 meets every marker exactly")
      ->check(CLI::Range(0.0, 1000.0))
      ->capture_default_str();
  app.add_option("--max-angle", line.binding.max_normal_angle_deg,
                 "Largest angle between a vertex' normal and its patch's, degrees")
      ->check(CLI::Range(1.0, 180.0))
      ->capture_default_str();
}

int runRetarget(int argc, char** argv) {
  CLI::App app("Puts captured marker motion on a face mesh.");
  setExample(app,
             "retarget fit --mesh head.obj --anchors head.anchors.json --corpus sample.corpus --out head.face\n"
             "retarget apply --face head.face --motion motion.c3d --out talk.glb\nretarget check head.face");
  app.require_subcommand(1);
  CommandLine line;
  std::function<int()> action;
  const auto command = [&](const char* name, const char* help, int (*run)(const CommandLine&)) {
    CLI::App* sub = app.add_subcommand(name, help);
    addQuietFlag(*sub, line.quiet);
    sub->callback([&action, &line, run] { action = [&line, run] { return run(line); }; });
    return sub;
  };

  CLI::App* fitting = command("fit", "Fit a mesh: place the markers, warp, control surface, binding", fit);
  fitting->add_option("--mesh", line.mesh, "OBJ, PLY, OFF or GLB; upright, facing +Z")->required();
  fitting->add_option("--anchors", line.anchors, "JSON: marker names to vertex numbers or points")->required();
  fitting->add_option("--corpus", line.corpus, "Corpus whose actor shall move the face")->required();
  fitting->add_option("--out", line.out, "The .face file to write")->required();
  fitting->add_option("--name", line.name, "Name of the face (default: the mesh file's)");
  addWarpOptions(*fitting, line);
  addJsonFlag(*fitting, line.json);
  setExample(*fitting,
             "retarget fit --mesh head.obj --anchors head.anchors.json --corpus sample.corpus --out head.face");

  CLI::App* applying = command("apply", "Move a fitted face with motion", apply);
  applying->add_option("--face", line.face, "Made by `retarget fit`")->required();
  applying->add_option("--motion", line.motion, "Marker motion, head still: .c3d .csv .trc")->required();
  applying->add_option("--out", line.out, ".glb .pc2 .mdd, or a folder for one OBJ a frame")->required();
  applying->add_option("--corpus", line.corpus,
                       "Corpus of the actor who moves, when it is another than the face was fitted with");
  setExample(*applying, "retarget apply --face head.face --motion motion.c3d --out talk.glb");

  CLI::App* checking = command("check", "Judge a fitted face; exit code 1 when it has a fault", check);
  checking->add_option("FACE", line.face, "Made by `retarget fit`")->required();
  addJsonFlag(*checking, line.json);
  setExample(*checking, "retarget check head.face");

  CLI::App* sampling = command("sample", "Make the face that comes with Mouthpiece: default.obj, default.face", sample);
  sampling->add_option("--out", line.out, "Folder")->required();
  sampling->add_option("--canonical", line.canonical, "What tools/fetch_canonical_face.sh brings")->required();
  sampling->add_option("--corpus", line.corpus, "Corpus whose actor shall move the face")->required();
  addJsonFlag(*sampling, line.json);
  setExample(*sampling, "retarget sample --out share --canonical canonical_face.obj --corpus sample.corpus");

  return runProgram(app, argc, argv, [&] { return action(); });
}

}  // namespace
}  // namespace mouthpiece

int main(int argc, char** argv) { return mouthpiece::runRetarget(argc, argv); }
