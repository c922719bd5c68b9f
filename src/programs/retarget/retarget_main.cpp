// retarget: fits a face mesh to an actor's markers, moves it with motion, judges the fit, makes the sample face.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "base/errors.h"
#include "base/files.h"
#include "programs/program.h"
#include "programs/retarget/commands.h"
#include "retarget/sample_head/default_face.h"
#include "retarget/rig/face_fit.h"
#include "retarget/placing/face_page.h"
#include "units/file/corpus.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr std::uint64_t kMaxAnchorBytes = 16 << 20;
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
          .surface = surfacePlanOf(corpus.layout),
          .actor_neutral_mm = corpus.neutral_pose_mm,
          .actor_closed_lips_mm = closedLipsMm(corpus),
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
          {"way_between_lips", check.binding.way_between_lips},
          {"largest_offset_mm", check.binding.largest_offset},
          {"landmark_rms_mm", check.landmark_rms_mm},
          {"landmark_max_mm", check.landmark_max_mm},
          {"leave_one_out_rms_mm", check.leave_one_out_rms_mm},
          {"marker_to_surface_max_mm", check.marker_to_surface_max_mm},
          {"farthest_marker", check.farthest_marker},
          {"kernel", nameOf(check.kernel)},
          {"shape_factor", check.shape_factor},
          {"sampled_points", check.sampled_points},
          {"fold_overs", check.fold_overs},
          {"fold_over_marker", check.fold_over_marker},
          {"patch_edge_angle_max_deg", check.patch_edge_angle_max_deg},
          {"faults", faultsOf(check)}};
}

std::string textOf(const FaceFile& face, const FaceCheck& check) {
  std::string text = fmt::format(
      "{}: {} vertices, {} markers, actor of {}\n"
      "  landmark error     {:.2e} mm at most, left out one by one {:.2f} mm RMS ({}, shape {:.2f})\n"
      "  markers on skin    {:.2f} mm off at most ({})\n"
      "  fold-overs         {} of {} points\n"
      "  bound              {} vertices, {:.1f} % of the face, {:.1f} mm off the control surface at most\n"
      "  across the lips    {} vertices\n"
      "  patch edges        {:.3g} degrees at most\n",
      face.name, check.binding.vertices, check.markers, face.corpus, check.landmark_max_mm, check.leave_one_out_rms_mm,
      nameOf(check.kernel), check.shape_factor, check.marker_to_surface_max_mm, check.farthest_marker, check.fold_overs,
      check.sampled_points, check.binding.bound_vertices, 100 * check.binding.coverage, check.binding.largest_offset,
      check.binding.lip_side_errors, check.patch_edge_angle_max_deg);
  for (const std::string& fault : faultsOf(check)) text += "  fault: " + fault + "\n";
  return text;
}

json factsOf(const ClosureCheck& check) {
  return {{"closures", check.closures},
          {"touching", check.touching},
          {"other_phones", check.others},
          {"other_phones_touching", check.others_touching},
          {"gap_median_mm", check.gap_median_mm},
          {"gap_p95_mm", check.gap_p95_mm},
          {"overlap_mm", check.overlap_mm},
          {"overlap_at_rest_mm", check.overlap_at_rest_mm},
          {"in_teeth_mm", check.in_teeth_mm},
          {"in_teeth_at_rest_mm", check.in_teeth_at_rest_mm},
          {"poses", check.poses},
          {"patch_edge_angle_max_deg", check.patch_edge_angle_max_deg}};
}

std::string textOf(const ClosureCheck& check) {
  return fmt::format(
      "  closures           {} of {} touch within {} mm; gap {:.2f} mm median, {:.2f} mm at 95 %\n"
      "  other phones       {} of {} touch at their widest\n"
      "  lips               {:.2f} mm inside each other at most ({:.2f} at rest), {:.2f} mm inside teeth ({:.2f})\n"
      "  patch edges        {:.3g} degrees at most in {} captured poses\n",
      check.touching, check.closures, kTouchMm, check.gap_median_mm, check.gap_p95_mm, check.others_touching,
      check.others, check.overlap_mm, check.overlap_at_rest_mm, check.in_teeth_mm, check.in_teeth_at_rest_mm,
      check.patch_edge_angle_max_deg, check.poses);
}

/// Facts, and what is wrong, on stdout.
void report(const FaceFile& face, const FaceCheck& check, const CommandLine& line,
            const std::optional<ClosureCheck>& closures = {}) {
  if (line.json) {
    json facts = factsOf(face, check);
    if (closures) facts["captured_closures"] = factsOf(*closures);
    printJson(facts);
  } else if (!line.quiet) {
    printText(textOf(face, check) + (closures ? textOf(*closures) : ""));
  }
}

int fit(const CommandLine& line) {
  const Corpus corpus = readCorpus(line.corpus);
  const std::string bytes = readFile(line.mesh);
  FaceMesh mesh = parseFaceMesh(bytes, line.mesh);
  const Anchors anchors = parseAnchors(readFile(line.anchors, kMaxAnchorBytes), line.anchors.string());
  FitRequest request = requestFor(line, corpus);
  if (request.name.empty()) request.name = line.mesh.stem().string();
  request.warp.any_kernel = line.kernel == "auto";
  request.warp.kernel = kernelFromName(line.kernel).value_or(RbfKernel::kInverseMultiquadric);
  request.mesh_file = meshNameIn(line.out, line.mesh);
  request.mesh_sha256 = sha256Hex(bytes);
  const FaceFile face = fitFace(mesh, anchors, line.anchors.string(), request);
  const FaceCheck check = checkFace(face, mesh);
  writeFaceFile(line.out, face);
  if (!line.show.empty()) {
    std::map<std::string, Eigen::Vector3d> places;
    for (std::size_t i = 0; i < face.marker_names.size(); ++i)
      places[face.marker_names[i]] = face.marker_targets.row(static_cast<Eigen::Index>(i)).transpose();
    writeFileAtomically(line.show, facePage(mesh, face.name, places, {}));
  }
  report(face, check, line);
  return kExitDone;
}

/// Writes a page to click the anchors on.
int pick(const CommandLine& line) {
  const FaceMesh mesh = readFaceMesh(line.mesh);
  const fs::path out = line.out.empty() ? fs::path(line.mesh.stem().string() + ".pick.html") : line.out;
  writeFileAtomically(out, facePage(mesh, line.mesh.stem().string(), {}, suggestedAnchors()));
  if (!line.quiet)
    printText(fmt::format("Open {} in a browser, click the {} anchors, save them.\n", out.string(),
                          suggestedAnchors().size()));
  return kExitDone;
}

int check(const CommandLine& line) {
  const FaceFile face = readFaceFile(line.face);
  const FaceMesh mesh = readMeshOf(face, line.face);
  checkBinding(face.binding, mesh, face.control, line.face.string());
  const FaceCheck found = checkFace(face, mesh);
  std::optional<ClosureCheck> closures;
  if (!line.corpus.empty())
    closures = checkClosures(FaceRig::load(line.face), face.control, readCorpus(line.corpus), line.quiet || line.json);
  report(face, found, line, closures);
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

void addWarpOptions(CLI::App& app, CommandLine& line) {
  app.add_option("--kernel", line.kernel,
                 "The warp's kernel; auto: the one with the least error at markers that are left out")
      ->check(CLI::IsMember({"auto", "inverse_multiquadric", "biharmonic", "triharmonic"}))
      ->capture_default_str();
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
  fitting->add_option("--mesh", line.mesh, "OBJ, PLY, OFF or GLB, in any unit and turned any way")->required();
  fitting
      ->add_option("--anchors", line.anchors,
                   "JSON: marker names to vertex numbers or points; all markers, or at least 8")
      ->required();
  fitting->add_option("--corpus", line.corpus, "Corpus whose actor shall move the face")->required();
  fitting->add_option("--out", line.out, "The .face file to write")->required();
  fitting->add_option("--name", line.name, "Name of the face (default: the mesh file's)");
  fitting->add_option("--show", line.show, "Also write a page that shows the markers on the face (.html)");
  addWarpOptions(*fitting, line);
  addJsonFlag(*fitting, line.json);
  setExample(*fitting,
             "retarget fit --mesh head.obj --anchors head.anchors.json --corpus sample.corpus --out head.face");

  CLI::App* picking = command("pick", "Write a page to click the anchors on", pick);
  picking->add_option("MESH", line.mesh, "OBJ, PLY, OFF or GLB")->required();
  picking->add_option("--out", line.out, "The page (default: MESH's name with .pick.html)");
  setExample(*picking, "retarget pick head.obj");

  CLI::App* applying = command("apply", "Move a fitted face with motion", applyCommand);
  applying->add_option("--face", line.face, "Made by `retarget fit`")->required();
  applying->add_option("--motion", line.motion, "Marker motion, head still: .c3d .csv .trc")->required();
  applying->add_option("--out", line.out, ".glb .pc2 .mdd, .csv (Live Link Face), or a folder for one OBJ a frame")
      ->required();
  applying->add_flag("--arkit", line.arkit,
                     "Animate the ARKit shapes of the GLB that the face was fitted to, instead of shapes of its own");
  applying->add_option("--corpus", line.corpus,
                       "Corpus of the actor who moves, when it is another than the face was fitted with");
  applying->add_option("--phones", line.phones,
                       "Labels of what is said (.TextGrid .lab .phn ...): lips stick in B P M alone, the tongue moves");
  setExample(*applying, "retarget apply --face head.face --motion motion.c3d --out talk.glb");

  CLI::App* checking = command("check", "Judge a fitted face; exit code 1 when it has a fault", check);
  checking->add_option("FACE", line.face, "Made by `retarget fit`")->required();
  checking->add_option("--corpus", line.corpus, "Also play this corpus' closures on the face and look at the lips");
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
