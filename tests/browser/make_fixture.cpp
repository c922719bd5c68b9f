// make_fixture TEMPLATE FOLDER: the made-up talking head of tests/unit/exports as FOLDER/view.html, FOLDER/face.glb
// and, for the importers, FOLDER/expected.json: where the vertices must be in some frames. The line is called what
// would break a page that trusts its text.
#include <cstdio>
#include <exception>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "../unit/exports/talking_head.h"
#include "base/files.h"
#include "deform/mesh/face_mesh.h"
#include "exports/format_bytes.h"
#include "exports/gltf/glb.h"

namespace {

using namespace mouthpiece;

/// Frames of the animation as metres, in the GLB's order: part by part, used vertices rising. In this head every part's
/// vertices are all used and follow each other, so that is the mesh's own order.
nlohmann::json expectedFrames(const samples::TalkingHead& head) {
  nlohmann::json frames = nlohmann::json::array();
  for (const Eigen::Index frame : {0, 11, 30, 47, 71, 90, 119}) {
    const Eigen::RowVectorXd metres = 0.001 * head.animation.positions.row(frame).cast<double>();
    frames.push_back({{"frame", frame}, {"positions_m", std::vector<double>(metres.begin(), metres.end())}});
  }
  return {{"fps", head.animation.frame_rate_hz},
          {"frame_count", head.animation.positions.rows()},
          {"vertices", head.mesh.vertices.rows()},
          {"frames", std::move(frames)}};
}

void makeFixture(const std::filesystem::path& page_template, const std::filesystem::path& folder) {
  auto head = samples::makeTalkingHead({.word = "</script><img src=x onerror=alert(1)>\xE2\x80\xA8", .ripple_mm = 0.6});
  head.utterance.warnings = {"'<b>oh</b>' at 0.2 s may not be what was said"};
  const auto shapes = principalShapes(head.animation, head.mesh.vertices, head.mesh.metres_per_unit);
  const std::string glb = glbBytes(head.mesh, shapes, "talking_head");
  writeFileAtomically(folder / "face.glb", glb);
  writeFileAtomically(folder / "expected.json", expectedFrames(head).dump());
  writeFileAtomically(folder / "report.json", reportJson(head.utterance, head.utterance.timing_ms));
  writeFileAtomically(folder / "view.html",
                      viewHtml(readFile(page_template), {head.utterance, glb, head.mesh, "talking_head",
                                                         head.marker_names, head.utterance.motion.positions_mm}));
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fputs("usage: make_fixture TEMPLATE FOLDER\n", stderr);
    return 2;
  }
  try {
    makeFixture(argv[1], argv[2]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "make_fixture: %s\n", error.what());
    return 1;
  }
  return 0;
}
