// bootstrapInterval, evaluationTable, evaluationJson and evaluationHtml of evaluation.h.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <random>

#include "base/json_text.h"
#include "corpus_tools/report/data_page.h"
#include "corpus_tools/research/evaluation/evaluation.h"

namespace mouthpiece {

extern const std::string_view kEvaluationPage;

namespace {

/// A column of a table: of the lips, which has an interval, or of the units and joins.
template <typename Of>
struct Column {
  const char* key;  ///< in the JSON
  const char* head;
  const char* unit;
  int digits;
  bool is_share;
  double (Of::*value)() const;
};
using LipColumn = Column<LipMeasures>;
using UnitColumn = Column<EvaluationRow>;

constexpr std::array<LipColumn, 12> kLipColumns{{
    {"lip_rms_mm", "RMS", "mm", 2, false, &LipMeasures::lipRms},
    {"lve_mm2", "LVE", "mm2", 2, false, &LipMeasures::lve},
    {"opening_correlation", "r", "opening", 3, false, &LipMeasures::openingCorrelation},
    {"width_correlation", "r", "width", 3, false, &LipMeasures::widthCorrelation},
    {"protrusion_correlation", "r", "protrusion", 3, false, &LipMeasures::protrusionCorrelation},
    {"protrusion_depth", "protrusion", "depth", 2, false, &LipMeasures::protrusionDepth},
    {"closure_recall", "closures", "kept", 1, true, &LipMeasures::closureRecall},
    {"contact_recall", "F V", "kept", 1, true, &LipMeasures::contactRecall},
    {"false_closure_share", "false", "closures", 1, true, &LipMeasures::falseClosureShare},
    {"vowels_shut_share", "vowels", "shut", 1, true, &LipMeasures::vowelsShutShare},
    {"variance_ratio", "variance", "ratio", 2, false, &LipMeasures::varianceRatio},
    {"jerk_ratio", "jerk", "ratio", 2, false, &LipMeasures::jerkRatio},
}};

constexpr std::array<UnitColumn, 9> kUnitColumns{{
    {"phones_per_unit", "phones", "a unit", 1, false, &EvaluationRow::phonesPerUnit},
    {"backoff_share", "back-", "off", 1, true, &EvaluationRow::backoffShare},
    {"velocity_mismatch_mean_mm_s", "velocity", "mismatch", 0, false, &EvaluationRow::meanVelocityMismatch},
    {"velocity_jump_mean_mm_s", "velocity", "jump", 0, false, &EvaluationRow::meanVelocityJump},
    {"captured_velocity_jump_mean_mm_s", "velocity", "capture", 0, false, &EvaluationRow::meanCapturedVelocityJump},
    {"added_velocity_jump_mean_mm_s", "velocity", "added", 1, false, &EvaluationRow::meanAddedVelocityJump},
    {"velocities_over_corpus_p95", "velocity", "over p95", 0, true, &EvaluationRow::velocitiesOverLimit},
    {"join_jump_p95_mm", "join p95", "mm", 2, false, &EvaluationRow::joinJump95},
    {"joins_over_corpus_p95", "joins", "over p95", 0, true, &EvaluationRow::joinsOverLimit},
}};

constexpr int kNameWidth = 24, kWidth = 15, kUnitWidth = 10;

std::string number(double value, int digits, bool is_share) {
  if (!std::isfinite(value)) return "-";
  return is_share ? fmt::format("{:.{}f} %", 100 * value, digits) : fmt::format("{:.{}f}", value, digits);
}

std::string interval(const Interval& range, int digits, bool is_share) {
  if (!std::isfinite(range.low)) return "";
  const double factor = is_share ? 100 : 1;
  return fmt::format("{:.{}f} to {:.{}f}", factor * range.low, digits, factor * range.high, digits);
}

Interval intervalOf(const EvaluationRow& row, const LipColumn& column) {
  return bootstrapInterval(row, [&](const LipMeasures& measures) { return (measures.*column.value)(); });
}

/// NaN has no place in JSON.
nlohmann::json finite(double value) { return std::isfinite(value) ? nlohmann::json(value) : nlohmann::json(nullptr); }

template <typename Columns>
std::string headsOf(const Columns& columns, int width) {
  std::string heads = fmt::format("{:<{}}", "", kNameWidth), units = heads;
  for (const auto& column : columns) {
    heads += fmt::format("{:>{}}", column.head, width);
    units += fmt::format("{:>{}}", column.unit, width);
  }
  return heads + "\n" + units;
}

std::string lipTable(const Evaluation& evaluation) {
  std::string text = headsOf(kLipColumns, kWidth);
  for (const EvaluationRow& row : evaluation.rows) {
    std::string values = fmt::format("\n{:<{}}", row.method, kNameWidth),
                ranges = row.takes.size() < 2 ? "" : fmt::format("\n{:<{}}", "", kNameWidth);
    for (const LipColumn& column : kLipColumns) {
      values += fmt::format("{:>{}}", number((row.lips.*column.value)(), column.digits, column.is_share), kWidth);
      if (!ranges.empty())
        ranges += fmt::format("{:>{}}", interval(intervalOf(row, column), column.digits, column.is_share), kWidth);
    }
    text += values + ranges;
  }
  return text;
}

std::string unitTable(const Evaluation& evaluation) {
  std::string text = headsOf(kUnitColumns, kUnitWidth);
  for (const EvaluationRow& row : evaluation.rows) {
    if (row.units == 0) continue;
    text += fmt::format("\n{:<{}}", row.method, kNameWidth);
    for (const UnitColumn& column : kUnitColumns)
      text += fmt::format("{:>{}}", number((row.*column.value)(), column.digits, column.is_share), kUnitWidth);
  }
  return text;
}

nlohmann::json factsOf(const Evaluation& evaluation) {
  nlohmann::json json = {{"corpus", evaluation.corpus}, {"takes", evaluation.takes}, {"rows", nlohmann::json::array()}};
  for (const EvaluationRow& row : evaluation.rows) {
    nlohmann::json entry = {{"method", row.method},
                            {"frames", row.lips.frames},
                            {"closures", row.lips.closures},
                            {"contacts", row.lips.contacts},
                            {"captured_vowels_shut_share", finite(row.lips.capturedVowelsShutShare())},
                            {"joins", row.join_jumps_mm.size()},
                            {"units_per_phone", finite(row.unitsPerPhone())},
                            {"corpus_step_p95_mm", finite(row.usualStep())}};
    for (const LipColumn& column : kLipColumns) {
      const Interval range = intervalOf(row, column);
      entry[column.key] = finite((row.lips.*column.value)());
      entry["intervals"][column.key] = {finite(range.low), finite(range.high)};
    }
    for (const UnitColumn& column : kUnitColumns) entry[column.key] = finite((row.*column.value)());
    json["rows"].push_back(std::move(entry));
  }
  return json;
}

template <typename Of>
nlohmann::json columnJson(const Column<Of>& column) {
  return {{"key", column.key},
          {"head", fmt::format("{} {}", column.head, column.unit)},
          {"digits", column.digits},
          {"share", column.is_share}};
}

nlohmann::json valuesJson(const std::vector<float>& values) {
  constexpr double kStepsPerMm = 100;
  nlohmann::json list = nlohmann::json::array();
  for (const float value : values) list.push_back(finite(std::round(kStepsPerMm * value) / kStepsPerMm));
  return list;
}

nlohmann::json curvesJson(const LipCurves& curves) {
  return {{"opening_mm", valuesJson(curves.opening_mm)},
          {"width_mm", valuesJson(curves.width_mm)},
          {"protrusion_mm", valuesJson(curves.protrusion_mm)},
          {"joins", curves.joins}};
}

nlohmann::json comparedJson(const ComparedTake& take) {
  nlohmann::json phones = nlohmann::json::array(), words = nlohmann::json::array();
  for (const LabelledPhone& phone : take.labels.phones)
    phones.push_back({std::string(phoneName(phone.phone)), phone.span.end});
  for (const LabelledWord& word : take.labels.words) {
    const TimeSpan span = take.labels.spanOf(word.phones);
    words.push_back({word.text, span.start, span.end});
  }
  return {{"name", take.name},
          {"text", take.text},
          {"rate_hz", take.frame_rate_hz},
          {"duration_s", asReal(take.captured.opening_mm.size()) / take.frame_rate_hz},
          {"start_s", take.labels.phones.empty() ? 0.0 : take.labels.phones.front().span.start},
          {"phones", std::move(phones)},
          {"words", std::move(words)},
          {"captured", curvesJson(take.captured)}};
}

/// Each row's curves and measures of take `i`.
void addTake(const Evaluation& evaluation, std::size_t i, nlohmann::json& page) {
  page["compared"].push_back(comparedJson(evaluation.compared[i]));
  for (std::size_t r = 0; r < evaluation.rows.size(); ++r) {
    const EvaluationRow& row = evaluation.rows[r];
    nlohmann::json measures;
    for (const LipColumn& column : kLipColumns) measures[column.key] = finite((row.takes[i].*column.value)());
    page["rows"][r]["takes"].push_back(std::move(measures));
    page["rows"][r]["curves"].push_back(curvesJson(row.curves[i]));
  }
}

}  // namespace

Interval bootstrapInterval(const EvaluationRow& row, const std::function<double(const LipMeasures&)>& measure) {
  constexpr std::size_t kDraws = 1000, kTail = 25;
  constexpr std::uint64_t kSeed = 1;
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  if (row.takes.size() < 2) return {kNone, kNone};
  std::mt19937_64 random(kSeed);
  std::vector<double> values;
  for (std::size_t draw = 0; draw < kDraws; ++draw) {
    LipMeasures drawn;
    for (std::size_t i = 0; i < row.takes.size(); ++i) drawn += row.takes[random() % row.takes.size()];
    const double value = measure(drawn);
    if (std::isfinite(value)) values.push_back(value);
  }
  if (values.size() < kDraws / 2) return {kNone, kNone};
  std::sort(values.begin(), values.end());
  const std::size_t tail = kTail * values.size() / kDraws;
  return {values[tail], values[values.size() - 1 - tail]};
}

std::string evaluationTable(const Evaluation& evaluation) {
  std::string text = fmt::format("{} take{} against {}; lips, a constant offset taken off each take{}\n\n{}\n\n{}\n",
                                 evaluation.takes.size(), evaluation.takes.size() == 1 ? "" : "s", evaluation.corpus,
                                 evaluation.takes.size() == 1 ? "" : "; below each row its 95 % interval over takes",
                                 lipTable(evaluation), unitTable(evaluation));
  if (!evaluation.rows.empty()) {
    const EvaluationRow& first = evaluation.rows.front();
    text += fmt::format(
        "\nclosures kept: of {} in the capture; F V kept: of {}; vowels shut: in the capture {:.1f} %\n"
        "velocity mismatch: mean over joins of the largest difference between the velocities that the two fragments "
        "bring to it, lips and chin, mm/s\n"
        "velocity jump: mean over joins of the largest change of a marker's velocity from frame to frame, mm/s; "
        "velocity capture: the take's own in the same frames; velocity added: what the first has beyond the second "
        "when "
        "both are shown at 60 Hz or more\n"
        "join p95: largest marker step; that of the corpus' own frames: {} mm\n",
        first.lips.closures, first.lips.contacts, 100 * first.lips.capturedVowelsShutShare(),
        number(first.usualStep(), 2, false));
  }
  return text;
}

std::string evaluationJson(const Evaluation& evaluation) { return jsonText(factsOf(evaluation), 2) + "\n"; }

std::string evaluationHtml(const Evaluation& evaluation, std::size_t most_curve_bytes) {
  constexpr std::size_t kBytesPerValue = 7;  // "-12.34,"
  constexpr std::size_t kCurves = 3;
  nlohmann::json page = factsOf(evaluation);
  page["compared"] = page["lip_columns"] = page["unit_columns"] = nlohmann::json::array();
  for (const LipColumn& column : kLipColumns) page["lip_columns"].push_back(columnJson(column));
  for (const UnitColumn& column : kUnitColumns) page["unit_columns"].push_back(columnJson(column));
  for (nlohmann::json& row : page["rows"]) row["curves"] = nlohmann::json::array();
  std::size_t bytes = 0;
  for (std::size_t i = 0; i < evaluation.compared.size(); ++i) {
    bytes +=
        evaluation.compared[i].captured.opening_mm.size() * kCurves * kBytesPerValue * (evaluation.rows.size() + 1);
    if (bytes > most_curve_bytes) break;
    addTake(evaluation, i, page);
  }
  return dataPage(kEvaluationPage, jsonText(page));
}

}  // namespace mouthpiece
