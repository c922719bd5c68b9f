// retarget cut: opens the mouth of a head whose lips are one surface.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <Eigen/Geometry>

#include "base/errors.h"
#include "base/files.h"
#include "base/text_encoding.h"
#include "deform/mesh/glb_growth.h"
#include "deform/mesh/mesh_files.h"
#include "deform/mesh/obj_growth.h"
#include "deform/topology/lip_cut.h"
#include "programs/outputs.h"
#include "programs/retarget/commands.h"
#include "retarget/rig/face_file.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;

struct CutArguments {
  fs::path mesh, anchors, out;
  std::string object;
  bool quiet = false;
};

bool isObj(const fs::path& path) { return lowerCase(path.extension().string()) == ".obj"; }

/// The turn that sets the head upright: corners of the mouth level, eyes over the chin.
Eigen::Matrix3d uprightBy(const Anchors& anchors, const FaceMesh& mesh, const std::string& file) {
  const auto at = [&](const char* name) {
    const auto place = placeOf(anchors, name, mesh, file);
    if (!place) throw InputError(file, "markers", std::string("is without ") + name + "; `retarget pick` asks for it");
    return *place;
  };
  const Vector3d right = at("CANTHUS_OUT_R"), left = at("CANTHUS_OUT_L");
  const Vector3d across = (at("LIP_CORNER_L") - at("LIP_CORNER_R")).normalized();
  Vector3d up = 0.5 * (right + left) - at("CHIN_LOW");
  up = (up - up.dot(across) * across).normalized();
  Eigen::Matrix3d turn;
  turn << across.transpose(), up.transpose(), across.cross(up).transpose();
  if (!turn.allFinite()) throw InputError(file, "markers", "lie in one place; expected them all over the face");
  return turn;
}

int runCut(const CutArguments& given) {
  expectMeshEnding(given.out, given.mesh);
  const std::string bytes = readFile(given.mesh);
  FaceMesh mesh = parseFaceMesh(bytes, given.mesh, given.object);
  const TracedLips traced =
      tracedLips(mesh, anchorsFor(mesh, bytes, given.mesh, given.object, given.anchors, given.quiet));
  turnMesh(traced.upright_from_mesh, mesh);
  GrownMesh cut = [&] {
    try {
      return cutLips(mesh, traced.line);
    } catch (const InputError& error) {
      throw InputError(given.mesh.string(), "lips", error.what());
    }
  }();
  turnMesh(traced.upright_from_mesh.transpose(), cut.mesh);
  turnMesh(traced.upright_from_mesh.transpose(), mesh);
  const std::string file = given.mesh.string();
  std::size_t kept = mesh.vertexCount();
  if (isGlb(given.out)) {
    writeFileAtomically(given.out, grownGlb(bytes, file, given.object, mesh, cut));
  } else if (isObj(given.mesh)) {
    const GrownObjText grown = grownObj(bytes, file, mesh, cut);
    kept = grown.kept;
    writeFileAtomically(given.out, grown.text);
  } else {
    writeObj(given.out, cut.mesh);
  }
  const std::size_t added = cut.mesh.vertexCount() - mesh.vertexCount();
  const std::string anchors = kept == mesh.vertexCount() ? "its anchors go on being right"
                                                         : fmt::format(
                                                               "anchors that are numbers go on being right "
                                                               "below {}; from there on they count {} more",
                                                               kept, added);
  if (!given.quiet)
    printText(fmt::format("{}: {} vertices more than {}; {}\n", given.out.string(), added, file, anchors));
  return kExitDone;
}

void addOptions(CLI::App& command, CutArguments& options) {
  command.add_option("MESH", options.mesh, "OBJ, PLY, OFF or GLB, its lips in one surface")->required();
  command.add_option("--object", options.object,
                     "Of a GLB's scene what hangs on the node, or shows the mesh, of this name (default: all)");
  command.add_option("--anchors", options.anchors,
                     "The ten of `retarget pick` (JSON; default: those that `retarget anchors` finds)");
  command
      .add_option("-o,--out", options.out,
                  "The mesh to write, with a mouth bag: .obj, or, of a GLB, .glb; an OBJ or GLB keeps all that it has")
      ->required();
  checkOutputs(command, {{"--out"}});
}

}  // namespace

void expectMeshEnding(const fs::path& out, const fs::path& mesh) {
  if (isGlb(out) && !isGlb(mesh)) throw InputError(mesh.string(), "", "is no GLB; expected an .obj to write");
  if (!isGlb(out) && !isObj(out)) throw InputError(out.string(), "", "expected an .obj to write, or, of a GLB, a .glb");
}

TracedLips tracedLips(const FaceMesh& mesh, const NamedAnchors& anchors) {
  const auto& [set, file] = anchors;
  const Eigen::Matrix3d upright = uprightBy(set, mesh, file);
  for (const std::string& name : requiredAnchors()) {
    if (!set.markers.contains(name)) throw InputError(file, "markers", "is without " + name);
  }
  const auto hint = [&, &from = set, &of = file](const char* name) -> Vector3d {
    return upright * placeOf(from, name, mesh, of).value();
  };
  const MouthHints hints{hint("LIP_CORNER_R"), hint("LIP_CORNER_L"), hint("LIP_UP_MID"), hint("LIP_LO_MID")};
  FaceMesh turned = mesh;
  turnMesh(upright, turned);
  const auto skin = trianglesOf(turned, {PartKind::kSkin, PartKind::kLips, PartKind::kMouthInside});
  auto line = traceLipLine(turned.vertices, skin, hints);
  if (!line) throw InputError(file, "markers", "found no skin between the corners of the mouth");
  return {upright, *std::move(line)};
}

Command cutCommand() {
  return makeCommand("cut", "Cut the lips of a head apart that are one surface",
                     "retarget cut head.obj --anchors head.anchors.json -o open.obj", addOptions, runCut);
}

}  // namespace mouthpiece
