// Fits random heads by ten clicks and judges how they speak: tests/heads/head_generator.h. Not a test of CTest's, for
// it takes minutes; heads_test.cpp is a slice of it.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <optional>

#include "heads/coarse_heads.h"
#include "heads/mouth_trial.h"
#include "programs/retarget/commands.h"

int main(int argc, char** argv) {
  using namespace mouthpiece;
  CLI::App app("Fit random heads by ten clicks and judge how they speak");
  unsigned first = 1, seeds = 200;
  bool keep = false, is_coarse = false, is_stylised = false, is_crossed = false;
  std::string corpus_file, only, folder = "heads_out", share = MOUTHPIECE_BUILD_SHARE_DIR;
  app.add_option("--seeds", seeds, "How many heads")->capture_default_str();
  app.add_option("--first", first, "The first one's seed")->capture_default_str();
  app.add_option("--only", only, "Only heads made from this one");
  app.add_option("--corpus", corpus_file,
                 "Whose takes move them (default: the clock's sentences of the sample corpus)");
  app.add_option("--out", folder, "Where heads and fits are written")->capture_default_str();
  app.add_flag("--coarse", is_coarse, "Heads of 500, 1,000 and 2,000 faces (coarse_heads.h) in place of all kinds");
  app.add_flag("--stylised", is_stylised, "Cartoons' heads (head_generator.h) in place of people's")
      ->excludes("--coarse");
  app.add_flag("--crossed", is_crossed, "Heads whose lips lie in each other at rest (head_generator.h)")
      ->excludes("--coarse")
      ->excludes("--stylised");
  app.add_flag("--keep", keep, "Keep those of all heads, not of the bad ones alone");
  CLI11_PARSE(app, argc, argv);
  const Corpus corpus = readCorpus(corpus_file.empty() ? share + "/clock.corpus" : corpus_file);
  std::vector<test::ClickedHead> heads = test::clickedHeads(MOUTHPIECE_SOURCE_DIR, share);
  if (!only.empty()) std::erase_if(heads, [&](const auto& head) { return head.name != only; });
  if (heads.empty()) return fmt::print(stderr, "found no head; expected ../shared/faces or the default face\n"), 1;
  const JudgedPoses poses = judgedPoses(corpus);
  unsigned refused = 0, faulty = 0, torn = 0, passed_torn = 0, none = 0;
  for (unsigned seed = first; seed < first + seeds; ++seed) {
    const std::optional<test::ClickedHead> made = is_coarse     ? test::coarseHead(heads[seed / 3 % heads.size()], seed)
                                                  : is_stylised ? test::stylisedHead(heads[seed % heads.size()], seed)
                                                  : is_crossed
                                                      ? test::crossedHead(heads[seed % heads.size()], seed, corpus)
                                                      : test::variedHead(heads[seed % heads.size()], seed);
    if (!made) {
      fmt::print("{}: no coarse head of it\n", seed);
      ++none;
      continue;
    }
    const test::ClickedHead& head = *made;
    const test::MouthTrial trial = test::tryMouth(head, corpus, poses, seed, folder);
    refused += trial.refused.empty() ? 0U : 1U;
    faulty += trial.refused.empty() && !trial.faults.empty() ? 1U : 0U;
    torn += trial.isTorn() ? 1U : 0U;
    passed_torn += trial.passes() && trial.isTorn() ? 1U : 0U;
    fmt::print(
        "{}{}{}: edge +{:.1f} mm, jump {:.1f} mm, {} of {} shut, fit {:.1f} s, mended {:.1f} s, {} vertices; {}{}{}\n",
        trial.isTorn() ? "TORN " : "", trial.passes() ? "" : "FAULT ", head.name, trial.edge_growth_mm, trial.jump_mm,
        trial.shut, trial.closures, trial.fit_s, trial.mend_s, head.mesh.vertexCount(), head.changes,
        trial.refused.empty() ? "" : "; refused: " + trial.refused,
        trial.faults.empty() ? "" : "; faults: " + trial.faults);
    std::fflush(stdout);
    if (!keep && trial.passes() && !trial.isTorn()) {
      for (const char* end : {".obj", ".face"}) std::filesystem::remove(folder + "/head_" + head.name + end);
    }
  }
  fmt::print("{} heads: {} refused, {} with faults, {} torn, {} pass and are torn\n", seeds - none, refused, faulty,
             torn, passed_torn);
  return passed_torn > 0 || 100 * (refused + faulty) > seeds ? 1 : 0;
}
