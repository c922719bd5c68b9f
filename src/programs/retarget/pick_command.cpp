// retarget pick: a page to click the anchors on.
#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "base/files.h"
#include "deform/mesh/mesh_reader.h"
#include "programs/retarget/commands.h"
#include "retarget/placing/face_page.h"

namespace mouthpiece {
namespace {

struct Arguments {
  std::filesystem::path mesh, out;
  std::string object;
  bool quiet = false;
};

int runPick(const Arguments& given) {
  const FaceMesh mesh = readFaceMesh(given.mesh, given.object);
  const std::string name = given.mesh.stem().string();
  const std::filesystem::path out = given.out.empty() ? std::filesystem::path(name + ".pick.html") : given.out;
  writeFileAtomically(out, facePage(mesh, name, {}, suggestedAnchors()));
  if (!given.quiet)
    printText(fmt::format("Open {} in a browser, click the {} anchors, save them.\n", out.string(),
                          suggestedAnchors().size()));
  return kExitDone;
}

void addOptions(CLI::App& command, Arguments& options) {
  command.add_option("MESH", options.mesh, "OBJ, PLY, OFF, GLB or VRM")->required();
  command.add_option("--object", options.object,
                     "Of a GLB's scene what hangs on the node, or shows the mesh, of this name (default: all)");
  command.add_option("--out", options.out, "The page (default: MESH's name with .pick.html)");
}

}  // namespace

Command pickCommand() {
  return makeCommand("pick", "Write a page to click the anchors on", "retarget pick head.obj", addOptions, runPick);
}

}  // namespace mouthpiece
