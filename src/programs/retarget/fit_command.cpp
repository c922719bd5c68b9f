// retarget fit: places an actor's markers on a mesh and binds it to them.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>

#include "base/counted.h"
#include "base/errors.h"
#include "base/files.h"
#include "base/index.h"
#include "deform/mesh/face_mesh.h"
#include "deform/mesh/glb_growth.h"
#include "programs/outputs.h"
#include "programs/retarget/commands.h"
#include "retarget/placing/face_page.h"
#include "retarget/placing/whole_head.h"
#include "retarget/rig/borrowed_mouth.h"
#include "speaker/shared_files.h"
#include "units/file/corpus.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

struct FitArguments {
  fs::path mesh, anchors, corpus, out, show, save_anchors, mouth_parts;
  std::string name, object, kernel = "auto";
  WarpOptions warp;
  BindingOptions binding;
  bool even_if_faulty = false, quiet = false, json = false;
};

/// `mesh` as the `.face` file at `face_path` names it: relative, so that both can be moved together.
std::string meshNameIn(const fs::path& face_path, const fs::path& mesh) {
  const fs::path folder = fs::absolute(face_path).lexically_normal().parent_path();
  const fs::path relative = fs::absolute(mesh).lexically_normal().lexically_relative(folder);
  return relative.empty() ? fs::absolute(mesh).string() : relative.string();
}

/// `head`, upright as `face` has it, with the parts of a mouth that it lacks as the bytes of --mouth-parts, turned as
/// it was given, of `bytes` if that is to be a GLB; empty where it has them all.
std::string withDefaultMouth(const FitArguments& given, const std::string& bytes, const FaceMesh& head,
                             const FaceFile& face, Anchors& anchors) {
  const fs::path donor = findSharedFile("default.face", "make it with `make`");
  auto whole = withBorrowedMouth(head, face, FaceRig::load(donor).mesh(), readFaceFile(donor));
  if (!whole) return "";
  const bool is_glb = isGlb(given.mouth_parts);
  if (!is_glb) whole->mesh = withInsideTold(whole->mesh, head, face);
  for (const MeshPart& part : whole->mesh.parts) anchors.part_kinds[part.name] = part.kind;
  const Eigen::Matrix3d mesh_from_upright = face.upright_from_mesh.transpose();
  turnMesh(mesh_from_upright, whole->mesh);
  if (!is_glb) return objBytes(whole->mesh);
  FaceMesh as_given = head;
  turnMesh(mesh_from_upright, as_given);
  // The numbers of vertices behind those that are added change.
  for (auto& [name, place] : anchors.markers) place = placeOf(anchors, name, as_given, given.anchors.string()).value();
  return grownGlb(bytes, given.mesh.string(), given.object, as_given, *whole);
}

/// An exporter may leave some vertices without a face; many are a file that was cut.
void noteLooseVertices(const FaceMesh& mesh, const FitArguments& given) {
  constexpr std::size_t kOneIn = 100;
  std::vector<bool> is_used(mesh.vertexCount(), false);
  for (const Triangle& triangle : mesh.triangles) {
    for (const std::uint32_t vertex : triangle) is_used[vertex] = true;
  }
  const auto loose = unsignedIndex(std::count(is_used.begin(), is_used.end(), false));
  if (kOneIn * loose > is_used.size())
    printNotice(fmt::format("{}: {} of {} vertices have no face: is the file whole?", given.mesh.string(), loose,
                            is_used.size()),
                given.quiet);
}

/// Some programs number vertices from 1: whether one less brings the anchors nearer to how an actor's markers lie.
bool seemNumberedFromOne(const Anchors& anchors, const FaceMesh& mesh, const FitRequest& actor) {
  constexpr double kNearer = 0.9;
  Anchors lower = anchors;
  for (auto& [name, place] : lower.markers) {
    auto* vertex = std::get_if<std::uint32_t>(&place);
    if (vertex == nullptr || *vertex == 0) return false;
    --*vertex;
  }
  const auto squaresOff = [&](const Anchors& tried) {
    const Similarity mesh_from_actor = meshFromActor(mesh, tried, "", actor.marker_names, actor.actor_neutral_mm);
    double sum = 0;
    for (std::size_t i = 0; i < actor.marker_names.size(); ++i) {
      const auto place = placeOf(tried, actor.marker_names[i], mesh, "");
      if (place)
        sum += (mesh_from_actor(actor.actor_neutral_mm.row(signedIndex(i)).transpose()) - *place).squaredNorm();
    }
    return sum;
  };
  return squaresOff(lower) < kNearer * kNearer * squaresOff(anchors);
}

int runFit(const FitArguments& given) {
  if (!given.mouth_parts.empty()) expectMeshEnding(given.mouth_parts, given.mesh);
  const Corpus corpus = readCorpus(corpusFile(given.corpus));
  std::string bytes = readFile(given.mesh);
  FaceMesh mesh = parseFaceMesh(bytes, given.mesh, given.object);
  noteLooseVertices(mesh, given);
  auto [anchors, anchors_file] = anchorsFor(mesh, bytes, given.mesh, given.object, given.anchors, given.quiet);
  FitRequest request = fitRequestFor(given.name.empty() ? given.mesh.stem().string() : given.name, corpus);
  request.warp = given.warp;
  request.warp.any_kernel = given.kernel == "auto";
  request.warp.kernel = kernelFromName(given.kernel).value_or(RbfKernel::kInverseMultiquadric);
  request.binding = given.binding;
  request.mesh_file = meshNameIn(given.out, given.mesh);
  request.mesh_sha256 = sha256Hex(bytes);
  request.mesh_object = given.object;
  FaceFile face = fitFace(mesh, anchors, anchors_file, request);
  if (!given.mouth_parts.empty()) {
    if (std::string whole = withDefaultMouth(given, bytes, mesh, face, anchors); !whole.empty()) {
      bytes = std::move(whole);
      writeFileAtomically(given.mouth_parts, bytes);
      if (!isGlb(given.mouth_parts)) request.mesh_object.clear();
      mesh = parseFaceMesh(bytes, given.mouth_parts, request.mesh_object);
      request.mesh_file = meshNameIn(given.out, given.mouth_parts);
      request.mesh_sha256 = sha256Hex(bytes);
      face = fitFace(mesh, anchors, anchors_file, request);
    } else {
      printNotice(fmt::format("{}: has teeth, a tongue and a mouth's inside; {} is not written", given.mesh.string(),
                              given.mouth_parts.string()),
                  given.quiet);
    }
  } else if (trianglesOf(mesh, {PartKind::kUpperTeeth, PartKind::kLowerTeeth, PartKind::kTongue}).empty()) {
    printNotice(fmt::format("{}: has no teeth and no tongue; --mouth-parts FILE.{} writes it with the default head's",
                            given.mesh.string(), isGlb(given.mesh) ? "glb" : "obj"),
                given.quiet);
  }
  FaceRig rig = FaceRig::of(face, std::move(mesh), given.out.string());
  FaceReport report = reportOn(face, rig, &corpus);
  report.judgement = mendFace(face, rig, report.poses, report.actor, std::move(report.judgement), request.binding);
  const bool is_faulty = !report.faults().empty();
  if (!is_faulty || given.even_if_faulty) writeFaceFile(given.out, rig.withSetUp(face));
  if (!given.save_anchors.empty()) {
    FaceMesh placed_on = rig.mesh();
    writeFileAtomically(given.save_anchors, anchorsBytes(placedOn(face, placed_on, anchors)));
  }
  fs::path page = given.show;
  if (is_faulty && page.empty()) page = fs::path(given.out).replace_extension(".faults.html");
  if (!page.empty()) writeFacePage(page, face, rig, report, anchors, dressingOf(bytes, request.mesh_file));
  printFace(face, report, given.json, given.quiet);
  if (!is_faulty) return kExitDone;
  printNotice(fmt::format("{}: {} ({} in all; {} shows it); {}", given.out.string(), report.faults().front(),
                          counted(report.faults().size(), "fault"), page.string(),
                          given.even_if_faulty ? "written all the same" : "not written, see --even-if-faulty"),
              false);
  printNotice(fmt::format("{0}: its anchors were found, not clicked: look where they are with `retarget anchors {0} "
                          "--show found.html`",
                          given.mesh.string()),
              !given.anchors.empty());
  printNotice(fmt::format("{}: its anchors lie more as a face's do with one less each: vertices are numbered from 0",
                          given.anchors.string()),
              given.anchors.empty() || !seemNumberedFromOne(anchors, rig.mesh(), request));
  if (const std::string why = whyNoWholeHead(rig.mesh()); !why.empty())
    printNotice(fmt::format("{}: {}", given.mesh.string(), why), false);
  return kExitBadInput;
}

void addOptions(CLI::App& command, FitArguments& options) {
  command.add_option("MESH,--mesh", options.mesh, "OBJ, PLY, OFF, GLB or VRM, in any unit and turned any way")
      ->required();
  command.add_option("--object", options.object,
                     "Of a GLB's scene what hangs on the node, or shows the mesh, of this name (default: all)");
  command.add_option("--anchors", options.anchors,
                     "JSON: marker names to vertex numbers or points; all markers, or at least 8 (default: those that "
                     "`retarget anchors` finds)");
  command.add_option("--corpus", options.corpus, "Corpus whose actor shall move the face (default: the sample corpus)");
  command.add_option("-o,--out", options.out, "The .face file to write")->required();
  command.add_option("--name", options.name, "Name of the face (default: the mesh file's)");
  command.add_option("--show", options.show,
                     "Also write a page that shows the markers and the line between the lips, to drag and save, or the "
                     "worst fault (.html)");
  command.add_option(
      "--mouth-parts", options.mouth_parts,
      "Give the head what its mouth lacks of teeth, tongue and a bag behind the lips, from the default head; fit "
      "and name the mesh written here: .obj, or, of a GLB, .glb that keeps all that it has");
  command.add_flag("--even-if-faulty", options.even_if_faulty,
                   "Write a face that has faults, too; the exit code is 1 all the same");
  command.add_option("--save-anchors", options.save_anchors,
                     "Also write the anchors with all that was placed, the lips' rims among it (.json)");
  checkOutputs(command,
               {{"--out", OutputKind::kFace}, {"--show", OutputKind::kPage}, {"--mouth-parts"}, {"--save-anchors"}});
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
                  "Regularisation of the warp; 0 meets every marker exactly, or with --kernel auto chooses it")
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
                     "retarget fit --mesh head.obj --out head.face", addOptions, runFit);
}

}  // namespace mouthpiece
