// retarget anchors: the ten anchors of a head that has shapes, without a click.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <array>
#include <nlohmann/json.hpp>

#include "base/errors.h"
#include "base/files.h"
#include "deform/mesh/face_mesh.h"
#include "exports/arkit.h"
#include "programs/retarget/commands.h"
#include "retarget/placing/face_page.h"
#include "retarget/placing/shape_anchors.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMostHeadBytes = std::uint64_t{1} << 30;

struct AnchorsArguments {
  fs::path mesh, out, show;
  std::string object;
  bool quiet = false, json = false;
};

/// Of the shapes that stand for `arkit_name` the sum: halves count as the whole.
VertexPositions shapeFor(const FaceShapes& shapes, std::string_view arkit_name) {
  VertexPositions sum;
  for (std::size_t s = 0; s < shapes.names.size(); ++s) {
    const int shape = arkitIndex(shapes.names[s]);
    if (shape < 0 || kArkitNames[unsignedIndex(shape)] != arkit_name) continue;
    if (sum.rows() == 0) sum = VertexPositions::Zero(shapes.moves[s].rows(), 3);
    sum += shapes.moves[s];
  }
  return sum;
}

/// The shape that opens the mouth: ARKit's, else the most open vowel of a set of visemes.
VertexPositions jawShape(const FaceShapes& shapes) {
  VertexPositions jaw = shapeFor(shapes, "JawOpen");
  constexpr std::array<std::string_view, 9> kOpen{"viseme_aa", "Fcl_MTH_A", "MTH_A", "aa",  "a",
                                                  "V_Open",    "mouthOpen", "Ah",    "v_aa"};
  const auto isCalled = [](std::string_view name, std::string_view wanted) {
    return name.size() == wanted.size() && std::equal(name.begin(), name.end(), wanted.begin(), [](char a, char b) {
             return std::tolower(static_cast<unsigned char>(a)) == std::tolower(static_cast<unsigned char>(b));
           });
  };
  for (const std::string_view wanted : kOpen) {
    for (std::size_t s = 0; s < shapes.names.size() && jaw.rows() == 0; ++s) {
      std::string_view name = shapes.names[s];
      name.remove_prefix(std::min(name.size(), name.rfind('.') + 1));  // "Face.M_F00_000_00_Fcl_MTH_A"
      const bool ends_so = wanted.size() > 4 && name.size() > wanted.size() &&
                           isCalled(name.substr(name.size() - wanted.size()), wanted);
      if (isCalled(name, wanted) || ends_so) jaw = shapes.moves[s];
    }
  }
  return jaw;
}

int runAnchors(const AnchorsArguments& given) {
  const std::string bytes = readFile(given.mesh, kMostHeadBytes);
  const FaceMesh mesh = parseFaceMesh(bytes, given.mesh, given.object);
  const FaceShapes shapes = parseFaceShapes(bytes, given.mesh, given.object);
  const TellingShapes telling{jawShape(shapes), shapeFor(shapes, "EyeBlinkRight"), shapeFor(shapes, "EyeBlinkLeft")};
  if (telling.jaw_open.rows() == 0) {
    throw InputError(given.mesh.string(), "",
                     fmt::format("has {} shapes, none that opens the jaw (jawOpen, viseme_aa, A ...); click the ten "
                                 "anchors on the page that `retarget pick` writes",
                                 shapes.names.size()));
  }
  const auto anchors = anchorsFromShapes(mesh, telling, given.mesh.string());
  nlohmann::ordered_json file{{"markers", nlohmann::ordered_json::object()}};
  std::string missing;
  for (const AnchorToPick& wanted : suggestedAnchors()) {
    const auto found = anchors.find(std::string(wanted.name));
    if (found == anchors.end())
      missing += " " + std::string(wanted.name);
    else
      file["markers"][found->first] = found->second;
  }
  const fs::path out = given.out.empty() ? fs::path(given.mesh.stem().string() + ".anchors.json") : given.out;
  writeFileAtomically(out, file.dump(1) + "\n");
  if (!given.show.empty()) {
    Anchors shown;
    for (const auto& [name, vertex] : anchors) shown.markers[name] = vertex;
    writeFileAtomically(given.show, facePage(mesh, given.mesh.stem().string(), shown, {}));
  }
  printNotice(missing.empty() ? "" : "not found:" + missing, given.quiet || missing.empty());
  if (given.json) {
    printJson(nlohmann::ordered_json(file));
  } else if (!given.quiet) {
    printText(fmt::format("{} anchors -> {}\n", anchors.size(), out.string()));
  }
  return kExitDone;
}

void addOptions(CLI::App& command, AnchorsArguments& options) {
  command.add_option("MESH", options.mesh, "GLB or VRM with ARKit's shapes or visemes")->required();
  command.add_option("-o,--out", options.out, "The anchors file (default: MESH's name with .anchors.json)");
  command.add_option("--object", options.object,
                     "Of a GLB's scene what hangs on the node, or shows the mesh, of this name (default: all)");
  command.add_option("--show", options.show, "Also write a page that shows them on the head (.html)");
  addJsonFlag(command, options.json);
}

}  // namespace

Command anchorsCommand() {
  return makeCommand("anchors", "Find the anchors of a head by its own shapes",
                     "retarget anchors head.glb -o head.anchors.json", addOptions, runAnchors);
}

}  // namespace mouthpiece
