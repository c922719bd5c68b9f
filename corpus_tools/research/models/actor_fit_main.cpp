// Learns the actor of the sample corpus from a capture and says how well it does on takes it has not seen.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>

#include "base/errors.h"
#include "base/files.h"
#include "corpus_tools/research/models/actor_fit.h"

namespace {

using namespace mouthpiece;

constexpr const char* kGridCredit =
    "Learnt from the GRID audiovisual sentence corpus, speaker s1 (face tracked from its video): M. Cooke, J. Barker, "
    "S. Cunningham and X. Shao, \"An audio-visual corpus for speech perception and automatic speech recognition\", "
    "Journal of the Acoustical Society of America 120 (5), 2421-2424, 2006. https://zenodo.org/record/3625687 Licence: "
    "Creative Commons Attribution 4.0 (CC BY 4.0, https://creativecommons.org/licenses/by/4.0/). Changed: a model "
    "fitted "
    "to it, the neutral pose made symmetric.";

void printRow(const char* name, const LipMeasures& lips) {
  fmt::print("| {:<38} | {:.3f} | {:.3f} | {:.2f} | {:5.1f} | {:5.1f} | {:5.1f} | {:.2f} | {:.2f} |\n", name,
             lips.openingCorrelation(), lips.widthCorrelation(), lips.lipRms(), lips.lve(), 100 * lips.closureRecall(),
             100 * lips.falseClosureShare(), lips.varianceRatio(), lips.jerkRatio());
}

void printTable(const ActorModel& model, const ActorCapture& held_out) {
  fmt::print("| on {:<35} | r opening | r width | RMS mm | LVE mm2 | closures % | false % | variance | jerk |\n",
             fmt::format("{} takes that were not learnt from", held_out.takes.size()));
  fmt::print("|---|---|---|---|---|---|---|---|---|\n");
  printRow("least squares", scoreActor(model, held_out, {.restore_variance = false, .close_lips = false}));
  printRow("with the variance restored", scoreActor(model, held_out, {.close_lips = false}));
  printRow("with closures: as performed", scoreActor(model, held_out, {}));
  printRow("with the sample corpus' variation", scoreActor(model, held_out, {.variation = kActorVariation}));
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Learns the actor model of the sample corpus from a folder of takes.\n"
      "Example: fit_actor ../shared/capture/grid_s1/takes --out sample_data/actor/grid_s1_actor.json");
  std::string takes, out, credit = kGridCredit;
  std::size_t fold_count = 5;
  app.add_option("takes", takes, "folder of takes")->required();
  app.add_option("--out", out, "the model is written here; none: only the table");
  app.add_option("--credit", credit, "whom the numbers come from");
  app.add_option("--hold-out", fold_count, "every N-th take is kept for the table; 0: no table");
  CLI11_PARSE(app, argc, argv);
  try {
    const ActorCapture capture = readActorCapture(takes);
    const ActorFitOptions options{.credit = credit};
    if (fold_count > 1)
      printTable(fitActor(withoutFold(capture, fold_count, 0), options), onlyFold(capture, fold_count, 0));
    if (!out.empty()) writeFileAtomically(out, actorModelToJson(fitActor(capture, options)));
    return 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "fit_actor: {}\n", error.what());
    return 1;
  }
}
