#include "corpus_tools/takes/take_report.h"

#include <nlohmann/json.hpp>

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

}  // namespace

std::string reportsToJson(const std::vector<TakeReport>& reports) {
  Json list = Json::array();
  for (const TakeReport& report : reports) list.push_back(toJson(report));
  return list.dump(-1, ' ', false, Json::error_handler_t::replace);
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

}  // namespace mouthpiece
