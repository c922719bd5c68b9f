// retarget pick: a page to click the anchors on.
#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "base/files.h"
#include "deform/mesh/mesh_files.h"
#include "deform/mesh/mesh_limits.h"
#include "programs/outputs.h"
#include "programs/retarget/commands.h"
#include "retarget/placing/face_page.h"

namespace mouthpiece {
namespace {

struct PickArguments {
  std::filesystem::path mesh, out, anchors;
  std::string object;
  bool quiet = false;
};

int runPick(const PickArguments& given) {
  const std::string bytes = readFile(given.mesh, kMaxMeshBytes);
  const std::shared_ptr<const FaceMesh> mesh = sharedFaceMesh(bytes, given.mesh, given.object);
  const std::string name = given.mesh.stem().string();
  const std::filesystem::path out = given.out.empty() ? std::filesystem::path(name + ".pick.html") : given.out;
  NamedAnchors shown{{}, given.anchors.string()};
  if (!given.anchors.empty()) shown.anchors = parseAnchors(readFile(given.anchors, kMaxAnchorBytes), shown.file);
  writeFileAtomically(
      out, facePage(*mesh, name, shown.anchors, suggestedAnchors(), dressingOf(bytes, given.mesh, *mesh, shown)));
  if (!given.quiet)
    printText(fmt::format("Open {} in a browser, click the {} anchors, save them.\n", out.string(),
                          suggestedAnchors().size()));
  return kExitDone;
}

void addOptions(CLI::App& command, PickArguments& options) {
  command.add_option("MESH", options.mesh, "OBJ, PLY, OFF, GLB or VRM")->required();
  command.add_option("--object", options.object,
                     "Of a GLB's scene what hangs on the node, or shows the mesh, of this name (default: all)");
  command.add_option("--anchors", options.anchors, "Show these anchors to begin with (JSON)");
  command.add_option("-o,--out", options.out, "The page (default: MESH's name with .pick.html)");
  checkOutputs(command, {{"--out", OutputKind::kPage}});
}

}  // namespace

Command pickCommand() {
  return makeCommand("pick", "Write a page to click the anchors on", "retarget pick head.obj", addOptions, runPick);
}

}  // namespace mouthpiece
