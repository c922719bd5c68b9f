// fit_actor: learns the actor of the sample corpus from a capture and says how well it does on takes it has not seen; a
// tool of the developers (docs/theory/corpus_tools/actor_model.md).
#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "base/files.h"
#include "corpus_tools/research/models/actor_fit.h"
#include "programs/program.h"

namespace mouthpiece {
namespace {

constexpr const char* kGridCredit =
    "Learnt from the GRID audiovisual sentence corpus, speaker s1 (face tracked from its video): M. Cooke, J. Barker, "
    "S. Cunningham and X. Shao, \"An audio-visual corpus for speech perception and automatic speech recognition\", "
    "Journal of the Acoustical Society of America 120 (5), 2421-2424, 2006. https://zenodo.org/record/3625687 Licence: "
    "Creative Commons Attribution 4.0 (CC BY 4.0, https://creativecommons.org/licenses/by/4.0/). Changed: a model "
    "fitted "
    "to it, the neutral pose made symmetric.";

struct Arguments {
  std::string takes, out, credit = kGridCredit;
  std::size_t fold_count = 5;
  bool quiet = false;
};

std::string rowOf(const char* name, const LipMeasures& lips) {
  return fmt::format("| {:<38} | {:.3f} | {:.3f} | {:.2f} | {:5.1f} | {:5.1f} | {:5.1f} | {:.2f} | {:.2f} |\n", name,
                     lips.openingCorrelation(), lips.widthCorrelation(), lips.lipRms(), lips.lve(),
                     100 * lips.closureRecall(), 100 * lips.falseClosureShare(), lips.varianceRatio(),
                     lips.jerkRatio());
}

std::string tableOf(const ActorModel& model, const ActorCapture& held_out) {
  return fmt::format(
             "| on {:<35} | r opening | r width | RMS mm | LVE mm2 | closures % | false % | variance | jerk |\n",
             fmt::format("{} takes that were not learnt from", held_out.takes.size())) +
         "|---|---|---|---|---|---|---|---|---|\n" +
         rowOf("least squares", scoreActor(model, held_out, {.restore_variance = false, .close_lips = false})) +
         rowOf("with the variance restored", scoreActor(model, held_out, {.close_lips = false})) +
         rowOf("with closures: as performed", scoreActor(model, held_out, {})) +
         rowOf("with the sample corpus' variation", scoreActor(model, held_out, {.variation = kActorVariation}));
}

int run(const Arguments& given) {
  const ActorCapture capture = readActorCapture(given.takes);
  const ActorFitOptions options{.credit = given.credit};
  const std::size_t folds = given.fold_count;
  if (folds > 1) printText(tableOf(fitActor(withoutFold(capture, folds, 0), options), onlyFold(capture, folds, 0)));
  if (!given.out.empty()) writeFileAtomically(given.out, actorModelToJson(fitActor(capture, options)));
  return kExitDone;
}

void addOptions(CLI::App& app, Arguments& options) {
  app.add_option("takes", options.takes, "folder of takes")->required();
  app.add_option("--out", options.out, "the model is written here; none: only the table");
  app.add_option("--credit", options.credit, "whom the numbers come from");
  app.add_option("--hold-out", options.fold_count, "every N-th take is kept for the table; 0: no table");
}

}  // namespace
}  // namespace mouthpiece

int main(int argc, char** argv) {
  using namespace mouthpiece;
  return caught(argc, argv, [](int count, const char* const* arguments) {
    return runProgram(
        makeCommand("fit_actor", "Learns the actor model of the sample corpus from a folder of takes.",
                    "fit_actor ../shared/capture/grid_s1/takes --out sample_data/actor/grid_s1_actor.json", addOptions,
                    run),
        {}, count, arguments);
  });
}
