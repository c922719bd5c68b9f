// fit_poses: learns viseme poses from a corpus; a tool of the developers (docs/theory/vocal/vocal.md).
#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "base/files.h"
#include "programs/program.h"
#include "units/file/corpus.h"
#include "vocal/viseme_poses.h"

namespace mouthpiece {
namespace {

struct Arguments {
  std::filesystem::path corpus, out;
  std::string credit;
  bool without_generic = false, quiet = false;
};

int run(const Arguments& given) {
  const Corpus corpus = readCorpus(given.corpus);
  std::vector<PoseTake> takes;
  for (const CorpusTake& take : corpus.takes) takes.push_back({&take.labels, &take.motion});
  const VisemePoses poses =
      fitVisemePoses(takes, corpus.neutral_pose_mm, corpus.layout, given.without_generic ? nullptr : &genericPoses());
  printText(fmt::format("explained: {:.3f} of all markers' variance, {:.3f} of lips and chin\n", poses.explainedShare(),
                        poses.lipExplainedShare()));
  printText(fmt::format("lips: bilabial {:.2f} mm, labiodental {:.2f} mm, pressed {:.2f} mm\n", poses.bilabial_mm,
                        poses.labiodental_mm, poses.contact_mm));
  for (std::size_t v = 1; v < kVisemeCount; ++v) {
    printText(fmt::format("{:6} seen {:7.0f}  jaw {:6.2f} mm  lips {:5.2f} mm RMS\n",
                          visemeName(static_cast<Viseme>(v)), poses.frames_seen[v], poses.jaw_drop[v],
                          std::sqrt(3 * poses.lips.row(signedIndex(v)).array().square().mean())));
  }
  if (!given.out.empty()) writeFileAtomically(given.out, posesToJson(poses, given.credit));
  return kExitDone;
}

void addOptions(CLI::App& app, Arguments& options) {
  app.add_option("corpus", options.corpus, "The corpus")->required();
  app.add_option("--out", options.out, "Where to write the poses as JSON");
  app.add_option("--credit", options.credit, "Whose face it was; travels with the numbers");
  app.add_flag("--without-generic", options.without_generic, "Visemes the corpus lacks stay at rest");
}

}  // namespace
}  // namespace mouthpiece

int main(int argc, char** argv) {
  using namespace mouthpiece;
  return caught(argc, argv, [](int count, const char* const* arguments) {
    return runProgram(
        makeCommand("fit_poses", "Learns viseme poses from a corpus and reports how much of its motion they explain.",
                    "fit_poses grid.corpus --without-generic --out generic_poses.json", addOptions, run),
        {}, count, arguments);
  });
}
