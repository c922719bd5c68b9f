#include "corpus_tools/takes/take_report.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>

#include "base/index.h"
#include "base/json_text.h"

namespace mouthpiece {
namespace {

using Json = nlohmann::json;

/// Each field with its key; what an older report lacks stays as it is in a new TakeReport.
template <typename Report, typename Visit>
void forEachField(Report& report, const Visit& visit) {
  visit("key", report.key);
  visit("frames", report.frames);
  visit("head_by_jig", report.jig_frames);
  visit("head_by_skin", report.skin_frames);
  visit("head_bridged", report.bridged_frames);
  visit("head_residual_mm", report.head_residual_mm);
  visit("scale", report.scale);
  visit("swaps", report.swaps);
  visit("spikes", report.spikes);
  visit("gap_samples", report.gap_samples);
  visit("filled_samples", report.filled_samples);
  visit("missing_samples", report.missing_samples);
  visit("noise_mm", report.noise_mm);
  visit("smoothed_mm", report.smoothed_mm);
  visit("closure_changes_mm", report.lips.closure_changes_mm);
  visit("lip_jerk_before", report.lips.jerk_before);
  visit("lip_jerk_after", report.lips.jerk_after);
  visit("aligned_mm", report.aligned_mm);
  visit("labels_found", report.labels_found);
}

Json toJson(const TakeReport& report) {
  Json json = {{"name", report.name}, {"doubtful_words", Json::array()}};
  forEachField(report, [&](const char* key, const auto& value) { json[key] = value; });
  for (const DoubtfulWord& word : report.doubtful) {
    json["doubtful_words"].push_back(
        {{"word", word.text}, {"start_s", word.span.start}, {"end_s", word.span.end}, {"confidence", word.confidence}});
  }
  return json;
}

TakeReport fromJson(const Json& json) {
  TakeReport report;
  report.name = json.at("name").get<std::string>();
  forEachField(report, [&](const char* key, auto& value) { value = json.value(key, value); });
  for (const Json& word : json.value("doubtful_words", Json::array())) {
    report.doubtful.push_back({word.at("word").get<std::string>(),
                               {word.at("start_s").get<double>(), word.at("end_s").get<double>()},
                               word.at("confidence").get<double>()});
  }
  return report;
}

/// Lips may be tightest a little outside of their label.
constexpr Seconds kAround = 0.020;

struct LipPaths {
  PositionMatrix mm;  ///< frames x 6
  double rate_hz = 0;
};

LipPaths lipPaths(const MotionClip& clip, const LipGauge& gauge) {
  LipPaths lips{PositionMatrix(clip.positions_mm.rows(), 6), clip.frame_rate_hz};
  lips.mm.leftCols<3>() = clip.positions_mm.middleCols<3>(gauge.column(MarkerRole::kUpperLip));
  lips.mm.rightCols<3>() = clip.positions_mm.middleCols<3>(gauge.column(MarkerRole::kLowerLip));
  return lips;
}

/// nullopt where a frame is missing.
std::optional<double> tightest(const LipPaths& lips, const TimeSpan& span) {
  const auto first = static_cast<Eigen::Index>(std::ceil((span.start - kAround) * lips.rate_hz));
  const auto last = static_cast<Eigen::Index>(std::floor((span.end + kAround) * lips.rate_hz));
  if (first < 0 || last >= lips.mm.rows() || last < first) return std::nullopt;
  const auto frames = lips.mm.middleRows(first, last - first + 1);
  if (!frames.allFinite()) return std::nullopt;
  return (frames.leftCols<3>() - frames.rightCols<3>()).rowwise().norm().minCoeff();
}

/// Third differences under a Hann window, taken apart by frequency.
LipFidelity::Bands jerkOf(const LipPaths& lips) {
  LipFidelity::Bands bands{};
  const Eigen::Index count = lips.mm.rows() - 3;
  if (count < 8 || !lips.mm.allFinite()) return bands;
  constexpr double kMetres = 0.001;
  const PositionMatrix& x = lips.mm;
  PositionMatrix jerk =
      kMetres * std::pow(lips.rate_hz, 3.0) *
      (x.bottomRows(count) - 3 * x.middleRows(2, count) + 3 * x.middleRows(1, count) - x.topRows(count));
  double power = 0;
  for (Eigen::Index t = 0; t < count; ++t) {
    const double window = 0.5 - 0.5 * std::cos(2 * std::numbers::pi * asReal(t) / asReal(count));
    jerk.row(t) *= window;
    power += window * window;
  }
  for (Eigen::Index k = 0; 2 * k <= count; ++k) {
    const double hz = asReal(k) * lips.rate_hz / asReal(count);
    if (hz >= LipFidelity::kEdgesHz.back()) break;
    const double step = 2 * std::numbers::pi * asReal(k) / asReal(count);
    const Eigen::RowVectorXd phases = step * Eigen::RowVectorXd::LinSpaced(count, 0, asReal(count - 1));
    const double energy =
        (phases.array().cos().matrix() * jerk).squaredNorm() + (phases.array().sin().matrix() * jerk).squaredNorm();
    const double sides = k == 0 || 2 * k == count ? 1 : 2;
    const auto edge = std::upper_bound(LipFidelity::kEdgesHz.begin(), LipFidelity::kEdgesHz.end(), hz);
    bands[unsignedIndex(edge - LipFidelity::kEdgesHz.begin()) - 1] += sides * energy;
  }
  const double all = power * asReal(count) * asReal(jerk.cols());
  for (double& band : bands) band = std::sqrt(band / all);
  return bands;
}

}  // namespace

std::string reportsToJson(const std::vector<TakeReport>& reports) {
  Json list = Json::array();
  for (const TakeReport& report : reports) list.push_back(toJson(report));
  return jsonText(list);
}

std::vector<TakeReport> reportsFromJson(const std::string& text) {
  const Json list = Json::parse(text, nullptr, false);
  std::vector<TakeReport> reports;
  if (!list.is_array()) return reports;
  try {
    for (const Json& json : list) reports.push_back(fromJson(json));
  } catch (const Json::exception&) {
    reports.clear();
  }
  return reports;
}

LipFidelity lipFidelity(const MotionClip& before, const MotionClip& after, const SpeechLabels& labels,
                        const LipGauge& gauge) {
  LipFidelity fidelity;
  if (!gauge.hasLips()) return fidelity;
  const LipPaths raw = lipPaths(before, gauge), clean = lipPaths(after, gauge);
  for (const LabelledPhone& phone : labels.phones) {
    if (!isBilabial(phone.phone)) continue;
    const auto was = tightest(raw, phone.span), is = tightest(clean, phone.span);
    if (was && is) fidelity.closure_changes_mm.push_back(*is - *was);
  }
  fidelity.jerk_before = jerkOf(raw);
  fidelity.jerk_after = jerkOf(clean);
  return fidelity;
}

}  // namespace mouthpiece
