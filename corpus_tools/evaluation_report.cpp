// evaluationTable and evaluationJson of evaluation.h.
#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "corpus_tools/evaluation.h"

namespace mouthpiece {
namespace {

std::string number(double value, int digits) {
  return std::isfinite(value) ? fmt::format("{:.{}f}", value, digits) : "-";
}

std::string percent(double share) { return std::isfinite(share) ? fmt::format("{:.0f} %", 100 * share) : "-"; }

/// NaN has no place in JSON.
nlohmann::json finite(double value) { return std::isfinite(value) ? nlohmann::json(value) : nlohmann::json(nullptr); }

}  // namespace

std::string evaluationTable(const Evaluation& evaluation) {
  std::string text = fmt::format(
      "{} takes against {}; lips, a constant offset taken off each take\n\n"
      "{:<23}{:>8}{:>8}{:>8}{:>8}{:>9}{:>8}{:>9}{:>7}{:>8}{:>9}{:>9}{:>8}\n"
      "{:<23}{:>8}{:>8}{:>8}{:>8}{:>9}{:>8}{:>9}{:>7}{:>8}{:>9}{:>9}{:>8}\n",
      evaluation.takes.size(), evaluation.corpus, "", "RMS", "LVE", "r", "r", "closures", "false", "variance", "jerk",
      "units", "join p95", "joins", "back-", "", "mm", "mm2", "opening", "width", "kept", "clos.", "ratio", "ratio",
      "a phone", "mm", "over p95", "off");
  for (const EvaluationRow& row : evaluation.rows) {
    const LipMeasures& lips = row.lips;
    text += fmt::format("{:<23}{:>8}{:>8}{:>8}{:>8}{:>9}{:>8}{:>9}{:>7}{:>8}{:>9}{:>9}{:>8}\n", row.method,
                        number(lips.lipRms(), 2), number(lips.lve(), 2), number(lips.openingCorrelation(), 2),
                        number(lips.widthCorrelation(), 2), percent(lips.closureRecall()),
                        percent(lips.falseClosureShare()), number(lips.varianceRatio(), 2), number(lips.jerkRatio(), 2),
                        number(row.unitsPerPhone(), 2), number(row.joinJumpPercentile(0.95), 2),
                        percent(row.joinsOverLimit()), percent(row.backoffShare()));
  }
  if (!evaluation.rows.empty()) {
    const EvaluationRow& first = evaluation.rows.front();
    text += fmt::format(
        "\nclosures kept: of {} in the capture\n"
        "join p95: largest marker step at a join; that of the corpus' own frames: {} mm\n",
        first.lips.closures, number(first.usualStep(), 2));
  }
  return text;
}

std::string evaluationJson(const Evaluation& evaluation) {
  nlohmann::json json = {{"corpus", evaluation.corpus}, {"takes", evaluation.takes}, {"rows", nlohmann::json::array()}};
  for (const EvaluationRow& row : evaluation.rows) {
    const LipMeasures& lips = row.lips;
    json["rows"].push_back({{"method", row.method},
                            {"frames", lips.frames},
                            {"lip_rms_mm", finite(lips.lipRms())},
                            {"lve_mm2", finite(lips.lve())},
                            {"opening_correlation", finite(lips.openingCorrelation())},
                            {"width_correlation", finite(lips.widthCorrelation())},
                            {"closures", lips.closures},
                            {"closure_recall", finite(lips.closureRecall())},
                            {"false_closure_share", finite(lips.falseClosureShare())},
                            {"variance_ratio", finite(lips.varianceRatio())},
                            {"jerk_ratio", finite(lips.jerkRatio())},
                            {"joins", row.join_jumps_mm.size()},
                            {"units_per_phone", finite(row.unitsPerPhone())},
                            {"join_jump_p95_mm", finite(row.joinJumpPercentile(0.95))},
                            {"corpus_step_p95_mm", finite(row.usualStep())},
                            {"joins_over_corpus_p95", finite(row.joinsOverLimit())},
                            {"backoff_share", finite(row.backoffShare())}});
  }
  return json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

}  // namespace mouthpiece
