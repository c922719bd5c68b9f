// retarget pick: a page to click the anchors on.
#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "base/files.h"
#include "deform/mesh/mesh_reader.h"
#include "programs/retarget/commands.h"
#include "retarget/placing/face_page.h"

namespace mouthpiece {
namespace {

constexpr std::uint64_t kMaxAnchorBytes = 16 << 20;

struct Arguments {
  std::filesystem::path mesh, out, anchors;
  bool quiet = false;
};

int runPick(const Arguments& given) {
  const FaceMesh mesh = readFaceMesh(given.mesh);
  const std::string name = given.mesh.stem().string();
  const std::filesystem::path out = given.out.empty() ? std::filesystem::path(name + ".pick.html") : given.out;
  Anchors shown;
  if (!given.anchors.empty()) shown = parseAnchors(readFile(given.anchors, kMaxAnchorBytes), given.anchors.string());
  writeFileAtomically(out, facePage(mesh, name, shown, suggestedAnchors()));
  if (!given.quiet)
    printText(fmt::format("Open {} in a browser, click the {} anchors, save them.\n", out.string(),
                          suggestedAnchors().size()));
  return kExitDone;
}

void addOptions(CLI::App& command, Arguments& options) {
  command.add_option("MESH", options.mesh, "OBJ, PLY, OFF or GLB")->required();
  command.add_option("--anchors", options.anchors, "Show these anchors to begin with (JSON)");
  command.add_option("--out", options.out, "The page (default: MESH's name with .pick.html)");
}

}  // namespace

Command pickCommand() {
  return makeCommand("pick", "Write a page to click the anchors on", "retarget pick head.obj", addOptions, runPick);
}

}  // namespace mouthpiece
