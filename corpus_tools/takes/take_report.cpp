#include "corpus_tools/takes/take_report.h"

#include <nlohmann/json.hpp>

namespace mouthpiece {
namespace {

using Json = nlohmann::json;

Json toJson(const TakeReport& report) {
  Json doubtful = Json::array();
  for (const DoubtfulWord& word : report.doubtful) {
    doubtful.push_back(
        {{"word", word.text}, {"start_s", word.span.start}, {"end_s", word.span.end}, {"confidence", word.confidence}});
  }
  return {{"name", report.name},
          {"key", report.key},
          {"frames", report.frames},
          {"head_by_jig", report.jig_frames},
          {"head_by_skin", report.skin_frames},
          {"head_bridged", report.bridged_frames},
          {"head_residual_mm", report.head_residual_mm},
          {"scale", report.scale},
          {"swaps", report.swaps},
          {"spikes", report.spikes},
          {"gap_samples", report.gap_samples},
          {"filled_samples", report.filled_samples},
          {"missing_samples", report.missing_samples},
          {"noise_mm", report.noise_mm},
          {"smoothed_mm", report.smoothed_mm},
          {"closure_changes_mm", report.lips.closure_changes_mm},
          {"lip_jerk_before", report.lips.jerk_before},
          {"lip_jerk_after", report.lips.jerk_after},
          {"aligned_mm", report.aligned_mm},
          {"labels_found", report.labels_found},
          {"doubtful_words", doubtful}};
}

TakeReport fromJson(const Json& json) {
  TakeReport report;
  report.name = json.at("name").get<std::string>();
  report.key = json.value("key", "");
  report.frames = json.value("frames", std::size_t{0});
  report.jig_frames = json.value("head_by_jig", std::size_t{0});
  report.skin_frames = json.value("head_by_skin", std::size_t{0});
  report.bridged_frames = json.value("head_bridged", std::size_t{0});
  report.head_residual_mm = json.value("head_residual_mm", 0.0);
  report.scale = json.value("scale", 1.0);
  report.swaps = json.value("swaps", std::size_t{0});
  report.spikes = json.value("spikes", std::size_t{0});
  report.gap_samples = json.value("gap_samples", std::size_t{0});
  report.filled_samples = json.value("filled_samples", std::size_t{0});
  report.missing_samples = json.value("missing_samples", std::size_t{0});
  report.noise_mm = json.value("noise_mm", 0.0);
  report.smoothed_mm = json.value("smoothed_mm", 0.0);
  report.lips.closure_changes_mm = json.value("closure_changes_mm", std::vector<double>());
  report.lips.jerk_before = json.value("lip_jerk_before", LipFidelity::Bands{});
  report.lips.jerk_after = json.value("lip_jerk_after", LipFidelity::Bands{});
  report.aligned_mm = json.value("aligned_mm", 0.0);
  report.labels_found = json.value("labels_found", false);
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
