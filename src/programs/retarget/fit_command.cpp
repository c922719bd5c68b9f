// retarget fit: places an actor's markers on a mesh and binds it to them.
#include <CLI/CLI.hpp>

#include "base/files.h"
#include "base/index.h"
#include "programs/retarget/commands.h"
#include "retarget/placing/face_page.h"
#include "units/file/corpus.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMaxAnchorBytes = 16 << 20;

struct Arguments {
  fs::path mesh, anchors, corpus, out, show, save_anchors;
  std::string name, kernel = "auto";
  WarpOptions warp;
  BindingOptions binding;
  bool quiet = false, json = false;
};

/// `mesh` as the `.face` file at `face_path` names it: relative, so that both can be moved together.
std::string meshNameIn(const fs::path& face_path, const fs::path& mesh) {
  const fs::path folder = fs::absolute(face_path).lexically_normal().parent_path();
  const fs::path relative = fs::absolute(mesh).lexically_normal().lexically_relative(folder);
  return relative.empty() ? fs::absolute(mesh).string() : relative.string();
}

/// All markers and both lips' rims as the fit has placed them, in the frame of `mesh`, which stands upright; `given` keeps
/// what else it says, and the vertices that have stayed.
Anchors placedOn(const FaceFile& face, FaceMesh& mesh, const Anchors& given, const std::string& file) {
  constexpr double kStill = 1e-5;  // of the mouth's width
  turnMesh(face.upright_from_mesh.transpose(), mesh);
  Anchors placed = given;
  for (std::size_t i = 0; i < face.control.points.size(); ++i) {
    const ControlPoint& point = face.control.points[i];
    if (point.rule != PointRule::kMarker && point.rule != PointRule::kInnerLip) continue;
    const Eigen::Vector3d place = face.upright_from_mesh.transpose() * face.control.rest.row(signedIndex(i)).transpose();
    const auto before = placeOf(given, point.name, mesh, file);
    if (!before || (*before - place).norm() > kStill * face.control.mouth_width) placed.markers[point.name] = place;
  }
  return placed;
}

int runFit(const Arguments& given) {
  const Corpus corpus = readCorpus(given.corpus);
  const std::string bytes = readFile(given.mesh);
  FaceMesh mesh = parseFaceMesh(bytes, given.mesh);
  const Anchors anchors = parseAnchors(readFile(given.anchors, kMaxAnchorBytes), given.anchors.string());
  FitRequest request = fitRequestFor(given.name.empty() ? given.mesh.stem().string() : given.name, corpus);
  request.warp = given.warp;
  request.warp.any_kernel = given.kernel == "auto";
  request.warp.kernel = kernelFromName(given.kernel).value_or(RbfKernel::kInverseMultiquadric);
  request.binding = given.binding;
  request.mesh_file = meshNameIn(given.out, given.mesh);
  request.mesh_sha256 = sha256Hex(bytes);
  const FaceFile face = fitFace(mesh, anchors, given.anchors.string(), request);
  const FaceCheck check = checkFace(face, mesh);
  writeFaceFile(given.out, face);
  if (!given.show.empty() || !given.save_anchors.empty()) {
    const Anchors placed = placedOn(face, mesh, anchors, given.anchors.string());
    if (!given.save_anchors.empty()) writeFileAtomically(given.save_anchors, anchorsBytes(placed));
    if (!given.show.empty()) writeFileAtomically(given.show, facePage(mesh, face.name, placed, {}));
  }
  printFace(face, check, given.json, given.quiet);
  return kExitDone;
}

void addOptions(CLI::App& command, Arguments& options) {
  command.add_option("--mesh", options.mesh, "OBJ, PLY, OFF or GLB, in any unit and turned any way")->required();
  command
      .add_option("--anchors", options.anchors,
                  "JSON: marker names to vertex numbers or points; all markers, or at least 8")
      ->required();
  command.add_option("--corpus", options.corpus, "Corpus whose actor shall move the face")->required();
  command.add_option("--out", options.out, "The .face file to write")->required();
  command.add_option("--name", options.name, "Name of the face (default: the mesh file's)");
  command.add_option("--show", options.show,
                     "Also write a page that shows the markers and the line between the lips, to drag and save (.html)");
  command.add_option("--save-anchors", options.save_anchors,
                     "Also write the anchors with all that was placed, the lips' rims among it (.json)");
  command
      .add_option("--kernel", options.kernel,
                  "The warp's kernel; auto: the one with the least error at markers that are left out")
      ->check(CLI::IsMember({"auto", "inverse_multiquadric", "biharmonic", "triharmonic"}))
      ->capture_default_str();
  command
      .add_option("--shape", options.warp.shape_factor,
                  "Width of the warp's kernel in mean marker spacings; 0 chooses it")
      ->check(CLI::Range(0.0, 100.0))
      ->capture_default_str();
  command
      .add_option("--smooth", options.warp.regularization,
                  "Regularisation of the warp; 0 meets every marker exactly")
      ->check(CLI::Range(0.0, 1000.0))
      ->capture_default_str();
  command
      .add_option("--max-angle", options.binding.max_normal_angle_deg,
                  "Largest angle between a vertex' normal and its patch's, degrees")
      ->check(CLI::Range(1.0, 180.0))
      ->capture_default_str();
  addJsonFlag(command, options.json);
}

}  // namespace

Command fitCommand() {
  return makeCommand("fit", "Fit a mesh: place the markers, warp, control surface, binding",
                     "retarget fit --mesh head.obj --anchors head.anchors.json --corpus sample.corpus --out head.face",
                     addOptions, runFit);
}

}  // namespace mouthpiece
