// retarget cut: opens the mouth of a head whose lips are one surface.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <Eigen/Geometry>

#include "base/errors.h"
#include "base/files.h"
#include "deform/mesh/glb_growth.h"
#include "deform/mesh/lip_cut.h"
#include "deform/mesh/mesh_files.h"
#include "programs/retarget/commands.h"
#include "retarget/rig/face_file.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;

struct CutArguments {
  fs::path mesh, anchors, out;
  bool quiet = false;
};

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
  const bool is_glb = isGlb(given.out);
  if (is_glb && !isGlb(given.mesh))
    throw InputError(given.mesh.string(), "--out", "is no GLB; expected an .obj to write");
  const std::string bytes = readFile(given.mesh);
  FaceMesh mesh = parseFaceMesh(bytes, given.mesh);
  const auto [anchors, file] = anchorsFor(mesh, bytes, given.mesh, "", given.anchors, given.quiet);
  const Eigen::Matrix3d upright = uprightBy(anchors, mesh, file);
  const auto hint = [&, &set = anchors, &of = file](const char* name) -> Vector3d {
    return upright * placeOf(set, name, mesh, of).value();
  };
  for (const std::string& name : requiredAnchors()) {
    if (!anchors.markers.contains(name)) throw InputError(file, "markers", "is without " + name);
  }
  const MouthHints hints{hint("LIP_CORNER_R"), hint("LIP_CORNER_L"), hint("LIP_UP_MID"), hint("LIP_LO_MID")};
  turnMesh(upright, mesh);
  const auto line =
      traceLipLine(mesh.vertices, trianglesOf(mesh, {PartKind::kSkin, PartKind::kLips, PartKind::kMouthInside}), hints);
  if (!line) throw InputError(file, "markers", "found no skin between the corners of the mouth");
  GrownMesh cut = [&] {
    try {
      return cutLips(mesh, *line);
    } catch (const InputError& error) {
      throw InputError(given.mesh.string(), "lips", error.what());
    }
  }();
  turnMesh(upright.transpose(), cut.mesh);
  if (is_glb) {
    turnMesh(upright.transpose(), mesh);
    writeFileAtomically(given.out, grownGlb(bytes, given.mesh.string(), "", mesh, cut));
  } else {
    writeObj(given.out, cut.mesh);
  }
  if (!given.quiet)
    printText(fmt::format("{}: {} vertices more than {}; its anchors go on being right\n", given.out.string(),
                          cut.mesh.vertexCount() - mesh.vertexCount(), given.mesh.string()));
  return kExitDone;
}

void addOptions(CLI::App& command, CutArguments& options) {
  command.add_option("MESH", options.mesh, "OBJ, PLY, OFF or GLB, its lips in one surface")->required();
  command.add_option("--anchors", options.anchors,
                     "The ten of `retarget pick` (JSON; default: those that `retarget anchors` finds)");
  command
      .add_option("-o,--out", options.out,
                  "The mesh to write, with a mouth bag: .obj, or, of a GLB, .glb that keeps all that it has")
      ->required();
}

}  // namespace

Command cutCommand() {
  return makeCommand("cut", "Cut the lips of a head apart that are one surface",
                     "retarget cut head.obj --anchors head.anchors.json -o open.obj", addOptions, runCut);
}

}  // namespace mouthpiece
